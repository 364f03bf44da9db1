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
    long, number = (sum(RULE.weights @ part for part in one) for one in (length, segments))
    assert fabric.mean_length == pytest.approx(long / number)


def test_axial_error_is_that_of_the_mean_of_the_replicates():
    axes, length, segments = random_sums(6)
    fabric = void_fabric(axes, RULE.weights, length, segments)
    values = [naive.axial(tensor, (1, 0, 0)) for tensor in fabric.replicates]
    scatter = sum((value - sum(values) / 6) ** 2 for value in values) / 5
    assert fabric.axial_error((1, 0, 0)) == pytest.approx((scatter / 6) ** 0.5)


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


@pytest.mark.parametrize("axes_without", [slice(2, 3), slice(None)])
def test_an_axis_that_kept_nothing_in_any_replicate_leaves_no_fabric(axes_without):
    axes, length, segments = random_sums(4)
    length[:, axes_without], segments[:, axes_without] = 0.0, 0
    assert void_fabric(axes, RULE.weights, length, segments) is None


def test_one_replicate_has_no_error():
    axes, length, segments = random_sums(1)
    assert void_fabric(axes, RULE.weights, length, segments).axial_error((0, 0, 1)) is None
