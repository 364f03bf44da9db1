"""The plan of a scan, and an auto scan, which goes on until every variant meets the tolerance."""

import math
import re
from contextlib import nullcontext

import numpy as np
import pytest

from scanfab import Cell, Packing, ScanfabWarning, Settings, SettingsError, compute, find_contacts
from scanfab.base.shapes import sphere
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.plan import make_plan
from scanfab.pipeline.state import cut_volumes
from scanfab.scan.directions import AUTO_RULE, direction_rule
from tests.helpers.lattices import simple_cubic
from tests.helpers.packed import sample_of

AUTO = [("packing", {}), ("packing", {"directions": 30}), ("repeated", {})]


@pytest.mark.parametrize(("sample", "options"), AUTO)
def test_auto_scan_meets_the_tolerance_for_every_variant(request, sample, options):
    table = compute(request.getfixturevalue(sample), tolerance=4e-4, **options)
    assert len(table) == 4
    assert table["alpha_vs_axial_se"].max() <= 4e-4


def test_much_missing_work_is_done_with_a_finer_rule_and_few_replicates(packing):
    """What a rule integrates exactly is no error, so a cube's faces need fewer lines in all."""
    auto = compute(packing, tolerance=4e-4, variants="a")[0]
    assert auto.directions > len(direction_rule(AUTO_RULE))
    same = compute(packing, tolerance=4e-4, variants="a", directions="icosahedral:9")[0]
    assert same.directions == len(direction_rule(AUTO_RULE))
    assert auto.lines < 0.7 * same.lines


def test_two_grains_of_which_few_lines_meet_both_do_not_hang():
    pair = find_contacts(Packing([[0, 0, 0], [3, 0, 0]], 1.0))
    with pytest.warns(ScanfabWarning, match="no void fabric"):
        row = compute(pair, tolerance=1e-2, variants="a", max_chords=1e9)[0]
    assert row.segments > 0
    assert row.alpha_vs is None


def test_auto_directions_takes_more_axes_and_keeps_spacing_and_replicates(packing):
    options = {"spacing": 0.2, "variants": "c"}
    coarse, fine = (compute(packing, tolerance=t, **options)[0] for t in (1.0, 4e-4))
    assert fine.directions > coarse.directions
    assert fine.alpha_vs_axial_se <= 4e-4
    assert fine.replicates == coarse.replicates
    assert fine.spacing == coarse.spacing == pytest.approx(0.2)


def test_a_periodic_whole_alone_takes_about_as_many_lines_as_the_open_one(packing, repeated):
    """Without an RV no image of a grain is near the origin."""
    here, there = (compute(one, variants="b", tolerance=4e-4)[0] for one in (packing, repeated))
    assert there.alpha_vs_axial_se <= 4e-4
    assert 0.2 < there.spacing / here.spacing < 5.0


BUDGETS = [("packing", "a", 1e5, 0.5), ("packing", "a", 1e6, 0.5)]
BUDGETS += [("repeated", variants, 1e6, 0.1) for variants in ("a", "abcd")]


@pytest.mark.parametrize(("sample", "variants", "most", "least"), BUDGETS)
def test_scan_stops_before_it_cuts_more_chords_than_allowed(request, sample, variants, most, least):
    """Of 216 grains in a window, or periodic; a chord is where a line meets a grain."""
    source = request.getfixturevalue(sample)
    with pytest.warns(ScanfabWarning, match="tolerance is 1e-06: .* stopped.*`max_chords`"):
        row = compute(source, tolerance=1e-6, variants=variants, max_chords=most)[0]
    chords = np.pi * np.sum(source.radius**2) / row.spacing**2 * row.directions
    assert least * most < chords <= 1.1 * most
    assert row.alpha_vs_axial_se > 1e-6


