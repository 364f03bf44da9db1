"""Numbers of the report, spelt with their errors."""

from __future__ import annotations

import pytest

from scanfab.table.compare import compare_tables
from scanfab.viz.report.tables import frame_table, overview, results_tables
from tests.helpers.tables import curve, sheared


def results_of(value, **errors):
    """The cells of the results of one frame, by the first one of their line."""
    row = {**curve()[0], "alpha_vs_axial": value, "alpha_vs_axial_se": 0.0, **errors}
    (part,) = results_tables(compare_tables([row]).summary, [row])
    return dict(part.rows)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0120584, 0.00099125, "0.01206 ± 0.00099"),
        (0.0120584, 0.00099999, "0.0121 ± 0.0010"),
        (-0.3, 0.12, "-0.30 ± 0.12"),
        (12.3, 4.2, "12.3 ± 4.2"),
        (0.0120584, None, "0.01206"),
        (0.0120584, 0.0, "0.01206"),
    ],
)
def test_a_value_has_the_digits_that_its_error_leaves(value, error, text):
    cells = results_of(value, alpha_vs_axial_sample_se=error)
    assert cells["α_vs, frame 0"] == text


@pytest.mark.parametrize(("error", "text"), [(0.001, "0.0010"), (7.41e-5, "7.4e-05")])
def test_errors_have_two_digits(error, text):
    assert results_of(0.01, alpha_vs_axial_se=error)["its error: scan"] == text


def test_what_is_not_known_is_a_dash():
    rows = [{**row, "alpha_vs_axial": None} if not row["frame"] else row for row in curve()]
    part = frame_table(rows)
    place = part.columns.index("α_vs")
    assert [row[place] == "-" for row in part.rows] == [True, False, False, False, False]


def test_without_the_scan_s_part_there_is_no_error_in_all():
    cells = results_of(0.0120584, alpha_vs_axial_sample_se=9e-4, alpha_vs_axial_se=None)
    assert "±" not in cells["α_vs, frame 0"]
    assert cells["its error: sample"] == "0.00090"


def grains(**of_variants):
    rows = [
        {**row, "grains": number}
        for variant, numbers in of_variants.items()
        for row, number in zip(curve(variant=variant), numbers, strict=False)
    ]
    return overview("t.csv", rows).split("; ")[2]


def test_grains_are_told_by_variant_and_one_number_is_no_range():
    assert grains(c=[143, 143]) == "143 grains"
    assert grains(a=[800], b=[800]) == "800 grains"
    assert grains(c=[140, 143]) == "140 to 143 grains"
    found = grains(a=[800, 800], c=[235, 286])
    assert found == "grains: 800 in a, 235 to 286 in c"


def test_one_strain_is_no_range():
    assert overview("t.csv", curve()[1:2]).endswith("; axial strain 1 %.")


@pytest.mark.filterwarnings("ignore:shear_strain stands")
def test_turned_axes_lead_with_intensities_and_have_no_slope():
    """The axial values miss the fabric: they are about 0 whatever it is."""
    rows = [{**row, "alpha_vs_axial_sample_se": 1e-3} for row in sheared()]
    (part,) = results_tables(compare_tables(rows).summary, rows)
    names = [name for name, *_ in part.rows]
    assert part.rows[0] == ["intensity α_vs at shear strain 40 %", "0.0300"]
    assert part.rows[1] == ["intensity α_c at shear strain 40 %", "0.0600"]
    assert part.rows[2] == ["angle between their axes at shear strain 40 %", "36°"]
    assert part.rows[3] == ["α_vs along the loading axis at shear strain 40 %", "0.0040 ± 0.0010"]
    assert not any("slope" in name for name in names)
    assert "the axis of the contact fabric" in part.note
    columns = list(frame_table(rows).columns)
    assert columns.index("void intensity") < columns.index("α_vs")
    assert list(frame_table(curve()).columns).index("α_vs") == 3
