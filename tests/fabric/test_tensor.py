"""The fabric tensor's invariants."""

import numpy as np
import pytest

from scanfab import FabricTensor
from scanfab.fabric.tensor import axial
from tests.helpers import naive
from tests.helpers.lattices import rotation


def random_tensor(random):
    half = random.normal(size=(3, 3))
    tensor = half @ half.T
    return tensor / np.trace(tensor)


def test_principal_values_are_sorted_and_sum_to_the_trace():
    for seed in range(20):
        values = FabricTensor(random_tensor(np.random.default_rng(seed))).principal_values
        assert values[0] >= values[1] >= values[2]
        assert values.sum() == pytest.approx(1.0)


def test_principal_axes_are_rows_in_the_order_of_the_values():
    tensor = FabricTensor(np.diag([0.2, 0.5, 0.3]))
    assert tensor.principal_values == pytest.approx([0.5, 0.3, 0.2])
    assert np.abs(tensor.principal_axes) == pytest.approx(np.eye(3)[[1, 2, 0]])


def test_principal_values_and_axes_make_the_tensor():
    matrix = random_tensor(np.random.default_rng(0))
    tensor = FabricTensor(matrix)
    axes = tensor.principal_axes
    assert axes.T @ np.diag(tensor.principal_values) @ axes == pytest.approx(matrix)


def test_alpha_is_largest_minus_smallest_and_does_not_turn():
    turn = rotation(np.random.default_rng(1))
    matrix = turn @ np.diag([0.25, 0.45, 0.3]) @ turn.T
    assert FabricTensor(matrix).alpha == pytest.approx(0.2)
    assert FabricTensor(np.eye(3) / 3).alpha == pytest.approx(0.0, abs=1e-15)


def test_axial_equals_the_written_out_formula_for_any_axis():
    for seed in range(20):
        random = np.random.default_rng(seed)
        matrix, axis = random_tensor(random), rotation(random)[0]
        assert FabricTensor(matrix).axial(axis) == pytest.approx(naive.axial(matrix, axis))


def test_axial_is_the_signed_difference_of_a_transversely_isotropic_tensor():
    assert FabricTensor(np.diag([0.3, 0.3, 0.4])).axial((0, 0, 1)) == pytest.approx(0.1)
    assert FabricTensor(np.diag([0.4, 0.4, 0.2])).axial((0, 0, 1)) == pytest.approx(-0.2)


def test_axial_sums_to_zero_over_three_axes():
    matrix = random_tensor(np.random.default_rng(2))
    assert sum(FabricTensor(matrix).axial(axis) for axis in np.eye(3)) == pytest.approx(0.0)


def test_axial_of_many_tensors_at_once():
    matrices = np.array([random_tensor(np.random.default_rng(seed)) for seed in range(6)])
    values = axial(matrices.reshape(2, 3, 3, 3), (0, 1, 0))
    assert values.shape == (2, 3)
    assert values.ravel() == pytest.approx([naive.axial(m, (0, 1, 0)) for m in matrices])


def test_components_are_named_by_their_place():
    matrix = np.array([[1.0, 4, 5], [4, 2, 6], [5, 6, 3]])
    assert FabricTensor(matrix).components() == {
        "xx": 1.0,
        "yy": 2.0,
        "zz": 3.0,
        "xy": 4.0,
        "xz": 5.0,
        "yz": 6.0,
    }
