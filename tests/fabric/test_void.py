"""The void fabric equals its formula written out, replicate by replicate."""

import numpy as np
import pytest

from scanfab import direction_rule, void_fabric
from tests.helpers import naive

RULE = direction_rule("lebedev:5")
D = len(RULE)


def random_sums(replicates, seed=0):
    random = np.random.default_rng(seed)
    segments = random.integers(20, 60, (replicates, D))
    length = segments * random.uniform(0.8, 1.2, (replicates, D))
    axes = random.normal(size=(replicates, D, 3))
    return axes / np.linalg.norm(axes, axis=2, keepdims=True), length, segments


def test_tensor_is_the_mean_of_the_replicates_written_out():
    axes, length, segments = random_sums(5)
    fabric = void_fabric(axes, RULE.weights, length, segments)
    slow = [
        naive.void_tensor(axes[r], RULE.weights, length[r] / segments[r]) for r in range(len(axes))
    ]
    assert fabric.replicates == pytest.approx(np.array(slow))
    assert fabric.tensor.matrix == pytest.approx(np.mean(slow, axis=0))
    assert np.trace(fabric.tensor.matrix) == pytest.approx(1.0)
    assert fabric.filled == 0.0


def test_mean_length_is_all_length_over_all_number_with_weights():
    axes, length, segments = random_sums(4)
    expected = sum(RULE.weights @ part for part in length) / sum(
        RULE.weights @ part for part in segments
    )
    assert void_fabric(axes, RULE.weights, length, segments).mean_length == pytest.approx(expected)


def test_axial_error_is_that_of_the_mean_of_the_replicates():
    axes, length, segments = random_sums(6)
    fabric = void_fabric(axes, RULE.weights, length, segments)
    values = [naive.axial(tensor, (1, 0, 0)) for tensor in fabric.replicates]
    scatter = sum((value - sum(values) / 6) ** 2 for value in values) / 5
    assert fabric.axial_error((1, 0, 0)) == pytest.approx((scatter / 6) ** 0.5)


def test_one_replicate_has_no_error():
    assert void_fabric(*inputs(random_sums(1))).axial_error((0, 0, 1)) is None


def inputs(sums):
    axes, length, segments = sums
    return axes, RULE.weights, length, segments


def test_equal_lengths_give_the_isotropic_tensor_of_an_exact_rule():
    segments = np.random.default_rng(0).integers(1, 9, (3, D))
    axes = np.broadcast_to(RULE.axes, (3, D, 3))
    fabric = void_fabric(axes, RULE.weights, 0.7 * segments, segments)
    assert np.abs(fabric.tensor.matrix - np.eye(3) / 3).max() < 1e-14
    assert fabric.mean_length == pytest.approx(0.7)


def test_ellipsoidal_lengths_give_their_tensor():
    """ℓ = 1 + n·A·n with a traceless A, of rules exact to degree 4: G = I/3 + 2A/15."""
    traceless = np.array([[0.2, 0.05, 0.0], [0.05, -0.3, 0.1], [0.0, 0.1, 0.1]])
    length = 1 + np.einsum("di,ij,dj->d", RULE.axes, traceless, RULE.axes)
    fabric = void_fabric(RULE.axes[None], RULE.weights, length[None], np.ones((1, D)))
    assert np.abs(fabric.tensor.matrix - np.eye(3) / 3 - 2 * traceless / 15).max() < 1e-12


def test_axis_that_kept_nothing_in_a_replicate_takes_its_mean_over_the_others():
    axes, length, segments = random_sums(4)
    length[1, 2], segments[1, 2] = 0.0, 0
    fabric = void_fabric(axes, RULE.weights, length, segments)
    mean = length / np.maximum(segments, 1)
    mean[1, 2] = length[:, 2].sum() / segments[:, 2].sum()
    assert fabric.replicates[1] == pytest.approx(naive.void_tensor(axes[1], RULE.weights, mean[1]))
    assert fabric.filled == pytest.approx(1 / (4 * D))


def test_axis_that_kept_nothing_at_all_leaves_no_fabric():
    axes, length, segments = random_sums(4)
    length[:, 2], segments[:, 2] = 0.0, 0
    assert void_fabric(axes, RULE.weights, length, segments) is None


def test_nothing_kept_leaves_no_fabric():
    axes, length, segments = random_sums(2)
    assert void_fabric(axes, RULE.weights, 0 * length, 0 * segments) is None
