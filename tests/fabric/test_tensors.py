"""Contact and void fabric equal their formulas written out; even fits are exact to their degree."""

import numpy as np
import pytest

from scanfab import FabricTensor, contact_fabric, void_fabric
from scanfab.base.space import Space
from scanfab.fabric.distribution import direction_points, fit_even, mean_length_function
from scanfab.fabric.tensor import axial_error
from scanfab.scan.directions import direction_rule, plane_rule
from tests.helpers import naive
from tests.helpers.lattices import unit_vectors

RULE = direction_rule("lebedev:5")
D = len(RULE)


def test_contact_fabric_and_its_error_are_written_out_means_whatever_the_signs():
    random, axis = np.random.default_rng(0), np.array([0.6, 0.0, 0.8])
    normals, signs = unit_vectors(random, 50), random.choice([-1.0, 1.0], (50, 1))
    found = contact_fabric(normals)
    assert found.matrix == pytest.approx(naive.contact_tensor(normals))
    assert np.array_equal(contact_fabric(normals * signs).matrix, found.matrix)
    each = [naive.axial(naive.contact_tensor([normal]), axis) for normal in normals]
    assert found.axial(axis) == pytest.approx(np.mean(each))
    assert axial_error(normals, axis) == pytest.approx(np.std(each, ddof=1) / np.sqrt(50))
    assert contact_fabric([]) is None
    assert axial_error(np.zeros((0, 3)), axis) is axial_error(normals[:1], axis) is None


def random_tensor(random):
    half = random.normal(size=(3, 3))
    return half @ half.T / np.sum(half**2)


def test_principal_values_axes_and_alpha_make_the_tensor():
    for seed in range(20):
        tensor = FabricTensor(random_tensor(np.random.default_rng(seed)))
        matrix, values, axes = tensor.matrix, tensor.principal_values, tensor.principal_axes
        assert values[0] >= values[1] >= values[2]
        assert tensor.alpha == values[0] - values[2]
        assert axes.T @ np.diag(values) @ axes == pytest.approx(matrix)
    assert tensor.components() == {
        "xx": matrix[0, 0], "yy": matrix[1, 1], "zz": matrix[2, 2],
        "xy": matrix[0, 1], "xz": matrix[0, 2], "yz": matrix[1, 2],
    }  # fmt: skip


def random_sums(replicates):
    random = np.random.default_rng(0)
    segments = random.integers(20, 60, (replicates, D))
    length = segments * random.uniform(0.8, 1.2, (replicates, D))
    return unit_vectors(random, replicates, D), length, segments


def test_void_fabric_is_the_mean_of_the_replicates_written_out():
    axes, length, segments = random_sums(6)
    fabric = void_fabric(axes, RULE.weights, length, segments)
    slow = [naive.void_tensor(axes[r], RULE.weights, length[r] / segments[r]) for r in range(6)]
    assert fabric.replicates == pytest.approx(np.array(slow))
    assert fabric.tensor.matrix == pytest.approx(np.mean(slow, axis=0))
    assert fabric.filled == 0.0
    long, number = (sum(RULE.weights @ part for part in one) for one in (length, segments))
    assert fabric.mean_length == pytest.approx(long / number)
    values = [naive.axial(tensor, (1, 0, 0)) for tensor in slow]
    error = np.std(values, ddof=1) / np.sqrt(6)
    assert fabric.axial_error((1, 0, 0)) == pytest.approx(error)
    alone = void_fabric(axes[:1], RULE.weights, length[:1], segments[:1])
    assert alone.axial_error((0, 0, 1)) is None


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
    # in no replicate, or in none along most axes
    segments[:, 2] = 0
    assert void_fabric(axes, RULE.weights, length, segments) is None
    segments[:] = np.eye(4, D)
    segments[0] = 1
    assert void_fabric(axes, RULE.weights, length, segments) is None


def even(n):
    """Of degree 6."""
    x, y, z = np.moveaxis(n, -1, 0)
    return 1.0 + 0.3 * z**2 - 0.2 * x * y + 0.1 * x**2 * z**2 + 0.05 * z**6 + 0.04 * x**4 * y**2


EXACT = [
    direction_rule("lebedev:17"),
    direction_rule("product:13"),
    direction_rule("fibonacci:200"),
    plane_rule(20, Space(2)),
]


@pytest.mark.parametrize("rule", EXACT)
def test_even_polynomials_of_degree_six_come_back(rule):
    axes, weights = rule.axes, np.random.default_rng(0).uniform(1, 2, len(rule))
    function = fit_even(axes, even(axes), weights, rule.space)
    points, _ = direction_points(rule.space)
    assert function.degree == 6
    assert function(points) == pytest.approx(even(points), abs=1e-10)
    assert function(-points) == pytest.approx(function(points), abs=1e-12)


FEW = [
    (direction_rule("design:9").axes, 4),
    (direction_rule("lebedev:3").axes, 0),
    # the corners of an icosahedron, as many as there are even terms of degree 2
    (direction_rule("icosahedral:9").axes[:6], 2),
]


@pytest.mark.parametrize(("axes", "degree"), FEW)
def test_few_directions_take_a_low_degree(axes, degree):
    assert fit_even(axes, np.ones(len(axes)), np.ones(len(axes))).degree == degree


def test_directions_of_half_the_sphere_do_not_run_wild():
    axes = direction_rule("equal-angle:10").axes
    noise = 1 + 0.01 * np.random.default_rng(1).standard_normal(len(axes))
    function = fit_even(axes, noise, np.ones(len(axes)))
    assert np.abs(function(direction_points()[0]) - 1).max() < 0.05


def test_directions_without_a_segment_are_left_out():
    axes = direction_rule("lebedev:17").axes[None]
    segments = np.ones(axes.shape[:2], int)
    segments[0, 3] = 0
    function = mean_length_function(axes, 2.0 * segments, segments)
    assert function is not None
    assert function(axes) == pytest.approx(np.full(segments.shape, 2.0))
    assert mean_length_function(axes, 0.0 * segments, 0 * segments) is None


def test_the_points_are_a_rule_for_the_whole_sphere():
    points, weights = direction_points()
    assert weights.sum() == pytest.approx(1)
    second = np.einsum("p,pi,pj->ij", weights, points, points)
    assert second == pytest.approx(np.eye(3) / 3, abs=1e-13)
    assert weights @ points[:, 2] ** 8 == pytest.approx(1 / 9)
