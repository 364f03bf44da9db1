"""An auto scan goes on until every variant meets the tolerance, and no further than needed."""

import re

import numpy as np
import pytest

from scanfab import (
    Cell,
    Packing,
    ScanfabWarning,
    Settings,
    SettingsError,
    compute,
    direction_rule,
    find_contacts,
    scan_lines,
    void_fabric,
)
from scanfab.packing.sample import Sample
from scanfab.pipeline import tolerance as adaptive
from scanfab.pipeline.plan import REPLICATES, make_plan
from scanfab.scan.directions import AUTO_RULE, DirectionRule
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.solids import Solids
from tests.helpers.lattices import shaken_cubic
from tests.helpers.scanning import solids_of


@pytest.fixture(scope="module")
def packing():
    return find_contacts(Packing(*shaken_cubic(np.random.default_rng(0), 6)))


@pytest.fixture(scope="module")
def repeated():
    """The same grains in a cell that repeats."""
    spheres = shaken_cubic(np.random.default_rng(0), 6)
    return find_contacts(Packing(*spheres, cell=Cell(6.0 * np.eye(3), (True, True, True))))


@pytest.mark.parametrize("options", [{}, {"directions": 30}, {"spacing": "0.4rmin"}])
@pytest.mark.parametrize("tolerance", [5e-3, 4e-4])
def test_auto_scan_meets_the_tolerance_for_every_variant(packing, options, tolerance):
    table = compute(packing, tolerance=tolerance, **options)
    assert len(table) == 4
    assert table["alpha_vs_axial_se"].max() <= tolerance


def test_auto_scan_serves_all_variants_with_the_same_lines(packing):
    table = compute(packing, tolerance=4e-4)
    assert len(set(table["replicates"])) == 1
    assert table["replicates"][0] > REPLICATES


def test_rounds_of_an_auto_scan_never_draw_the_same_lines_again(packing):
    """Together they are the scan of as many replicates, numbered from 0."""
    centred = Packing(packing.position - 3.0, packing.radius)
    solids = solids_of(centred, 2.0)
    settings = Settings(
        variants="c", tolerance=1e-4, workers=1, cutoff=0.4, directions="icosahedral:9"
    )
    plan = make_plan(settings, Sample(find_contacts(centred), np.zeros(len(packing), bool)))
    sums, plan, _ = adaptive.scan_to_tolerance(solids, plan)
    again = scan_lines(
        solids,
        plan.rule,
        spacing=plan.spacing,
        cutoff=plan.cutoff,
        variants="c",
        replicates=range(sums.replicates),
    )
    assert sums.replicates > REPLICATES
    assert np.array_equal(sums.axes, again.axes)
    assert np.array_equal(sums.length, again.length)


def test_auto_scan_does_not_much_more_than_it_must(packing):
    """The worst variant's error is not far below the tolerance."""
    table = compute(packing, tolerance=4e-4)
    assert table["alpha_vs_axial_se"].max() > 2e-4


def test_a_scan_of_a_given_spacing_does_not_stop_at_an_error_that_is_small_by_chance(packing):
    """The estimate from all mean lengths lies so far below that chance seldom helps."""
    centred = find_contacts(Packing(packing.position - 3.0, packing.radius))
    solids = solids_of(centred, 2.0)
    for seed in range(6):
        settings = Settings(
            variants="c", tolerance=1e-3, spacing=0.15, cutoff=0.4, seed=seed, workers=1
        )
        plan = make_plan(settings, Sample(centred, np.zeros(len(packing), bool)))
        sums, plan, _ = adaptive.scan_to_tolerance(solids, plan)
        fabric = void_fabric(sums.axes, plan.rule.weights, *sums.kept("c"))
        assert 1.2 * fabric.expected_error(settings.axis, plan.rule.degree) <= 1e-3
        assert fabric.axial_error(settings.axis) <= 1e-3


