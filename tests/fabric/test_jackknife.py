"""The sample's own scatter: closed forms, explicit recomputation, and scatter between samples."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.fabric.errors import jackknife_variance, variance_without_noise
from scanfab.fabric.jackknife import BlockedSums, contact_jackknife, void_jackknife
from scanfab.scan.blocks import Blocks
from scanfab.scan.gaps import scan_gaps
from tests.helpers import naive
from tests.helpers.lattices import Spheres, poisson_spheres
from tests.helpers.scanning import solids_of

AXIS = np.array([0.6, 0.0, 0.8])


def unit_vectors(random, *shape):
    vectors = random.normal(size=(*shape, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


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
    assert jackknife_variance(np.full(8, 0.3)) == 0.0


def test_contact_jackknife_is_a_recomputation_without_each_octant():
    random = np.random.default_rng(1)
    normals, blocks = unit_vectors(random, 200), random.integers(0, 8, 200)
    found = contact_jackknife(normals, blocks, AXIS)
    every = naive.axial(naive.contact_tensor(normals), AXIS)
    without = [
        naive.axial(naive.contact_tensor(normals[blocks != block]), AXIS) for block in range(8)
    ]
    assert found.shift == pytest.approx(np.array(without) - every, abs=1e-14)
    assert found.error == pytest.approx(written_out(without))
    # an octant without contacts moves nothing; if one has them all, there is no error
    found = contact_jackknife(normals, np.minimum(blocks, 6), AXIS)
    assert found.shift[7] == pytest.approx(0.0, abs=1e-15)
    assert contact_jackknife(normals, np.full(200, 4), AXIS) is None


def test_contact_jackknife_of_independent_contacts_is_their_scatter():
    """Blocks of independent contacts: the variance of one contact over their number."""
    random = np.random.default_rng(3)
    variance = [
        contact_jackknife(unit_vectors(random, 400), random.integers(0, 8, 400), AXIS).error ** 2
        for _ in range(400)
    ]
    # of (3 cos² - 1)/2 over the sphere: 1/5
    expected = 0.2 / 400
    assert np.mean(variance) == pytest.approx(expected, rel=0.1)


def random_sums(random, replicates):
    """Sums by octant of a scan of three axes: lengths and numbers, shape (8, R, D)."""
    axes = unit_vectors(random, replicates, 3)
    number = random.integers(5, 30, (8, replicates, 3)).astype(float)
    return axes, number * random.uniform(0.8, 1.2, number.shape), number


def void_of(axes, length, number):
    weights = np.full(3, 1 / 3)
    total = length.sum(axis=0), number.sum(axis=0)
    without = [(total[0] - length[b], total[1] - number[b]) for b in range(8)]
    return void_jackknife(BlockedSums(axes, weights, total, without), AXIS)


def test_void_jackknife_is_a_recomputation_without_each_octant():
    axes, length, number = random_sums(np.random.default_rng(4), 1)
    found = void_of(axes, length, number)

    def value(blocks):
        mean = length[blocks, 0].sum(axis=0) / number[blocks, 0].sum(axis=0)
        return naive.axial(naive.void_tensor(axes[0], np.full(3, 1 / 3), mean), AXIS)

    without = [value([b for b in range(8) if b != block]) for block in range(8)]
    assert found.shift == pytest.approx(np.array(without) - value(list(range(8))), abs=1e-14)
    # one replicate: its noise is not known, and stays in
    assert found.error == pytest.approx(written_out(without))


def test_an_octant_that_holds_all_segments_leaves_no_error():
    axes, length, number = random_sums(np.random.default_rng(5), 2)
    length[1:], number[1:] = 0.0, 0.0
    assert void_of(axes, length, number) is None


def test_noise_of_the_replicates_is_taken_off():
    """Blocks that scatter by 1 between samples, replicates by 10: unbiased over many samples."""
    random = np.random.default_rng(6)
    block, noise = random.normal(0, 1, (8, 1, 4000)), random.normal(0, 10, (8, 8, 4000))
    values = block + noise
    found = [variance_without_noise(values[..., k]) for k in range(4000)]
    expected = 7 / 8 * 7 * 1.0  # (B - 1)/B times (B - 1) times the variance of one
    assert np.mean(found) == pytest.approx(expected, abs=4 * np.std(found) / np.sqrt(4000))
    assert np.std(found) / np.sqrt(4000) < 0.25 * expected
    with_noise = [naive_variance(values[..., k].mean(axis=1)) for k in range(4000)]
    assert np.mean(with_noise) > 5 * expected


def naive_variance(without):
    return written_out(without) ** 2


def test_noise_that_hides_the_scatter_leaves_no_error():
    """Octants that differ by less than chance: nothing can be said, not even 0."""
    random = np.random.default_rng(7)
    errors = []
    for _ in range(40):
        axes = unit_vectors(random, 8, 3)
        number = np.full((8, 8, 3), 20.0)
        length = number * random.uniform(0.8, 1.2, number.shape)
        errors.append(void_of(axes, length, number).error)
    hidden = sum(error is None for error in errors)
    assert 5 < hidden < 35
    assert all(error is None or error > 0 for error in errors)


def values_of_voids(spheres, axis, blocks_axis=None, **options):
    """α_axial in each replicate with all segments, and without each octant: shape (9, R)."""
    window, rule = 8.0, direction_rule("icosahedral:9")
    blocks = Blocks.about(np.zeros(3), 2 * window, axis if blocks_axis is None else blocks_axis)
    sums = scan_gaps(
        solids_of(spheres, window),
        rule,
        cutoffs=[0.5],
        blocks=(blocks, blocks),
        variants="c",
        replicates=range(8),
        **options,
    )
    every, without = sums.kept("c"), [sums.kept("c", without=block) for block in range(8)]
    return np.array(
        [
            [
                naive.axial(naive.void_tensor(axes, rule.weights, over / under), axis)
                for axes, over, under in zip(sums.axes, *one, strict=True)
            ]
            for one in (every, *without)
        ]
    )


def test_octants_about_one_sphere_do_not_differ_along_the_axis():
    """
    Segments at a window's surface are cut in another way along it than across.

    So octants must be mirror images of one another with respect to the axis; else their difference
    counts as scatter of the sample, of which there is none here.
    """
    oblique, one = np.array([0.6, 0.0, 0.8]), Spheres(np.zeros((1, 3)), np.full(1, 4.0))
    values = values_of_voids(one, oblique, spacing=0.4)
    off = values[1:] - values[1:].mean(axis=0)
    error = off.std(axis=1, ddof=1) / np.sqrt(off.shape[1])
    assert np.all(np.abs(off.mean(axis=1)) < 4 * error)
    along_z = values_of_voids(one, oblique, (0, 0, 1), spacing=0.4)[1:].mean(axis=1)
    assert np.ptp(along_z) > 20 * error.max()


def sample_of_voids(seed):
    """α_axial of Poisson spheres in a window, the scan's noise, and the jackknife variance."""
    spheres = poisson_spheres(np.random.default_rng([seed, 11]), 0.3, 8.0)
    values = values_of_voids(spheres, (0, 0, 1), spacing=1.0, seed=seed)
    return values[0].mean(), values[0].var(ddof=1) / 8, variance_without_noise(values[1:])


def test_jackknife_is_the_scatter_between_independent_samples():
    """Mean jackknife variance over 150 samples, and variance of α between them."""
    alpha, noise, jackknife = np.array([sample_of_voids(seed) for seed in range(150)]).T
    between = alpha.var(ddof=1) - noise.mean()
    assert noise.mean() < 0.3 * between
    # relative errors: of a variance of 150 numbers 12 %, of the mean of 150 variances of 8 some 5 %
    assert jackknife.mean() / between == pytest.approx(1.0, abs=0.4)
