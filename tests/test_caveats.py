"""Warnings of the report: each appears where it should, and only there."""

from __future__ import annotations

import pytest

from scanfab.caveats import caveats_of
from tests.tables import curve


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
        ({"alpha_vs_axial_se": 0.01}, "more than a tenth of the largest void anisotropy"),
        ({"alpha_vs_axial_se": None}, "no standard error"),
        ({"grains": 20}, "in variant c (20 grains, largest value 0.05)"),
        ({"alpha_vs_axial_sample_se": 0.02}, "by about 0.02"),
        ({"alpha_vs_axial": None}, "5 of 5 rows have no void fabric"),
    ],
)
def test_what_is_wrong_is_told(values, part):
    (text,) = caveats_of(rows(**values), [])
    assert part in text


def test_the_sample_s_own_error_counts_more_than_the_rule_of_thumb():
    assert caveats_of(rows(grains=20, alpha_vs_axial_sample_se=1e-4), []) == []


def test_two_frames_are_too_few_for_a_line():
    (text,) = caveats_of(rows()[:2], [])
    assert "fewer than three frames" in text


@pytest.mark.parametrize("name", ["nonsense:3", ""])
def test_rules_that_nobody_knows_are_passed_over(name):
    assert caveats_of(rows(), [{"directions": name}]) == []
