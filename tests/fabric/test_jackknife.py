"""The usual fabrics and the sample's own scatter: closed forms, recomputation, drawn samples."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.fabric.errors import (
    BLOCKS,
    homogeneity_of,
    jackknife,
    jackknife_variance,
    variance_without_noise,
)
from scanfab.fabric.measured import Measured, void_scatter
from scanfab.fabric.registry import OWN_FABRICS
from scanfab.scan.blocks import Blocks
from scanfab.scan.scan import GapSums, scan_gaps
from tests.helpers import naive
from tests.helpers.lattices import Spheres, poisson_spheres, unit_vectors
from tests.helpers.scanning import solids_of

AXIS = np.array([0.6, 0.0, 0.8])
THIRDS = np.full(3, 1 / 3)


def gaps_of(axes, length, number):
    """Gaps of one variant and cut-off, from lengths and numbers by octant, shape (8, R, D)."""
    over, under = (np.moveaxis(one, 0, -1)[:, None, ..., None] for one in (length, number))
    return GapSums(axes, THIRDS, "a", under, over, over, None)


def measured(length=(1.0, 1.0, 2.0), normals=8 * ((1.0, 0.0, 0.0),), meets=True, turns=2, **more):
    """Three axes along x, y and z, one segment each, of which each block holds an eighth."""
    axes, lengths = np.tile(np.eye(3), (turns, 1, 1)), np.tile(np.array(length), (turns, 1))
    number, places = (lengths > 0).astype(float), np.reshape(normals, (-1, 3))
    axis = np.array([0.0, 0.0, 1.0])
    gaps = gaps_of(axes, *(np.stack(BLOCKS * [one / 8]) for one in (lengths, number)))
    usual = {
        "axis": axis,
        "void_scatter": void_scatter(gaps, "a", axis),
        "blocks": np.arange(len(places)) % BLOCKS,
    }
    return Measured(
        axes=axes, weights=THIRDS, length=lengths, segments=number, meets_solids=meets,
        normals=places, **{**usual, **more},
    )  # fmt: skip


def values(found):
    return {name: one for each in OWN_FABRICS.values() for name, one in each.values(found).items()}


def test_both_tensors_the_angle_between_their_axes_and_blocks_that_are_alike():
    """ℓ = 1, 1, 2 along x, y, z: G = 1/4, 1/4, 1/2; all contacts along x."""
    found = values(measured())
    expected = {
        "gvs_xx": 0.25, "gvs_yy": 0.25, "gvs_zz": 0.5, "mean_length": 4 / 3, "alpha_vs": 0.25,
        "alpha_vs_axial": 0.25, "alpha_vs_axial_se": 0.0, "gc_xx": 1.0, "alpha_c": 1.0,
        "alpha_c_axial": -0.5, "alpha_c_axial_sample_se": 0.0, "coaxiality_deg": 90.0,
        "gvs_axis_x": 0, "gvs_axis_y": 0, "gvs_axis_z": 1, "gc_axis_x": 1, "gc_axis_y": 0,
    }  # fmt: skip
    for block in range(1, BLOCKS + 1):
        expected[f"alpha_vs_axial_without_{block}"] = 0.25
        expected[f"alpha_c_axial_without_{block}"] = -0.5
        expected[f"alpha_vs_axial_half_{block}"] = 0.0
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-15)


MISSING = [
    (measured(meets=False), False, True),
    (measured(length=(0.0, 1.0, 2.0)), False, True),
    (measured(normals=()), True, False),
    (measured(normals=(), meets=False), False, False),
    (measured(turns=1), True, True),
]


@pytest.mark.parametrize(("found", "void", "contact"), MISSING)
def test_what_does_not_exist_is_empty_and_every_column_has_a_value(found, void, contact):
    found = values(found)
    columns = [one.name for fabric in OWN_FABRICS.values() for one in fabric.columns]
    assert sorted(found) == sorted(columns)
    assert (found["coaxiality_deg"] is not None) == (void and contact)
    for name, value in found.items():
        if name in ("gvs_xx", "mean_length", "alpha_vs_axial_without_3", "alpha_vs_axial_half_8"):
            assert (value is not None) == void
        elif name.startswith(("gc_", "alpha_c")):
            assert (value is not None) == contact, name


def written_out(without):
    """√(7/8 Σ (θ_b - θ̄)²)."""
    mean = sum(without) / 8
    return (7 / 8 * sum((one - mean) ** 2 for one in without)) ** 0.5


def test_error_of_a_mean_is_the_textbook_one():
    """Without one of B numbers at a time, the mean's jackknife error is s/√B."""
    numbers = np.random.default_rng(0).normal(size=8)
    means = (numbers.sum() - numbers) / 7
    assert jackknife_variance(means) == pytest.approx(numbers.var(ddof=1) / 8, rel=1e-12)
    # parts that hold nothing do not count
    more, held = np.append(means, np.nan), np.arange(9) < 8
    assert jackknife_variance(more, held) == pytest.approx(jackknife_variance(means), rel=1e-12)
    assert jackknife(np.full((9, 1), 0.3)).error == 0.0


def test_an_octant_without_contacts_moves_nothing_and_one_of_all_has_no_error():
    random = np.random.default_rng(1)
    normals = unit_vectors(random, 200)

    def scatter(blocks):
        return measured(normals=normals, blocks=blocks, axis=AXIS).contact_scatter

    assert scatter(random.integers(0, 7, 200)).shift[7] == pytest.approx(0, abs=1e-15)
    assert scatter(np.full(200, 4)) is None


