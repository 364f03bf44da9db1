"""What tables are drawn and fitted over, and the hint where that is not the axial strain."""

from __future__ import annotations

import pytest

from scanfab.table.abscissa import (
    frame_strain_column,
    spelt_strain,
    strain_column,
    why_not_strain,
)
from tests.helpers.tables import curve, sheared


def without_strain(source):
    return [{**row, "strain": None} for row in curve(source)]


def at_rest(source):
    return [{**row, "strain": 0.25} for row in curve(source)]


def test_a_strain_that_every_frame_has_is_the_abscissa():
    rows = [*curve("one"), *curve("two", "d")]
    assert strain_column(rows) == "strain"
    assert why_not_strain(rows) is None


@pytest.mark.parametrize("rows", [[], without_strain("one")])
def test_without_any_strain_there_are_only_frames_and_nobody_wonders(rows):
    assert strain_column(rows) is None
    assert why_not_strain(rows) is None


def test_a_source_without_strain_is_named():
    rows = [*curve("one"), *without_strain("two")]
    assert strain_column(rows) is None
    assert why_not_strain(rows).startswith(
        "the frame's number stands in for the axial strain, as two has none: "
    )


def test_a_frame_without_strain_is_named():
    rows = curve("one")
    rows[3]["strain"] = None
    assert "as one has none in frame 3: " in why_not_strain(rows)


@pytest.mark.parametrize("noise", [0.0, 1e-12])
def test_a_constant_strain_counts_as_none(noise):
    rows = [{**row, "strain": 0.25 + noise * row["frame"]} for row in curve("one")]
    assert strain_column(rows) is None
    assert "as one has the same in all frames (0.25): " in why_not_strain(rows)


def test_a_small_strain_is_one():
    rows = [{**row, "strain": 1e-6 * row["frame"]} for row in curve("one")]
    assert strain_column(rows) == "strain"


def test_one_frame_has_no_other_strain_to_differ_from():
    assert strain_column(curve("one")[2:3]) == "strain"
    assert why_not_strain(curve("one")[2:3]) is None


def test_a_sheared_cell_is_drawn_over_its_shear():
    assert strain_column(sheared()) == "shear_strain"
    assert why_not_strain(sheared()).startswith(
        "shear_strain stands in for the axial strain, as shear has the same in all frames (0): "
    )


def test_all_sources_need_the_shear():
    assert strain_column([*sheared(), *curve("one")]) is None
    both = [{**row, "shear_strain": row["strain"]} for row in curve("one")]
    assert strain_column([*sheared(), *both]) == "shear_strain"


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


def test_frames_without_a_void_fabric_do_not_matter():
    rows = [*curve("one"), {**curve("one")[0], "frame": 9, "strain": None, "alpha_vs_axial": None}]
    assert strain_column(rows) == "strain"


def test_a_cell_at_rest_has_neither():
    rows = [{**row, "shear_strain": 0.0} for row in at_rest("one")]
    assert strain_column(rows) is None
