"""Branch and force fabric: closed forms, errors by drawing samples, and LAMMPS' compute fabric."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.fabric.forces import branch_fabric, normal_force_fabric, tangential_force_fabric

Z = np.array([0.0, 0.0, 1.0])


def directions(count, rng):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def drawn(count, rng, density=0.8):
    """Normals whose density is 1 + density P2(n·z), by rejection."""
    found = np.zeros((0, 3))
    while len(found) < count:
        n = directions(3 * count, rng)
        keep = rng.random(len(n)) * (1 + density) < 1 + density * (1.5 * n[:, 2] ** 2 - 0.5)
        found = np.concatenate([found, n[keep]])
    return found[:count]


def p2(normals):
    return 1.5 * normals[:, 2] ** 2 - 0.5


def naive(normals, vectors, size, factor):
    """Contact by contact, as the formula has it."""
    eye = np.eye(3)
    fabric = sum(np.outer(n, n) for n in normals) / len(normals)
    deviator = 7.5 * (fabric - eye / 3)
    total, scale = np.zeros((3, 3)), 0.0
    for n, v, s in zip(normals, vectors, size, strict=True):
        weight = 1 / (1 + n @ deviator @ n)
        total += weight * (np.outer(v, n) + np.outer(n, v)) / 2
        scale += weight * s
    return factor * (total / scale - eye * np.trace(total) / scale / 3)


def test_against_the_formula_contact_by_contact():
    rng = np.random.default_rng(1)
    normals, branch = drawn(300, rng), rng.uniform(1, 2, 300)
    force = rng.normal(size=(300, 3)) + 3 * normals
    force_n = np.sum(force * normals, axis=1)
    tangential = force - force_n[:, None] * normals
    cases = [
        (branch_fabric(normals, branch, Z), branch[:, None] * normals, branch, 7.5),
        (normal_force_fabric(normals, force_n, Z), force_n[:, None] * normals, force_n, 7.5),
        (tangential_force_fabric(normals, force, Z), tangential, force_n, 5.0),
    ]
    for found, vectors, size, factor in cases:
        np.testing.assert_allclose(found.matrix, naive(normals, vectors, size, factor), atol=1e-13)
        assert found.axial == pytest.approx(1.5 * found.matrix[2, 2], abs=1e-13)
        assert np.trace(found.matrix) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("density", [0.0, 0.6])
def test_known_harmonics_come_back_whatever_the_density_of_contacts(density):
    """b = 1 + 0.3 P2, f_n = 1 + 0.5 P2, f_t = -0.2 dP2/dθ: the axial values are 0.3, 0.5, 0.2."""
    rng = np.random.default_rng(2)
    normals = drawn(400_000, rng, density)
    force_n = 1 + 0.5 * p2(normals)
    across = Z - normals[:, 2:] * normals
    # dP2/dθ = -3 cos sin, and |across| = sin; the mean tangential force points towards the axis
    force = force_n[:, None] * normals + 0.2 * 3 * normals[:, 2:] * across
    found = [
        branch_fabric(normals, 1 + 0.3 * p2(normals), Z),
        normal_force_fabric(normals, force_n, Z),
        tangential_force_fabric(normals, force, Z),
    ]
    expected = [0.3 * 1.5, 0.5 * 1.5, 0.2 * 1.5 * 2.0]
    for one, value in zip(found, expected, strict=True):
        assert abs(one.axial - value) < max(5 * one.axial_se, 0.01)


def test_errors_cover_the_scatter_of_samples():
    rng = np.random.default_rng(3)
    values = {name: [] for name in "bnt"}
    for _ in range(400):
        normals = drawn(300, rng, 0.5)
        force_n = rng.exponential(size=300) * (1 + 0.4 * p2(normals))
        across = np.cross(normals, directions(300, rng))
        force = force_n[:, None] * normals + 0.3 * force_n[:, None] * across
        values["b"].append(branch_fabric(normals, rng.uniform(1, 2, 300), Z))
        values["n"].append(normal_force_fabric(normals, force_n, Z))
        values["t"].append(tangential_force_fabric(normals, force, Z))
    for found in values.values():
        scatter = np.std([one.axial for one in found])
        error = np.sqrt(np.mean([one.axial_se**2 for one in found]))
        assert error == pytest.approx(scatter, rel=0.15)


def test_turned_samples_have_turned_tensors():
    rng = np.random.default_rng(4)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    normals = drawn(200, rng)
    force = rng.normal(size=(200, 3)) + 4 * normals
    one = tangential_force_fabric(normals, force, Z)
    two = tangential_force_fabric(normals @ turn.T, force @ turn.T, turn @ Z)
    np.testing.assert_allclose(two.matrix, turn @ one.matrix @ turn.T, atol=1e-13)
    assert two.axial == pytest.approx(one.axial)
    assert two.axial_se == pytest.approx(one.axial_se)


def test_the_order_of_a_pair_does_not_matter():
    rng = np.random.default_rng(5)
    normals = drawn(50, rng)
    force = rng.normal(size=(50, 3)) + 4 * normals
    signs = rng.choice([-1.0, 1.0], 50)[:, None]
    one = tangential_force_fabric(normals, force, Z)
    two = tangential_force_fabric(signs * normals, signs * force, Z)
    np.testing.assert_allclose(one.matrix, two.matrix, atol=1e-14)


@pytest.mark.parametrize(
    ("normals", "force"),
    [
        (np.zeros((0, 3)), np.zeros(0)),
        # all along one axis: none across, where 1 + n·C·n would be below 0 for others; here above
        (np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([-1.0, -2.0])),
    ],
)
def test_no_contacts_and_no_compression_have_no_force_fabric(normals, force):
    assert normal_force_fabric(normals, force, Z) is None


def test_a_direction_that_the_density_leaves_empty():
    normals = np.array([[1.0, 0, 0]] * 30 + [[0, 0, 1.0]])
    assert branch_fabric(normals, np.ones(31), Z) is None
