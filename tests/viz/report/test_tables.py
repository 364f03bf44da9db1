"""Numbers of the report with their errors, and warnings."""

import pytest

from scanfab.table.compare import compare_tables
from scanfab.viz.report.tables import caveats_of, frame_table, overview, results_tables
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
    assert cells["α_vs along the loading axis"] == text
    assert results_of(0.01, alpha_vs_axial_se=7.41e-5)["its error: scan"] == "7.4e-05"
    # without the scan's part there is no error in all
    cells = results_of(value, alpha_vs_axial_sample_se=9e-4, alpha_vs_axial_se=None)
    assert "±" not in cells["α_vs along the loading axis"]
    assert cells["its error: sample"] == "0.00090"


def test_what_is_not_known_is_a_dash():
    rows = [{**row, "alpha_vs_axial": None} if not row["frame"] else row for row in curve()]
    part = frame_table(rows)
    place = part.columns.index("α_vs")
    assert [row[place] == "-" for row in part.rows] == [True, False, False, False, False]


def test_grains_are_told_by_variant_and_one_strain_is_no_range():
    rows = [
        {**row, "grains": number} for v, number in (("a", 800), ("c", 286)) for row in curve("s", v)
    ]
    (part,) = results_tables(compare_tables(rows).summary, rows)
    assert ["grains", "800", "286"] in part.rows
    assert overview("t.csv", rows) == "5 frames of s; variants a, c; axial strain 0 to 4 %."
    assert overview("t.csv", curve()[1:2]).endswith("; axial strain 1 %.")


@pytest.mark.filterwarnings("ignore:shear_strain stands")
def test_turned_axes_lead_with_intensities_and_have_no_slope():
    """The axial values miss the fabric: they are about 0 whatever it is."""
    rows = [{**row, "alpha_vs_axial_sample_se": 1e-3} for row in sheared()]
    (part,) = results_tables(compare_tables(rows).summary, rows)
    assert part.rows[0] == ["void intensity", "0.03"]
    cells = dict(part.rows)
    assert len(cells) == len(part.rows)
    assert cells["shear strain"] == "40 %"
    assert cells["contact intensity"] == "0.06"
    assert cells["angle between their axes"] == "36°"
    assert cells["α_vs along the loading axis"] == "0.0040 ± 0.0010"
    assert not any("slope" in name for name in cells)
    assert "noise raises them" in part.note
    for table in (rows, curve()):
        assert frame_table(table).columns[:2] == ["frame", "variant"]
        assert "α_vs" in frame_table(table).columns[3:5]


def doubts(rows, **values):
    return caveats_of([{**row, "grains": 100_000, **values} for row in rows])


@pytest.mark.parametrize(
    ("scan", "sample", "part"),
    [
        (None, None, "error of the scan: it was made of one replicate"),
        (0.012, 0.016, "(0.02 beside 0.05). A smaller `tolerance` or `spacing` makes the scan's"),
        (0.012, 0.016, "part smaller (0.012), only more grains the sample's part (0.016)"),
        # parts that are small alone
        (0.004, 0.004, "(0.0057 beside 0.05)"),
    ],
)
def test_what_is_wrong_is_told(scan, sample, part):
    """The error is that of scan and sample together, and what makes it smaller is said."""
    (text,) = doubts(curve(), alpha_vs_axial_se=scan, alpha_vs_axial_sample_se=sample)
    assert part in text


def test_a_sound_table_has_no_warning():
    assert doubts(curve()) == []
    (text,) = doubts(curve()[:2])
    assert "fewer than three frames" in text
    (text,) = doubts(curve(), alpha_vs_axial=None)
    assert "5 of 5 rows have no void fabric" in text


def test_the_errors_are_those_of_the_frame_with_the_largest_value():
    """An error of another frame says nothing of the signal."""
    large = {"alpha_vs_axial_se": 0.02, "alpha_vs_axial_sample_se": 0.03, "grains": 20}
    small = {"alpha_vs_axial_se": 1e-4, "alpha_vs_axial_sample_se": 1e-4}
    first, second, peak, *rest = [{**row, **small} for row in curve()]
    assert doubts([{**first, **large}, second, peak, *rest]) == []
    (text,) = doubts([first, second, {**peak, **large}, *rest])
    assert "(0.036 beside 0.05)" in text
