"""Branch and force fabric: closed forms, errors by drawing samples, and LAMMPS' compute fabric."""

import numpy as np
import pytest

from scanfab.fabric.forces import directional_mean
from tests.helpers.measured import drawn

Z = np.array([0.0, 0.0, 1.0])


def p2(normals):
    return 1.5 * normals[:, 2] ** 2 - 0.5


def normals_of(rng, count, a2=0.8):
    """Normals of the density 1 + a2 P2(n·z)."""
    return drawn(rng, count, lambda n: 1 + a2 * p2(n), 1 + a2)


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


def fabrics(normals, branch, force, axis=Z):
    """Of branches, normal and tangential forces."""
    size = np.sum(force * normals, axis=1)
    return (
        directional_mean(normals, branch, axis),
        directional_mean(normals, size, axis),
        directional_mean(normals, size, axis, across=force - size[:, None] * normals),
    )


def test_against_the_formula_contact_by_contact():
    rng, axis = np.random.default_rng(1), np.array([0.48, 0.6, 0.64])
    normals, branch = normals_of(rng, 300), rng.uniform(1, 2, 300)
    force = rng.normal(size=(300, 3)) + 3 * normals
    force_n = np.sum(force * normals, axis=1)
    tangential = force - force_n[:, None] * normals
    cases = [
        (branch[:, None] * normals, branch, 7.5),
        (force_n[:, None] * normals, force_n, 7.5),
        (tangential, force_n, 5.0),
    ]
    found_ones = fabrics(normals, branch, force, axis)
    for found, (vectors, size, factor) in zip(found_ones, cases, strict=True):
        np.testing.assert_allclose(found.matrix, naive(normals, vectors, size, factor), atol=1e-13)
        assert found.axial == pytest.approx(1.5 * axis @ found.matrix @ axis, abs=1e-13)
        assert np.trace(found.matrix) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("density", [0.0, 0.6])
def test_known_harmonics_come_back_whatever_the_density_of_contacts(density):
    """b = 1 + 0.3 P2, f_n = 1 + 0.5 P2, f_t = -0.2 dP2/dθ: the axial values are 0.3, 0.5, 0.2."""
    rng = np.random.default_rng(2)
    normals = normals_of(rng, 200_000, density)
    force_n = 1 + 0.5 * p2(normals)
    across = Z - normals[:, 2:] * normals
    # dP2/dθ = -3 cos sin, and |across| = sin; the mean tangential force points towards the axis
    force = force_n[:, None] * normals + 0.2 * 3 * normals[:, 2:] * across
    found = fabrics(normals, 1 + 0.3 * p2(normals), force)
    expected = [0.3 * 1.5, 0.5 * 1.5, 0.2 * 1.5 * 2.0]
    for one, value in zip(found, expected, strict=True):
        assert abs(one.axial - value) < max(5 * one.axial_se, 0.01)


@pytest.mark.parametrize(
    ("normals", "size"),
    [
        (np.zeros((0, 3)), np.zeros(0)),
        # none that are pressed
        (np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([-1.0, -2.0])),
        # a direction about which there are so few that 1 + n·C·n is below 0
        (np.array([[1.0, 0, 0]] * 30 + [[0, 0, 1.0]]), np.ones(31)),
    ],
)
def test_contacts_that_have_no_force_fabric(normals, size):
    assert directional_mean(normals, size, Z) is None