def test_smaller_tolerance_takes_more_lines(packing):
    counts = [compute(packing, tolerance=t, variants="c")["lines"][0] for t in (1e-2, 4e-4, 2e-4)]
    assert counts[0] < counts[1] < counts[2]


def test_much_missing_work_is_done_with_a_finer_rule_and_few_replicates(packing):
    """What a rule integrates exactly is no error, so a cube's faces need fewer lines in all."""
    auto = compute(packing, tolerance=4e-4, variants="a")[0]
    assert auto.directions > len(direction_rule(AUTO_RULE))
    same = compute(packing, tolerance=4e-4, variants="a", directions="icosahedral:9")[0]
    assert same.directions == len(direction_rule(AUTO_RULE))
    assert auto.lines < 0.7 * same.lines


def test_directions_that_are_no_design_have_an_error_too(packing):
    """Three axes tell little of an even polynomial, but they are a rule that users may make."""
    rule = DirectionRule("mine", np.eye(3), np.full(3, 1 / 3), None, turned=False)
    row = compute(packing, tolerance=1e-2, variants="c", directions=rule)[0]
    assert 0 < row.alpha_vs_axial_se <= 1e-2


def test_two_grains_of_which_few_lines_meet_both_do_not_hang():
    pair = find_contacts(Packing([[0, 0, 0], [3, 0, 0]], 1.0))
    with pytest.warns(ScanfabWarning, match="no void fabric"):
        row = compute(pair, tolerance=1e-2, variants="a")[0]
    assert row.segments > 0
    assert row.alpha_vs is None


def test_auto_directions_takes_more_axes_and_keeps_spacing_and_replicates(packing):
    options = {"spacing": 0.2, "variants": "c"}
    coarse, fine = (compute(packing, tolerance=t, **options)[0] for t in (1.0, 4e-4))
    assert fine.directions > coarse.directions
    assert fine.replicates == coarse.replicates
    assert fine.spacing == coarse.spacing == pytest.approx(0.2)


def test_tolerance_does_not_matter_to_a_fixed_scan(packing):
    options = {"spacing": 0.2, "directions": 20, "variants": "c"}
    strict, loose = (compute(packing, tolerance=t, **options) for t in (1e-6, 1.0))
    assert strict.rows == loose.rows


def test_auto_scan_looks_at_the_loading_axis(packing):
    tolerance = 4e-4
    table = compute(packing, tolerance=tolerance, axis=(1.0, 1.0, 0.0))
    assert table["alpha_vs_axial_se"].max() <= tolerance


@pytest.mark.parametrize(
    ("limit", "value", "options"),
    [("MAX_REPLICATES", 32, {}), ("MAX_DIRECTIONS", 30, {"spacing": 0.3})],
)
def test_scan_that_stops_short_of_its_tolerance_says_so(
    packing, monkeypatch, limit, value, options
):
    monkeypatch.setattr(adaptive, limit, value)
    with pytest.warns(ScanfabWarning, match="before the tolerance 1e-05 was met"):
        row = compute(packing, tolerance=1e-5, variants="c", **options)[0]
    assert row.alpha_vs_axial_se > 1e-5
    assert row.alpha_vs is not None


def test_scan_stops_before_it_cuts_more_chords_than_allowed(packing):
    """Of 216 grains in a window; a chord is where a line meets a grain."""
    cut = []
    for most in (1e5, 1e6):
        with pytest.warns(ScanfabWarning, match="1e-06 was met.*`max_chords`"):
            row = compute(packing, tolerance=1e-6, variants="a", max_chords=most)[0]
        chords = np.pi * np.sum(packing.radius**2) / row.spacing**2 * row.directions
        cut.append(chords)
        assert 0.5 * most < chords <= 1.1 * most
        assert row.alpha_vs_axial_se > 1e-6
    assert cut[0] < cut[1]


