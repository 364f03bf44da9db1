"""Curves of tables: what they are called and drawn over, and whether they miss the fabric."""

from __future__ import annotations

import re

import pytest

from scanfab.table.curves import (
    curves_of,
    frame_strain_column,
    is_turned,
    short_names,
    spelt_strain,
    strain_column,
    why_not_strain,
)
from tests.helpers.tables import curve, sheared


def changed(source="one", frame=None, **values):
    """The rows of a curve with other values, in one frame or in all."""
    return [{**row, **values} if frame in (None, row["frame"]) else row for row in curve(source)]


# a strain that differs by rounding errors, and one that is small
ROUNDED = [{**row, "strain": 0.25 + 1e-12 * row["frame"]} for row in curve("one")]
SMALL = [{**row, "strain": 1e-6 * row["frame"]} for row in curve("one")]
SHEARED_TOO = [{**row, "shear_strain": row["strain"]} for row in curve("one")]
FRAME, SHEAR = "the frame number is used in place of", "shear_strain is used in place of"


@pytest.mark.parametrize(
    ("rows", "column", "hint"),
    [
        ([*curve("one"), *curve("two", "d")], "strain", None),
        (SMALL, "strain", None),
        (curve("one")[2:3], "strain", None),
        ([], None, None),
        (changed(strain=None), None, None),
        ([*curve("one"), *changed("two", strain=None)], None, f"{FRAME} .*because two has none: "),
        (changed(frame=3, strain=None), None, f"{FRAME} .*because one has none in frame 3: "),
        (changed(frame=3, strain=None, alpha_vs_axial=None), "strain", None),
        (changed(strain=0.25), None, r"because one has the same in all frames \(0.25\): "),
        (ROUNDED, None, r"because one has the same in all frames \(0.25\): "),
        (sheared(), "shear_strain", rf"{SHEAR} .*because shear has the same in all frames \(0\): "),
        ([*sheared(), *curve("one")], None, FRAME),
        ([*sheared(), *SHEARED_TOO], "shear_strain", SHEAR),
        (changed(strain=0.25, shear_strain=0.0), None, FRAME),
    ],
)
def test_a_strain_that_all_frames_have_is_the_abscissa_and_a_hint_tells_of_any_other(
    rows, column, hint
):
    assert strain_column(rows) == column
    found = why_not_strain(rows)
    assert found is None if hint is None else re.search(hint, found)


@pytest.mark.parametrize(
    ("axial", "shear", "column"),
    [
        (0.1, 0.2, "strain"),
        (0.0, 0.2, "shear_strain"),
        (1e-12, 0.2, "shear_strain"),
        (None, 0.2, "shear_strain"),
        (0.0, 0.0, "strain"),
        (0.0, None, "strain"),
        (None, None, None),
    ],
)
def test_a_single_frame_has_the_strain_that_is_not_zero(axial, shear, column):
    assert frame_strain_column({"strain": axial, "shear_strain": shear}) == column


def test_a_strain_is_spelt_for_titles():
    row = {"strain": 0.1234567, "shear_strain": None}
    assert spelt_strain(row, "strain") == "axial strain 12.3 %"
    assert spelt_strain(row, "strain", symbol=True) == r"$\varepsilon_a$ = 12.3 %"
    assert spelt_strain(row, "shear_strain") == spelt_strain(row, None) == ""


@pytest.mark.parametrize(
    ("sources", "names"),
    [(("runs/dense", "runs/loose"), ["dense", "loose"]), (("one/x", "two/x"), ["one/x", "two/x"])],
)
def test_sources_are_called_by_the_last_part_of_their_path(sources, names):
    rows = [row for source in sources for row in curve(source)]
    assert [one.source for one in curves_of(rows)] == names


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
