"""The scan: replicates, seeds and workers."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, Sample, SettingsError, direction_rule, scan_lines
from scanfab.base.arrays import concatenated
from scanfab.scan.solids import MAX_LINES
from tests.helpers.lattices import poisson_spheres
from tests.helpers.scanning import fabric, solids_of

RULE = direction_rule("lebedev:5")


@pytest.fixture(scope="module")
def solids():
    spheres = poisson_spheres(np.random.default_rng(0), 0.1, 5.0)
    return solids_of(spheres, 3.0, np.arange(len(spheres.radius)) % 4 == 0)


def raw(sums):
    return b"".join(
        getattr(sums, name).tobytes()
        for name in ("axes", "length", "segments", "lines", "void", "line_length")
    )


def test_same_bytes_for_any_number_of_workers(solids):
    options = {"spacing": 0.2, "cutoff": 0.3, "seed": 4}
    one, three = (scan_lines(solids, RULE, **options, workers=workers) for workers in (1, 3))
    assert raw(three) == raw(one)


def test_same_seed_gives_the_same_bytes_and_another_seed_others(solids):
    first, again, other = (
        scan_lines(solids, RULE, spacing=0.3, cutoff=0.3, seed=seed) for seed in (1, 1, 2)
    )
    assert raw(first) == raw(again)
    assert not np.any(first.axes == other.axes)
    assert first.segments.tobytes() != other.segments.tobytes()


def test_replicate_depends_on_its_number_alone(solids):
    """So an auto scan may go on where it stopped."""
    options = {"spacing": 0.3, "cutoff": 0.3}
    together = scan_lines(solids, RULE, replicates=range(6), **options)
    first = scan_lines(solids, RULE, replicates=[0, 1], **options)
    rest = scan_lines(solids, RULE, replicates=[2, 3, 4, 5], **options)
    assert raw(concatenated([first, rest])) == raw(together)
    assert together.replicates == 6


def test_replicates_turn_the_rule_rigidly(solids):
    sums = scan_lines(solids, RULE, spacing=0.5, cutoff=0.3)
    cosines = sums.axes @ sums.axes.transpose(0, 2, 1)
    assert np.abs(cosines - RULE.axes @ RULE.axes.T).max() < 1e-12
    assert np.unique(np.round(sums.axes[:, 0], 9), axis=0).shape == (16, 3)


def test_literal_grid_is_only_shifted(solids):
    rule = direction_rule("equal-angle:30")
    sums = scan_lines(solids, rule, spacing=0.5, cutoff=0.3)
    assert np.all(sums.axes == rule.axes)
    assert len(np.unique(sums.length[:, 2, 0])) == 16


def test_spacing_that_asks_for_too_many_lines_is_an_error(solids):
    spacing = 2 * 3.0 / MAX_LINES**0.5
    with pytest.raises(SettingsError, match=r"^spacing: .* choose a wider spacing"):
        scan_lines(solids, RULE, spacing=spacing, cutoff=0.3)
    # of a column in a cell that does not repeat along it, the height counts
    cell = Cell([1, 1, 1], (True, True, False))
    column = Packing([[0, 0, 0], [0, 0, 1000]], 0.5, contacts=[], cell=cell)
    high = scanfab.solids_of(Sample(column, np.zeros(2, bool)), variants="a")
    with pytest.raises(SettingsError, match=r"^spacing: .* choose a wider spacing"):
        scan_lines(high, RULE, spacing=0.1, cutoff=0.3, replicates=[0])
    for spacing in (0.0, -0.5, np.nan):
        with pytest.raises(SettingsError, match="spacing: expected a length above 0, found"):
            scan_lines(solids, RULE, spacing=spacing, cutoff=0.3)


def test_reported_error_is_the_scatter_over_seeds():
    """Over 40 seeds, within 30 %: it is neither too bold nor too shy."""
    spheres = poisson_spheres(np.random.default_rng(3), 0.15, 5.0)
    options = {"spacing": 0.4, "cutoff": 0.5}
    results = [fabric(solids_of(spheres, 3.0), seed=seed, **options) for seed in range(40)]
    axial = [result.tensor.axial((0, 0, 1)) for result in results]
    errors = [result.axial_error((0, 0, 1)) for result in results]
    assert np.std(axial, ddof=1) == pytest.approx(np.mean(errors), rel=0.3)