@pytest.mark.parametrize("variants", ["a", "b", "ab", "ac"])
def test_periodic_whole_takes_about_as_many_lines_as_the_open_one(packing, repeated, variants):
    """Also without an RV, where no image of a grain is near the origin."""
    lines = {"variants": variants, "tolerance": 4e-4}
    here, there = compute(packing, **lines), compute(repeated, **lines)
    assert there["alpha_vs_axial_se"].max() <= 4e-4
    for one, other in zip(here, there, strict=True):
        assert 0.2 < other.spacing / one.spacing < 5.0


@pytest.mark.parametrize("variants", ["a", "abcd"])
def test_budget_holds_for_periodic_packings_too(repeated, variants):
    with pytest.warns(ScanfabWarning, match="1e-06 was met.*`max_chords`"):
        row = compute(repeated, tolerance=1e-6, variants=variants, max_chords=1e6)[0]
    chords = np.pi * np.sum(repeated.radius**2) / row.spacing**2 * row.directions
    assert 0.1e6 < chords <= 1.1e6
    with pytest.raises(SettingsError, match="max_chords: 10000 chords are fewer"):
        compute(repeated, spacing=0.02, variants=variants, max_chords=1e4)
    with pytest.raises(SettingsError, match="max_chords: 100 chords are fewer"):
        compute(repeated, max_chords=100, variants=variants)


@pytest.fixture
def nearly_empty(packing):
    """Grains in a cell four times as long, wide and high."""
    cell = Cell(24.0 * np.eye(3), (True, True, True))
    return find_contacts(Packing(packing.position, packing.radius, cell=cell))


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
@pytest.mark.parametrize("variants", ["a", "ab"])
def test_following_lines_through_an_empty_cell_counts_in_the_budget(
    nearly_empty, monkeypatch, variants
):
    """Of all scans for the tolerance; those that end early take a part of the budget."""
    work, spacings = [], []

    def scan(*args, **options):
        spacings.append(options["spacing"])
        sums = scan_lines(*args, **options)
        work.append(int(sums.work.sum()))
        return sums

    monkeypatch.setattr(adaptive, "scan_lines", scan)
    row = compute(nearly_empty, tolerance=1e-5, variants=variants, max_chords=3e7)[0]
    assert row.alpha_vs_axial_se > 1e-5
    assert 3e6 < sum(work) < 6e7
    assert max(spacings) > min(spacings), "the first round was not bounded"


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_scan_that_stops_on_an_empty_cell_says_why(nearly_empty):
    with pytest.warns(ScanfabWarning, match="of the work was to follow long void.*`periodic"):
        compute(nearly_empty, tolerance=1e-5, variants="a", max_chords=3e7)


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_fixed_lines_through_an_empty_cell_that_take_too_long_are_refused(nearly_empty):
    lines = {"spacing": 0.5, "directions": 20, "variants": "a"}
    compute(nearly_empty, max_chords=1e9, tolerance=1.0, **lines)
    with pytest.raises(SettingsError, match=r"more than 1e\+03 steps.*`cell`.*`periodic`"):
        compute(nearly_empty, max_chords=1e3, tolerance=1.0, **lines)


def test_whether_following_takes_too_many_steps_does_not_depend_on_threads(nearly_empty):
    vectors, none = nearly_empty.cell.vectors, np.zeros(len(nearly_empty.radius), bool)
    medium = CellGrains(
        nearly_empty.position, nearly_empty.radius, none, vectors, np.ones(3, dtype=bool)
    )
    solids = Solids(np.zeros((0, 3)), np.zeros(0), none[:0], None, medium)
    lines = {"spacing": 0.5, "cutoff": 0.0, "variants": "a", "replicates": range(2)}
    rule = direction_rule("lebedev:5")
    steps = int(scan_lines(solids, rule, **lines).steps.sum())
    for workers in (1, 3):
        assert scan_lines(solids, rule, workers=workers, most_steps=steps + 1, **lines)
        with pytest.raises(SettingsError, match="following them through its images"):
            scan_lines(solids, rule, workers=workers, most_steps=steps, **lines)