def test_voids_are_recomputed_without_each_octant():
    random = np.random.default_rng(4)
    axes, number = unit_vectors(random, 1, 3), random.integers(5, 30, (8, 1, 3)).astype(float)
    length = number * random.uniform(0.8, 1.2, number.shape)
    found = void_scatter(gaps_of(axes, length, number), "a", AXIS)

    def value(blocks):
        mean = length[blocks, 0].sum(axis=0) / number[blocks, 0].sum(axis=0)
        return naive.axial(naive.void_tensor(axes[0], THIRDS, mean), AXIS)

    without = [value([b for b in range(8) if b != block]) for block in range(8)]
    assert found.shift == pytest.approx(np.array(without) - value(list(range(8))), abs=1e-14)
    # one replicate: its noise is not known, and stays in
    assert found.error == pytest.approx(written_out(without))
    # without the octant that holds all segments there is no fabric
    length[1:], number[1:] = 0.0, 0.0
    assert void_scatter(gaps_of(axes, length, number), "a", AXIS) is None


def test_noise_of_the_replicates_is_taken_off():
    """Blocks that scatter by 1 between samples, replicates by 10: unbiased over many samples."""
    random = np.random.default_rng(6)
    values = random.normal(0, 1, (8, 1, 4000)) + random.normal(0, 10, (8, 8, 4000))
    found = [variance_without_noise(values[..., k]) for k in range(4000)]
    expected = 7 / 8 * 7 * 1.0  # (B - 1)/B times (B - 1) times the variance of one
    assert np.mean(found) == pytest.approx(expected, abs=4 * np.std(found) / np.sqrt(4000))
    assert np.std(found) / np.sqrt(4000) < 0.25 * expected
    with_noise = [written_out(values[..., k].mean(axis=1)) ** 2 for k in range(4000)]
    assert np.mean(with_noise) > 5 * expected


def test_noise_that_hides_the_scatter_leaves_no_error():
    """Octants that differ by less than chance: nothing can be said, not even 0."""
    random = np.random.default_rng(7)
    found = [jackknife(random.normal(size=(9, 8))) for _ in range(40)]
    assert 5 < sum(one.error is None for one in found) < 35
    assert all(one.error is None or one.error > 0 for one in found)
    values = np.array([[1.0, 3.0], [2.0, 5.0], [0.0, 2.0]])
    assert jackknife(values).shift.tolist() == [1.5, -1.0]
    assert jackknife(values).half.tolist() == [-1.5, -1.0]


def values_of_voids(spheres, axis, blocks_axis=None, **options):
    """α_axial in each replicate with all segments, and without each octant: shape (9, R)."""
    window, rule = 8.0, direction_rule("icosahedral:9")
    blocks = Blocks.about(np.zeros(3), 2 * window, axis if blocks_axis is None else blocks_axis)
    sums = scan_gaps(
        solids_of(spheres, window), rule,
        cutoffs=[0.5], blocks=(blocks, blocks), variants="c", replicates=range(8), **options,
    )  # fmt: skip
    kept = [sums.kept("c"), *(sums.kept("c", without=block) for block in range(8))]
    lengths = rule.weights * np.array([over / under for over, under in kept])
    along = np.einsum("brd,rd->br", lengths, (sums.axes @ np.array(axis)) ** 2)
    return 1.5 * along / lengths.sum(axis=2) - 0.5


def test_octants_about_one_sphere_do_not_differ_along_the_axis():
    """
    Segments at a window's surface are cut in another way along it than across.

    So octants must be mirror images of one another with respect to the axis; else their difference
    counts as scatter of the sample, of which there is none here.
    """
    one = Spheres(np.zeros((1, 3)), np.full(1, 4.0))
    values = values_of_voids(one, AXIS, spacing=0.4)
    off = values[1:] - values[1:].mean(axis=0)
    error = off.std(axis=1, ddof=1) / np.sqrt(off.shape[1])
    assert np.all(np.abs(off.mean(axis=1)) < 4 * error)
    along_z = values_of_voids(one, AXIS, (0, 0, 1), spacing=0.4)[1:].mean(axis=1)
    assert np.ptp(along_z) > 20 * error.max()


def test_jackknife_is_the_scatter_between_independent_samples():
    """Of Poisson spheres in a window: mean jackknife variance of 60, and variance between them."""
    found = []
    for seed in range(60):
        spheres = poisson_spheres(np.random.default_rng([seed, 11]), 0.3, 8.0)
        values = values_of_voids(spheres, (0, 0, 1), spacing=1.0, seed=seed)
        variance = variance_without_noise(values[1:])
        found.append((values[0].mean(), values[0].var(ddof=1) / 8, variance))
    alpha, noise, variance = np.array(found).T
    between = alpha.var(ddof=1) - noise.mean()
    assert noise.mean() < 0.3 * between
    # relative errors: of a variance of 60 numbers 18 %, of the mean of 60 variances some 9 %
    assert variance.mean() / between == pytest.approx(1.0, abs=0.4)


def test_of_homogeneous_samples_one_in_twenty_has_a_chance_below_that():
    """Blocks of one true value, each with its variance from eight parts."""
    random, chances = np.random.default_rng(0), []
    for _ in range(10_000):
        parts = random.normal(size=(4, 8))
        variances = parts.var(axis=1, ddof=1) / 8
        chances.append(homogeneity_of(parts.mean(axis=1), variances, np.ones(4), 7.0).chance)
    # three standard errors of a count
    assert np.mean(np.array(chances) < 0.05) == pytest.approx(0.05, abs=0.0066)
