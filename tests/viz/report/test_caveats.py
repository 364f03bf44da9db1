"""Warnings of the report: each appears where it should, and only there."""

from __future__ import annotations

import pytest

from scanfab.viz.report.caveats import caveats_of
from tests.helpers.tables import curve


def rows(**values):
    return [{**row, "grains": 100_000, **values} for row in curve()]


def test_a_sound_table_has_none():
    assert caveats_of(rows(), [{"directions": None}, {"directions": "lebedev:11"}]) == []


def test_a_biased_rule_is_told_with_its_bias():
    (text,) = caveats_of(rows(), [{"directions": "equal-angle:10"}])
    assert "equal-angle:10" in text
    assert "0.43" in text


@pytest.mark.parametrize(
    ("values", "part"),
    [
        (
            {"alpha_vs_axial_se": None},
            "standard error of the scan: it was made of one replicate",
        ),
        ({"alpha_vs_axial": None}, "5 of 5 rows have no void fabric"),
        (
            {"alpha_vs_axial_se": 0.01, "alpha_vs_axial_sample_se": 1e-4},
            "(0.01 beside 0.05; scan 0.01, sample 0.0001). More lines would help",
        ),
        (
            {"alpha_vs_axial_sample_se": 0.02},
            "(0.02 beside 0.05; scan 0.0003, sample 0.02). Only more grains would help",
        ),
        (
            {"alpha_vs_axial_se": 0.012, "alpha_vs_axial_sample_se": 0.016},
            "(0.02 beside 0.05; scan 0.012, sample 0.016). It takes more grains, and more lines",
        ),
    ],
)
def test_what_is_wrong_is_told(values, part):
    """The error is that of scan and sample together, and what makes it smaller is said."""
    (text,) = caveats_of(rows(**values), [])
    assert part in text


def test_parts_that_are_small_alone_can_be_large_together():
    values = {"alpha_vs_axial_se": 0.004, "alpha_vs_axial_sample_se": 0.004}
    (text,) = caveats_of(rows(**values), [])
    assert "(0.0057 beside 0.05;" in text


def test_the_errors_are_those_of_the_frame_with_the_largest_value():
    """An error of another frame says nothing of the signal."""
    large = {"alpha_vs_axial_se": 0.02, "alpha_vs_axial_sample_se": 0.03, "grains": 20}
    small = {"alpha_vs_axial_se": 1e-4, "alpha_vs_axial_sample_se": 1e-4}
    first, second, peak, *rest = rows(**small)
    assert caveats_of([{**first, **large}, second, peak, *rest], []) == []
    (text,) = caveats_of([first, second, {**peak, **large}, *rest], [])
    assert "(0.036 beside 0.05; scan 0.02, sample 0.03)" in text


def test_a_peak_without_an_error_of_its_own_has_that_of_the_others():
    first, second, peak, *rest = rows(alpha_vs_axial_sample_se=0.02)
    peak["alpha_vs_axial_sample_se"] = None
    (text,) = caveats_of([first, second, peak, *rest], [])
    assert "sample 0.02)" in text


def test_a_column_that_is_not_there_is_no_single_replicate():
    chosen = [{k: v for k, v in row.items() if k != "alpha_vs_axial_se"} for row in rows()]
    (text,) = caveats_of(chosen, [])
    assert "no column alpha_vs_axial_se" in text
    assert "replicate" not in text


def test_two_frames_are_too_few_for_a_line():
    (text,) = caveats_of(rows()[:2], [])
    assert "fewer than three frames" in text


@pytest.mark.parametrize("name", ["nonsense:3", ""])
def test_rules_that_nobody_knows_are_passed_over(name):
    assert caveats_of(rows(), [{"directions": name}]) == []