@pytest.mark.parametrize("variants", ["a", "abcd"])
def test_a_budget_for_too_few_lines_is_refused(repeated, variants):
    with pytest.raises(SettingsError, match=r"max_chords: expected at least .*, found 10000"):
        compute(repeated, spacing=0.02, variants=variants, max_chords=1e4)
    told = "max_chords: expected at least 256, .* found 100: choose fewer `directions`"
    with pytest.raises(SettingsError, match=told):
        compute(repeated, max_chords=100, variants=variants)


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_following_lines_through_an_empty_cell_counts_in_the_budget(packing):
    """
    Grains in a cell four times as long, wide and high.

    Lines are set further apart than the tolerance asks for, and the note says why.
    """
    nearly_empty = Packing(packing.position, packing.radius, cell=Cell([24.0] * 3))
    options = {"tolerance": 1e-5, "variants": "ab"}
    with pytest.warns(ScanfabWarning, match="of the work was to follow long void.*`periodic"):
        few = compute(nearly_empty, max_chords=3e6, **options)[0]
    more = compute(nearly_empty, max_chords=2e7, **options)[0]
    assert few.lines < 0.3 * more.lines
    assert few.alpha_vs_axial_se > 1e-5


@pytest.fixture(scope="module")
def loose():
    """Grains that touch no other, and two squares of four that do, far from one another."""
    lattice = simple_cubic(6, 2.6).position - 1.3
    position = lattice + np.random.default_rng(0).uniform(0, 0.4, lattice.shape)
    square = 0.98 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    squares = np.concatenate([square + 5.5, square + 9.5])
    apart = np.linalg.norm(position[:, None] - squares, axis=2).min(axis=1) > 2.001
    return find_contacts(Packing(np.concatenate([position[apart], squares]), 1.0))


def test_a_variant_that_cannot_meet_the_tolerance_does_not_hold_back_its_neighbour(loose):
    options = {"tolerance": 1e-3, "max_chords": 1e8}
    (alone,) = compute(loose, variants="a", **options)
    with pytest.warns(ScanfabWarning) as caught:
        whole, few = compute(loose, variants="ab", **options)
    assert few.grains == 8 < 0.1 * whole.grains
    assert whole.alpha_vs_axial_se <= 1e-3
    assert whole.lines == alone.lines
    (told,) = {str(one.message) for one in caught if "tolerance" in str(one.message)}
    assert f"variant b: alpha_vs_axial_se is {few.alpha_vs_axial_se:.2g}, where" in told


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_a_variant_without_a_grain_takes_no_steps_from_the_others(repeated):
    """Lines of b, for which all of a periodic sample is void, are not followed."""
    options = {"directions": "lebedev:5", "spacing": 0.5, "min_contacts": 99}
    whole, _ = compute(repeated, variants="ab", **options)
    (alone,) = compute(repeated, variants="a", **options)
    assert whole.alpha_vs_axial_sample_se == alone.alpha_vs_axial_sample_se


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
@pytest.mark.parametrize("sample", ["packing", "loose"])
def test_the_whole_and_the_rv_are_scanned_as_if_each_were_alone(sample, request):
    options = {"tolerance": 2e-3, "max_chords": 3e6, "rv": (0.5, 0.7), "seed": 4}
    source = request.getfixturevalue(sample)
    alone = [row for names in ("ab", "cd") for row in compute(source, variants=names, **options)]
    for row, expected in zip(compute(source, **options), alone, strict=True):
        assert dict(row) == {**expected, "rv": row["rv"]}
    # a fixed scan has the same lines for all
    fixed = compute(source, spacing=0.5, directions=20, rv=(0.5, 0.7))
    assert len({row.spacing for row in fixed}) == 1


def test_the_tolerance_auto_is_a_twentieth_of_the_error_of_the_sample(packing):
    for row in compute(packing, seed=2):
        aim = 0.05 * row.alpha_vs_axial_sample_se
        assert aim > 1e-4
        assert 0.1 * aim < row.alpha_vs_axial_se <= aim
        (same,) = compute(packing, seed=2, variants=row.variant, tolerance=aim)
        error = pytest.approx(row.alpha_vs_axial_sample_se, rel=1e-12)
        assert same.alpha_vs_axial_sample_se == error
        assert same.alpha_vs_axial == pytest.approx(row.alpha_vs_axial, abs=5 * aim)
    # map and calibrate read it as 1e-4
    assert Settings().aim() == MapSettings(slices=2).aim() == 1e-4


