"""Direction rules: exact to their degree, axes once each, and the biases they admit to."""

import numpy as np
import pytest
from numpy.polynomial.legendre import legvander

from scanfab import SettingsError, direction_rule
from scanfab.scan.directions import AUTO_RULE, LEBEDEV_DEGREES
from tests.helpers.lattices import unit_vectors
from tests.helpers.naive import axial

LEBEDEV = [f"lebedev:{degree}" for degree in LEBEDEV_DEGREES]
DESIGNS = [*(f"design:{degree}" for degree in range(3, 22, 2)), "icosahedral:9"]
PRODUCTS = [f"product:{degree}" for degree in (2, 3, 4, 5, 8, 9, 16, 17, 40)]


def zonal_errors(rule, degree):
    """Means of P_l(n·m) for some m, of all l to a degree: 0 where all harmonics are exact."""
    poles = unit_vectors(np.random.default_rng(0), 4)
    return np.abs(np.tensordot(rule.weights, legvander(rule.axes @ poles.T, degree), 1)).max(axis=0)


def assert_sound(rule):
    """Unit vectors, each of them once, with positive weights that sum to one."""
    assert rule.axes.shape == (len(rule), 3)
    assert np.linalg.norm(rule.axes, axis=1) == pytest.approx(np.ones(len(rule)), abs=1e-12)
    assert rule.weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert np.all(rule.weights > 0)
    # neither an axis nor its opposite occurs twice
    cosines = np.abs(rule.axes @ rule.axes.T)
    np.fill_diagonal(cosines, 0.0)
    assert cosines.max(initial=0.0) < 1 - 1e-6


@pytest.mark.parametrize("text", DESIGNS + LEBEDEV + PRODUCTS)
def test_rule_integrates_even_harmonics_to_its_degree(text):
    rule = direction_rule(text)
    assert_sound(rule)
    assert rule.name == text
    assert rule.turned
    assert rule.bias < 1e-12
    assert rule.degree >= int(text.partition(":")[2])
    assert np.abs(rule.isotropic_tensor - np.eye(3) / 3).max() < 1e-13
    assert zonal_errors(rule, rule.degree)[2::2].max() < 1e-12


def test_auto_rule_is_exact_to_the_eighth_degree():
    assert direction_rule(AUTO_RULE).degree >= 8


@pytest.mark.parametrize(
    ("text", "alpha", "along_z", "gxz"),
    [
        ("equal-angle:10", 0.43, 0.167, 0.20),
        ("equal-angle:0.5", 0.48, 0.25, 0.20),
        ("equal-angle-full:10", 0.167, 0.167, 0.0),
        ("equal-angle-full:0.5", 0.25, 0.25, 0.0),
    ],
)
def test_literal_grids_know_their_bias(text, alpha, along_z, gxz):
    """Unit weights on equal steps: 0.48 and 0.25 in the limit. The step 0.5° is 0.004 from it."""
    rule = direction_rule(text)
    limit = 0.006
    assert rule.bias == pytest.approx(alpha, abs=limit)
    assert axial(rule.isotropic_tensor, (0, 0, 1)) == pytest.approx(along_z, abs=limit)
    assert rule.isotropic_tensor[0, 2] == pytest.approx(gxz, abs=limit)
    assert rule.weights == pytest.approx(np.full(len(rule), 1 / len(rule)))
    assert not rule.turned
    assert rule.degree is None


def test_literal_grids_cover_the_ranges_they_name():
    """θ in (-90°, 90°] or (-180°, 180°], φ in (0°, 90°], both in steps of 30°."""
    printed, full = direction_rule("equal-angle:30"), direction_rule("equal-angle-full:30")
    assert (len(printed), len(full)) == (3 * 6, 3 * 12)
    assert printed.axes[:, 0].min() > -1e-12
    for rule in (printed, full):
        polar = np.degrees(np.arccos(np.clip(rule.axes[:, 2], -1, 1)))
        assert sorted(set(np.round(polar, 6))) == [30, 60, 90]
    azimuth = np.round(np.degrees(np.arctan2(*printed.axes[-6:, 1::-1].T)), 6)
    assert azimuth.tolist() == [-60, -30, 0, 30, 60, 90]


def test_fibonacci_has_a_small_bias():
    rule = direction_rule("fibonacci:100")
    assert_sound(rule)
    assert rule.axes[:, 2].mean() == pytest.approx(0.5)
    assert rule.bias == pytest.approx(0.0075, abs=5e-4)
    assert rule.degree is None
    assert direction_rule("fibonacci:10000").bias < 1e-4


@pytest.mark.parametrize(
    ("text", "name", "axes"),
    [("lebedev:4", "lebedev:5", 7), ("lebedev:13", "lebedev:15", 43), ("design:8", "design:9", 24)],
)
def test_degrees_are_rounded_up(text, name, axes):
    rule = direction_rule(text)
    assert (rule.name, len(rule)) == (name, axes)


@pytest.mark.parametrize("count", [1, 3, 4, 25, 26, 44, 74, 100, 500, 1001, 2905])
def test_number_of_axes_gives_the_next_lebedev_rule_of_positive_weights(count):
    rule = direction_rule(str(count))
    lower = [direction_rule(text) for text in LEBEDEV if int(text[8:]) < rule.degree]
    assert len(rule) >= count
    assert max((len(other) for other in lower), default=0) < count
    assert np.all(rule.weights > 0)


def test_number_beyond_the_largest_lebedev_rule_gives_a_product_rule():
    rule = direction_rule("2906")
    assert rule.name.startswith("product:")
    assert 2906 <= len(rule) < 6000
    assert rule.bias < 1e-12


@pytest.mark.parametrize(
    "text",
    [
        "", "2.5", "many", "gauss:5", "lebedev:x", "lebedev:133", "design:23", "product:1001",
        "fibonacci:0", "equal-angle:7", "equal-angle:0.1", "equal-angle-full:100",
    ],
)  # fmt: skip
def test_text_that_names_no_rule_is_an_error(text):
    with pytest.raises(SettingsError, match=r"^directions: "):
        direction_rule(text)


def test_a_number_of_axes_need_not_be_text():
    assert direction_rule(13) == direction_rule("13")
    assert direction_rule(13) != direction_rule(25)
