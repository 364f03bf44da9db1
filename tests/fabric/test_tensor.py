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


def test_alpha_is_largest_minus_smallest_and_does_not_turn():
    turn = rotation(np.random.default_rng(1))
    matrix = turn @ np.diag([0.25, 0.45, 0.3]) @ turn.T
    assert FabricTensor(matrix).alpha == pytest.approx(0.2)
    assert FabricTensor(np.eye(3) / 3).alpha == pytest.approx(0.0, abs=1e-15)


def test_principal_values_and_axes_make_the_tensor():
    for seed in range(20):
        matrix = random_tensor(np.random.default_rng(seed))
        tensor = FabricTensor(matrix)
        values, axes = tensor.principal_values, tensor.principal_axes
        assert values[0] >= values[1] >= values[2]
        assert axes.T @ np.diag(values) @ axes == pytest.approx(matrix)
    assert tensor.components() == {
        "xx": matrix[0, 0], "yy": matrix[1, 1], "zz": matrix[2, 2],
        "xy": matrix[0, 1], "xz": matrix[0, 2], "yz": matrix[1, 2],
    }  # fmt: skip


def test_axial_equals_the_written_out_formula_for_any_axis():
    matrices = np.array([random_tensor(np.random.default_rng(seed)) for seed in range(20)])
    for axis in rotation(np.random.default_rng(3)):
        expected = [naive.axial(matrix, axis) for matrix in matrices]
        assert axial(matrices.reshape(2, 10, 3, 3), axis).ravel() == pytest.approx(expected)
        assert FabricTensor(matrices[0]).axial(axis) == pytest.approx(expected[0])
    assert FabricTensor(np.diag([0.4, 0.4, 0.2])).axial((0, 0, 1)) == pytest.approx(-0.2)