def test_variants_without_grains_ask_for_no_lines(packing):
    """The RV lies in the empty middle of a shell of grains."""
    far = np.linalg.norm(packing.position - packing.position.mean(axis=0), axis=1) > 2.2
    shell = find_contacts(Packing(packing.position[far], packing.radius[far]))
    options = {"rv_radius": 0.5, "tolerance": 3e-4}
    table = compute(shell, **options)
    assert [row.alpha_vs is None for row in table] == [False, False, True, True]
    assert [row.grains for row in table[2:]] == [0, 0]
    assert table[2].lines < 0.1 * table[0].lines


def test_scan_tells_how_far_it_is_and_how_long_the_rest_takes(packing, caplog):
    with caplog.at_level("INFO", logger="scanfab"):
        compute(packing, tolerance=2e-4, variants="a")
    states = [one.getMessage() for one in caplog.records if ": error" in one.getMessage()]
    assert states
    for state in states:
        assert re.fullmatch(r"frame 0: error [\d.e-]+ of 0\.0002, about \d+ (s|min)", state)


def plan_of(packing, boundary=(), **options):
    return make_plan(Settings(**options), sample_of(packing, boundary))


def test_lengths_relative_to_radii_are_those_of_the_grains_without_the_boundary():
    packing = Packing([[0, 0, 0], [3, 0, 0], [6, 3, 3], [9, 0, 0]], [1.0, 0.5, 1.2, 0.1])
    for text, length in [("2rmin", 1.0), ("1rmean", 0.9), ("0.5rmax", 0.6), ("0.25", 0.25)]:
        plan = plan_of(packing, [3], cutoff=text, spacing="0.1rmin", directions=20, rv=0.9)
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


@pytest.mark.parametrize("tolerance", [1e-4, 1e-2])
def test_auto_spacing_never_makes_too_few_lines(packing, tolerance):
    plan = plan_of(packing, tolerance=tolerance)
    assert math.pi * plan.window.radius**2 / plan.spacing**2 >= 4 * 30 * (1 - 1e-9)


@pytest.mark.parametrize(("tolerance", "warns"), [(0.08, False), (0.07, True)])
def test_bias_of_a_rule_counts_over_a_tenth_of_the_tolerance(packing, tolerance, warns):
    """That of 100 Fibonacci directions is 0.0075."""
    notes = plan_of(packing, directions="fibonacci:100", tolerance=tolerance).notes
    assert any("isotropic" in note.text for note in notes) == warns


FEW_LINES = [
    # one replicate of few lines: no error, and some of its axes keep nothing
    ({"spacing": 0.8, "directions": "lebedev:5", "cutoff": 0.1}, None, (True, False)),
    ({"spacing": 0.9}, "variant c: in some direction no void segment is kept", (False, False)),
    ({"spacing": 0.2}, r"\d% of the directions keep no void segment in a rep", (True, True)),
    ({"spacing": 0.8, "cutoff": 1e3}, "segment reaches .*did you mean 1rmin?", (False, False)),
]


@pytest.mark.parametrize(("options", "told", "values"), FEW_LINES)
def test_few_lines_give_less_and_are_told(packing, options, told, values):
    words = {"directions": "lebedev:17", "cutoff": 1.5, "variants": "c", **options}
    with pytest.warns(ScanfabWarning, match=told) if told else nullcontext():
        (row,) = compute(packing, **words)
    assert (row.alpha_vs_axial is not None, row.alpha_vs_axial_se is not None) == values
    assert (row.mean_length is not None) == values[0]


@pytest.mark.filterwarnings("ignore:.*no contact at all by geometry")
def test_size_ratio_of_a_thousand():
    """Large grains apart in a dust of small ones: void is what the volumes leave."""
    random = np.random.default_rng(0)
    lattice = simple_cubic(4, 3.0).position
    dust = random.uniform(1, 11, (3000, 3))
    dust = dust[np.linalg.norm(dust[:, None] - lattice, axis=2).min(axis=1) > 1.01]
    radius = np.append(np.ones(len(lattice)), np.full(len(dust), 0.001))
    options = {"variants": "c", "tolerance": 1e-3, "cutoff": 0.5, "rv_radius": 4.0}
    row = compute(Packing(np.vstack([lattice, dust]), radius), **options)[0]
    assert row.alpha_vs_axial_se <= 1e-3
    window = sphere(4.0)
    inside = cut_volumes(lattice - 6.0, np.ones(len(lattice)), window).sum() / window.volume
    assert row.solid_fraction == pytest.approx(inside, abs=0.01)
