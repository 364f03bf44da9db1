"""Fabric, forces and stress of discs: closed forms of a density of directions in the plane."""

import numpy as np
import pytest

import scanfab
from scanfab import compute
from scanfab.base.space import Space
from scanfab.fabric.forces import directional_mean
from scanfab.fabric.harmonics import harmonic
from scanfab.fabric.invariants import bias_of, fabric_deviator, intensity
from scanfab.fabric.tensor import axial_error, contact_fabric
from scanfab.packing.bodies import lens_volumes
from tests.helpers.truth import OF_SHEAR, SAMPLE_DATA

XY = Space(2)
BIAXIAL = SAMPLE_DATA / "lammps_biaxial"
Y = np.array([0.0, 1.0, 0.0])


def normals_of(a2, count=20_000):
    """Unit vectors of the density 1/2π (1 + a2 cos 2θ) about y, at even steps of its integral."""
    theta = np.linspace(0, 2 * np.pi, 200_001)
    share = (theta + 0.5 * a2 * np.sin(2 * theta)) / (2 * np.pi)
    angle = np.interp((np.arange(count) + 0.5) / count, share, theta)
    return np.column_stack([np.sin(angle), np.cos(angle), 0 * angle]), angle


def test_a_density_of_second_order():
    """F = 4 (G - I/2) is that order: E = 1/2π (1 + n·F·n), a = √(1/2 F:F) = 2 α."""
    normals, angle = normals_of(0.3)
    fabric = contact_fabric(normals, XY)
    assert fabric.alpha == pytest.approx(0.15, abs=1e-6)
    assert fabric.axial(Y) == pytest.approx(0.15, abs=1e-6)
    assert intensity(fabric.matrix, XY) == pytest.approx(0.3, abs=1e-6)
    np.testing.assert_allclose(
        fabric_deviator(fabric.matrix, XY), np.diag([-0.3, 0.3, 0.0]), atol=1e-6
    )
    for order, expected in ((2, 0.3), (4, 0.0)):
        cosine = harmonic(order, normals @ Y, XY)
        assert 2 * cosine.mean() == pytest.approx(expected, abs=1e-6)
        np.testing.assert_allclose(cosine, np.cos(order * angle), atol=1e-9)


def test_isotropic_contacts_have_an_intensity_by_chance():
    """E a = √(π/N), and a² - 4/N is unbiased."""
    random, count = np.random.default_rng(1), 200
    found = []
    for _ in range(4000):
        angle = random.uniform(0, np.pi, count)
        normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        found.append(intensity(contact_fabric(normals, XY).matrix, XY))
    assert np.mean(found) == pytest.approx(np.sqrt(np.pi / count), rel=0.03)
    assert bias_of(XY) * np.sqrt(0.25 / count) == pytest.approx(np.sqrt(np.pi / count))
    assert np.mean(np.square(found)) == pytest.approx(4 / count, rel=0.05)
    assert axial_error(normals, Y, XY) == pytest.approx(np.sqrt(0.5 / count), rel=0.1)


def test_forces_of_second_order():
    """Branch, normal and tangential force after Rothenburg and Bathurst (1989), and q/p."""
    normals, angle = normals_of(0.02)
    along = np.cos(2 * angle)
    branch, force_n = 1 + 0.01 * along, 2 * (1 + 0.04 * along)
    # along y normal forces are larger; tangential ones lean towards it
    tangent = np.column_stack([np.cos(angle), -np.sin(angle), 0 * angle])
    across = -(2 * 0.015 * np.sin(2 * angle))[:, None] * tangent
    for found, expected in (
        (directional_mean(normals, branch, Y, XY), 0.01),
        (directional_mean(normals, force_n, Y, XY), 0.04),
        (directional_mean(normals, force_n, Y, XY, across), 0.015),
    ):
        np.testing.assert_allclose(found.matrix, np.diag([-expected, expected, 0.0]), atol=1e-5)
        assert found.axial == pytest.approx(2 * expected, abs=1e-5)
    stress = (force_n[:, None] * normals + across).T @ (branch[:, None] * normals)
    ratio = (stress[1, 1] - stress[0, 0]) / (stress[0, 0] + stress[1, 1])
    assert ratio == pytest.approx(0.5 * (0.02 + 0.01 + 0.04 + 0.015), abs=5e-4)


def test_lenses_of_discs():
    """Half overlapping discs share 2π/3 - √3/2 of a radius squared; one inside another is all."""
    apart, one = np.array([1.0, 0.2, 2.0, 0.0]), np.ones(4)
    two = np.array([1.0, 0.5, 1.0, 1.0])
    expected = [2 * np.pi / 3 - np.sqrt(3) / 2, 0.25 * np.pi, 0.0, np.pi]
    np.testing.assert_allclose(lens_volumes(apart, one, two, XY), expected, atol=1e-12)


@pytest.fixture(scope="module")
def biaxial():
    """The rows of the whole and an RV in each frame."""
    series = scanfab.read_series(
        [BIAXIAL / f"discs.{step}.lammpstrj.gz" for step in range(0, 120_000, 20_000)],
        contacts=BIAXIAL / "pairs.*.local.gz", contact_columns=OF_SHEAR, dim=2,
    )  # fmt: skip
    words = {"variants": "ac", "tolerance": 1e-3, "workers": 1}
    return compute(series, with_="forces,state,invariants", **words)


def test_fabric_and_stress_are_those_of_lammps(biaxial):
    """LAMMPS takes 15/2 (G - I/3) in a plane, too; Σ stress/atom of all pairs is -σ times area."""
    engine, whole = np.loadtxt(BIAXIAL / "engine.txt"), biaxial.select(variant="a")
    for place, name in enumerate(("xx", "yy", "zz", "xy")):
        expected = engine[:, 1 + place] / 7.5 + (1 / 3 if place < 3 else 0.0)
        np.testing.assert_allclose(whole[f"gc_{name}"], expected, atol=1e-9)
    for place, name in ((7, "xx"), (8, "yy"), (9, "xy")):
        expected = -engine[:, place] / engine[:, 10]
        np.testing.assert_allclose(whole[f"stress_{name}"], expected, rtol=0, atol=0.05)


def test_the_stress_ratio_is_the_sum_of_the_anisotropies(biaxial):
    rows = [*biaxial.select(variant="a")]
    assert rows[5].shear_strain > rows[4].shear_strain
    assert rows[4].alpha_c_axial > 0.08 > 0.02 > rows[0].alpha_c_axial
    for row in rows[1:5]:
        parts = sum(row[f"alpha_{name}_axial"] for name in ("bn", "fn", "ft")) / 2
        expected = 0.5 * (2 * row.alpha_c_axial + parts)
        assert row["q"] / (2 * row["p"]) == pytest.approx(expected, abs=0.02)
        assert row["f_c"] == pytest.approx(2 * row["alpha_c"])
        assert (row["b_c"], row["gc_3"]) == (None, 0.0)


def test_the_slope_through_the_origin_is_near_that_of_the_paper(biaxial):
    """Of the voids on the contacts, 0.231 in the two dimensions of the 2017 paper."""
    whole, rv = biaxial[:10].compare().summary
    # 400 discs are few: the slope of the whole is uncertain by 0.03, that of the RV by some 0.09
    assert whole.slope_origin == pytest.approx(0.231, abs=0.03)
    assert rv.slope_origin == pytest.approx(0.231, abs=0.09)
    assert abs(rv.slope - 0.231) < 2 * rv.slope_se
