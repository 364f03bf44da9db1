"""Curves of tables: what they are called, and whether they miss the fabric."""

from __future__ import annotations

import pytest

from scanfab.table.curves import curves_of, is_turned, short_names
from tests.helpers.tables import curve, sheared


def test_sources_are_called_by_the_last_part_of_their_path():
    rows = [*curve("runs/dense"), *curve("runs/loose")]
    assert [one.source for one in curves_of(rows)] == ["dense", "loose"]
    rows = [*curve("one/dumps"), *curve("two/dumps")]
    assert [one.source for one in curves_of(rows)] == ["one/dumps", "two/dumps"]


@pytest.mark.parametrize(("axial", "turned"), [(0.9, False), (0.4, True)])
def test_the_most_certain_frame_tells_whether_the_axes_are_turned(axial, turned):
    rows = [{**row, "alpha_c_axial": axial * row["alpha_c"]} for row in sheared()]
    rows[0].update(alpha_c=1.0, alpha_c_axial=0.0, alpha_c_axial_se=1.0)
    assert is_turned(rows) == turned
    assert is_turned(curve()) is False


def test_long_names_are_cut_in_the_middle_and_stay_different():
    names = [f"{'a' * 60}{end}" for end in "xy"]
    assert short_names(names) == {name: f"{'a' * 14}...{'a' * 13}{name[-1]}" for name in names}
    alike = [f"{'a' * 30}{end}{'b' * 30}" for end in "xy"]
    assert len(set(short_names(alike).values())) == 2
