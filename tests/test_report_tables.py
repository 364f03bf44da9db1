"""Numbers of the report, spelt with their errors."""

from __future__ import annotations

import pytest

from scanfab.compare import compare_tables
from scanfab.report_tables import frame_table, results_tables
from tests.tables import curve


def results_of(value, **errors):
    """The cells of the results of one frame, by the first one of their line."""
    row = {**curve()[0], "alpha_vs_axial": value, "alpha_vs_axial_se": None, **errors}
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
