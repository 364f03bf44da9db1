"""The plan: settings turned into lengths, lines and replicates by the first frame."""

import math
from contextlib import nullcontext

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, Settings, SettingsError, compute
from scanfab.packing.sample import Sample
from scanfab.pipeline.plan import make_plan


def plan_of(packing, boundary=None, **options):
    none = np.zeros(len(packing), bool)
    sample = Sample(packing, none if boundary is None else np.asarray(boundary))
    return make_plan(Settings(**options), sample)


def test_lengths_relative_to_radii_are_those_of_the_grains_without_the_boundary():
    packing = Packing([[0, 0, 0], [3, 0, 0], [6, 3, 3], [9, 0, 0]], [1.0, 0.5, 1.2, 0.1])
    boundary = [False, False, False, True]
    for text, length in [("2rmin", 1.0), ("1rmean", 0.9), ("0.5rmax", 0.6), ("0.25", 0.25)]:
        plan = plan_of(packing, boundary, cutoff=text, spacing="0.1rmin", directions=20, rv=0.9)
        assert plan.cutoff == pytest.approx(length)
    assert plan.spacing / math.sqrt(plan.replicates) == pytest.approx(0.05)
    # surfaces from -1 to 7.2, 4.2 and 4.2
    assert plan.window.radius == pytest.approx(0.9 * 5.2 / 2)
    assert plan.window.center == pytest.approx([3.1, 1.6, 1.6])


@pytest.mark.parametrize("spacing", [0.1, 0.5, 1.5])
def test_a_fixed_scan_has_sixteen_replicates_or_thirty_lines_in_each(packing, spacing):
    plan = plan_of(packing, spacing=spacing, directions="lebedev:11")
    assert (plan.rule.name, plan.auto) == ("lebedev:11", "")
    area = math.pi * plan.window.radius**2
    lines = area / plan.spacing**2
    assert plan.spacing == pytest.approx(spacing * math.sqrt(plan.replicates))
    assert 1 <= plan.replicates <= 16
    assert lines >= 30 or plan.replicates == 1
    # and no fewer replicates than that takes
    assert plan.replicates == 16 or area / spacing**2 / (plan.replicates + 1) < 30


def test_spacing_column_is_that_of_all_replicates_together(packing):
    rows = compute(packing, spacing=0.25, directions="lebedev:5", variants="ac", rv_radius=2.0)
    lines = math.pi * 2.0**2 / 0.25**2
    for row in rows:
        assert row.spacing == pytest.approx(0.25)
        assert row.replicates == int(lines / 30) == 6
        assert row.directions == 7
    # lines of the RV: area over spacing squared, in each direction
    assert rows[1].lines == pytest.approx(lines * 7, rel=0.06)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-2])
def test_auto_spacing_never_makes_too_few_lines(packing, tolerance):
    plan = plan_of(packing, tolerance=tolerance)
    assert math.pi * plan.window.radius**2 / plan.spacing**2 >= 4 * 30 * (1 - 1e-9)


@pytest.mark.parametrize(("tolerance", "warns"), [(0.08, False), (0.07, True)])
def test_bias_of_a_rule_counts_over_a_tenth_of_the_tolerance(packing, tolerance, warns):
    """That of 100 Fibonacci directions is 0.0075."""
    notes = plan_of(packing, directions="fibonacci:100", tolerance=tolerance).notes
    assert any("isotropic" in note.text for note in notes) == warns


@pytest.mark.parametrize("options", [{"variants": "a"}, {"variants": "cd", "directions": 20}])
def test_spacing_wider_than_the_sample_is_refused(packing, options):
    match = r"spacing: expected a length from .* found 100: .*1rmin \(0\.4"
    with pytest.raises(SettingsError, match=match):
        plan_of(packing, spacing=100.0, **options)


@pytest.mark.parametrize(
    ("options", "told", "values"),
    [
        # one replicate of few lines: no error, and some of its axes keep nothing
        ({"spacing": 0.8, "directions": "lebedev:5", "cutoff": 0.1}, None, (True, False)),
        ({"spacing": 0.9}, "variant c: in some direction no void segment is kept", (False, False)),
        ({"spacing": 0.2}, r"\d% of the directions keep no void segment in a rep", (True, True)),
        (
            {"spacing": 0.8, "cutoff": 1000.0},
            "no void segment reaches .*did you mean 1rmin?",
            (False, False),
        ),
    ],
)
def test_few_lines_give_less_and_are_told(packing, options, told, values):
    words = {"directions": "lebedev:17", "cutoff": 1.5, "variants": "c", **options}
    with pytest.warns(ScanfabWarning, match=told) if told else nullcontext():
        (row,) = compute(packing, **words)
    assert (row.alpha_vs_axial is not None, row.alpha_vs_axial_se is not None) == values
    assert (row.mean_length is not None) == values[0]
