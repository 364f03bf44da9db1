"""Orders 2 and 4: closed forms, and samples that are drawn from known harmonics."""

import numpy as np
import pytest

from scanfab.fabric.harmonics import Harmonics, harmonic, tensor4
from scanfab.fabric.void import void_fabric
from scanfab.scan.directions import direction_rule
from tests.helpers.measured import drawn, measured_of

Z = np.array([0.0, 0.0, 1.0])


def test_legendre_polynomials_are_those_of_numpy():
    x = np.linspace(-1, 1, 7)
    for order in (2, 4):
        expected = np.polynomial.legendre.Legendre.basis(order)(x)
        np.testing.assert_allclose(harmonic(order, x), expected, atol=1e-14)


@pytest.mark.parametrize(("a2", "a4"), [(0.4, -0.35), (-0.3, 0.2)])
def test_contacts_drawn_from_harmonics_give_them_back(a2, a4):
    def density(n):
        return 1 + a2 * harmonic(2, n[:, 2]) + a4 * harmonic(4, n[:, 2])

    normals = drawn(np.random.default_rng(1), 200_000, density, 1 + abs(a2) + abs(a4))
    found = Harmonics().values(measured_of(normals))
    assert abs(found["c_a2"] - a2) < 4 * found["c_a2_se"]
    assert abs(found["c_a4"] - a4) < 4 * found["c_a4_se"]


def test_lengths_of_known_harmonics_give_them_back():
    axes = direction_rule("lebedev:15").axes[None]
    weights = direction_rule("lebedev:15").weights
    cosine = axes @ Z
    length = 1 + 0.2 * harmonic(2, cosine) - 0.1 * harmonic(4, cosine)
    void = void_fabric(axes, weights, length, np.ones_like(length))
    found = Harmonics().values(measured_of(np.zeros((0, 3)), void=void))
    assert found["vs_a2"] == pytest.approx(0.2)
    assert found["vs_a4"] == pytest.approx(-0.1)
    assert found["vs_a2"] == pytest.approx(5 * void.tensor.axial(Z))
    assert found["c_a2"] is None
    fourth = np.array(found["vs_tensor4"]).reshape(3, 3, 3, 3)
    np.testing.assert_allclose(np.einsum("ijkk->ij", fourth), void.tensor.matrix, atol=1e-12)


def test_the_fourth_order_tensor_of_isotropy():
    rule = direction_rule("lebedev:15")
    eye = np.eye(3)
    expected = sum(
        np.einsum(f"{one},{two}->ijkl", eye, eye)
        for one, two in (("ij", "kl"), ("ik", "jl"), ("il", "jk"))
    )
    found = tensor4(rule.axes, rule.weights)
    np.testing.assert_allclose(found, expected / 15, atol=1e-12)
    naive = np.mean([np.multiply.outer(np.outer(n, n), np.outer(n, n)) for n in eye], axis=0)
    np.testing.assert_allclose(tensor4(eye, np.ones(3)), naive)