def test_fixed_spacing_that_needs_more_chords_than_allowed_is_refused(packing):
    with pytest.raises(SettingsError, match="max_chords: 10000 chords are fewer"):
        compute(packing, spacing=0.02, max_chords=1e4)


@pytest.mark.parametrize("variants", ["ab", "abcd"])
def test_budget_without_a_line_for_every_direction_is_refused(packing, variants):
    with pytest.raises(SettingsError, match="max_chords: 100 chords are fewer"):
        compute(packing, max_chords=100, variants=variants)


def test_chords_of_a_scan_are_those_of_all_grains(packing):
    """Their number is the grains' projected area over the area of a line."""
    solids = solids_of(packing, 0.0)
    rule = direction_rule("lebedev:5")
    sums = scan_lines(solids, rule, spacing=0.1, cutoff=0.1, variants="ab")
    expected = np.pi * np.sum(packing.radius**2) / 0.1**2 * len(rule)
    assert sums.chords.mean() == pytest.approx(expected, rel=0.01)


@pytest.fixture(scope="module")
def loose():
    """Grains that touch no other, and two squares of four that do, far from one another."""
    lattice = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    position = 2.6 * lattice + np.random.default_rng(0).uniform(0, 0.4, lattice.shape)
    square = 0.98 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    squares = np.concatenate([square + 5.5, square + 9.5])
    apart = np.linalg.norm(position[:, None] - squares, axis=2).min(axis=1) > 2.001
    return find_contacts(Packing(np.concatenate([position[apart], squares]), 1.0))


def test_variant_of_few_grains_does_not_hold_back_the_others(loose):
    """The others are scanned to the tolerance, with the lines that they need alone."""
    options = {"tolerance": 5e-4, "max_chords": 3e8}
    alone = compute(loose, variants="acd", **options)
    with pytest.warns(ScanfabWarning) as caught:
        table = compute(loose, **options)
    kept = dict(zip(table["variant"], table["grains"], strict=True))
    assert kept["b"] == 8 < 0.1 * kept["a"]
    for name in "acd":
        assert table.select(variant=name)[0].alpha_vs_axial_se <= 5e-4
    assert table.select(variant="a")[0].lines == alone[0].lines
    told = "\n".join(str(one.message) for one in caught)
    error = table.select(variant="b")[0].alpha_vs_axial_se
    assert f"frame 0, variant b: alpha_vs_axial_se is {error:.2g}, above" in told
    assert "before the tolerance" not in told


def test_variant_of_few_grains_is_scanned_if_it_is_asked_for_alone(loose):
    told, lines = [], []
    for variants in ("b", "ab"):
        with pytest.warns(ScanfabWarning) as caught:
            table = compute(loose, variants=variants, tolerance=2e-3, max_chords=3e7)
        told.append("\n".join(str(one.message) for one in caught))
        lines.append(table[-1].lines)
    assert "frame 0: the scan stopped after" in told[0]
    assert "frame 0, variant b: alpha_vs_axial_se is" in told[1]
    assert "the scan stopped" not in told[1]
    assert lines[0] > 2 * lines[1]


def test_budget_of_chords_is_minutes_by_default():
    """100 to 200 million chords a second and processor."""
    assert Settings().max_chords == 1e10


def test_scan_tells_how_far_it_is_and_how_long_the_rest_takes(packing, caplog):
    with caplog.at_level("INFO", logger="scanfab"):
        compute(packing, tolerance=2e-4, variants="a")
    states = [one.getMessage() for one in caplog.records if ": error" in one.getMessage()]
    assert states
    for state in states:
        assert re.fullmatch(r"frame 0: error [\d.e-]+ of 0\.0002, about \d+ (s|min)", state)


def test_default_settings_ask_for_the_tolerance():
    assert Settings().tolerance == 1e-4
    assert Settings().spacing is None
    assert Settings().directions is None
