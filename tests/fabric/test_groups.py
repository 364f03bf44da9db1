"""Groups of columns: closed forms, samples drawn from known harmonics, errors against scatter."""

from dataclasses import replace

import numpy as np
import pytest

from scanfab.base.space import SPACE, Space
from scanfab.fabric.forces import Forces, directional_mean
from scanfab.fabric.harmonics import Harmonics, harmonic, tensor4
from scanfab.fabric.invariants import Invariants
from scanfab.fabric.measured import ContactForces, Measured, SampleState
from scanfab.fabric.state import State
from scanfab.fabric.tensor import contact_fabric
from scanfab.fabric.void import void_fabric
from scanfab.scan.directions import direction_rule, plane_rule
from tests.helpers.lattices import unit_vectors
from tests.helpers.measured import drawn, measured_of

Z = np.array([0.0, 0.0, 1.0])


def test_legendre_polynomials_are_those_of_numpy():
    x = np.linspace(-1, 1, 7)
    for order in (2, 4):
        expected = np.polynomial.legendre.Legendre.basis(order)(x)
        np.testing.assert_allclose(harmonic(order, x), expected, atol=1e-14)


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
    # contacts across the axis: 2 l + 1 times the Legendre polynomial at 0
    contacts = Harmonics().values(measured_of(np.array([[1.0, 0, 0], [0, -1.0, 0]])))
    assert (contacts["c_a2"], contacts["c_a4"]) == pytest.approx((-5 / 2, 9 * 3 / 8))


def test_the_tensor_of_fourth_order_is_the_weighted_mean_of_products():
    random = np.random.default_rng(0)
    normals, weights = unit_vectors(random, 9), random.random(9)
    each = [np.multiply.outer(np.outer(n, n), np.outer(n, n)) for n in normals]
    expected = np.average(each, axis=0, weights=weights)
    np.testing.assert_allclose(tensor4(normals, weights), expected)


def written_out(normals, vectors, size, factor):
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
    rng, axis = np.random.default_rng(1), np.array([0.48, 0.6, 0.64])
    normals = drawn(rng, 300, lambda n: 1 + 1.2 * n[:, 2] ** 2, 2.2)
    branch = rng.uniform(1, 2, 300)
    force = rng.normal(size=(300, 3)) + 3 * normals
    force_n = np.sum(force * normals, axis=1)
    tangential = force - force_n[:, None] * normals
    cases = [
        (branch[:, None] * normals, branch, 7.5),
        (force_n[:, None] * normals, force_n, 7.5),
        (tangential, force_n, 5.0),
    ]
    for k, (vectors, size, factor) in enumerate(cases):
        found = directional_mean(normals, size, axis, across=tangential if k == 2 else None)
        expected = written_out(normals, vectors, size, factor)
        np.testing.assert_allclose(found.matrix, expected, atol=1e-13)
        assert found.axial == pytest.approx(1.5 * axis @ found.matrix @ axis, abs=1e-13)
        assert np.trace(found.matrix) == pytest.approx(0.0, abs=1e-13)


NO_FABRIC = [
    (np.zeros((0, 3)), np.zeros(0)),
    # none that are pressed
    (np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([-1.0, -2.0])),
    # a direction about which there are so few that 1 + n·C·n is below 0
    (np.array([[1.0, 0, 0]] * 30 + [[0, 0, 1.0]]), np.ones(31)),
]


@pytest.mark.parametrize(("normals", "size"), NO_FABRIC)
def test_contacts_that_have_no_force_fabric(normals, size):
    assert directional_mean(normals, size, Z) is None


def values(normals, **more):
    return Invariants().values(measured_of(normals, **more))


@pytest.mark.parametrize("count", [100, 1000])
def test_the_bias_is_what_isotropic_contacts_give(count):
    """METHOD: the mean of a is 7.136/√N, its standard deviation 2.31/√N."""
    rng = np.random.default_rng(2)
    found = [values(unit_vectors(rng, count)) for _ in range(600)]
    a = np.array([one["f_c"] for one in found])
    bias = found[0]["f_c_bias"]
    assert bias == pytest.approx(7.136 / np.sqrt(count), rel=1e-3)
    assert a.mean() == pytest.approx(bias, abs=4 * 2.31 / np.sqrt(count * 600) + 0.3 / count)
    assert a.std() == pytest.approx(2.31 / np.sqrt(count), rel=0.12)
    # b says nothing there: alpha is about 1.07/√N
    assert sum(one["b_c"] is not None for one in found) < 3


def test_the_bias_of_voids_is_that_of_the_replicates():
    """A scan of an isotropic medium whose mean lengths have independent noise."""
    rng = np.random.default_rng(3)
    rule = direction_rule("lebedev:9")
    found = []
    for _ in range(300):
        axes = np.repeat(rule.axes[None], 16, axis=0)
        length = 1 + 0.05 * rng.normal(size=axes.shape[:2])
        void = void_fabric(axes, rule.weights, length, np.ones_like(length))
        found.append(values(np.zeros((0, 3)), void=void, segment_count=1000))
    a = np.array([one["f_vs"] for one in found])
    bias = np.sqrt(np.mean([one["f_vs_bias"] ** 2 for one in found]))
    assert a.mean() == pytest.approx(bias, rel=0.08)


def test_one_replicate_knows_no_bias_and_no_error():
    rule = direction_rule("lebedev:9")
    void = void_fabric(rule.axes[None], rule.weights, *[np.ones((1, len(rule)))] * 2)
    found = values(np.zeros((0, 3)), void=void)
    assert found["f_vs_bias"] is None
    assert found["gvs_1_se"] is None
    assert found["f_vs"] == pytest.approx(0.0, abs=1e-12)
    assert found["b_vs"] is None


def test_principal_values_and_b():
    normals = np.repeat(np.eye(3), [500, 300, 200], axis=0)
    found = values(normals)
    assert [found[f"gc_{k}"] for k in (1, 2, 3)] == pytest.approx([0.5, 0.3, 0.2])
    assert found["b_c"] == pytest.approx(1 / 3)
    # √(3/2 F:F) with F = 15/2 (G - I/3)
    assert found["f_c"] == pytest.approx(7.5 * np.sqrt(1.5 * (25 + 1 + 16) / 900))


SPACES = {"space": SPACE, "discs": Space(2)}
AXIS = {"space": (0.0, 0.0, 1.0), "discs": (0.0, 1.0, 0.0)}
COUNT, SAMPLES = 600, 300


def frame_of(name, rng):
    """One frame: contacts with forces, a scan with noise, a stress along the axis."""
    space, axis = SPACES[name], np.array(AXIS[name])
    n = drawn(rng, COUNT, lambda n: 1 + 0.6 * (n @ axis) ** 2, 1.6, space)
    cosine = (n @ axis) ** 2
    branch = 2 + 0.2 * cosine + rng.normal(0, 0.1, COUNT)
    size = (1 + 0.8 * cosine) * rng.gamma(2.0, 0.5, COUNT)
    across = rng.normal(size=(COUNT, 3)) @ space.identity
    force = size[:, None] * n + 0.1 * (across - np.sum(across * n, axis=1)[:, None] * n)
    rule = plane_rule(16, space) if space.is_plane else direction_rule("lebedev:9")
    length = 1 + 0.2 * (rule.axes @ axis) ** 2 + rng.normal(0, 0.05, (16, len(rule)))
    stress = space.identity + np.outer(axis, axis)
    return Measured(
        axis=axis,
        axes=np.broadcast_to(rule.axes, (16, *rule.axes.shape)),
        weights=rule.weights,
        length=length * 100,
        segments=np.full(length.shape, 100),
        meets_solids=True,
        normals=n,
        blocks=np.zeros(COUNT, int),
        space=space,
        segment_count=1600 * len(rule),
        forces=ContactForces(branch, size, force),
        state=SampleState(1.0, 4.0, stress, space),
    )


@pytest.fixture(scope="module", params=list(SPACES))
def samples(request):
    rng = np.random.default_rng(7)
    groups = (Forces(), Invariants(), State(), Harmonics())
    found = []
    for _ in range(SAMPLES):
        measured = frame_of(request.param, rng)
        found.append({k: v for one in groups for k, v in one.values(measured).items()})
    return found


def errors_of(samples):
    """
    The columns of errors.

    Without those of principal values that are equal but for chance: sorted, they keep apart, so
    that they scatter less than a tensor's components.
    """
    row, equal = samples[0], set()
    if row["gc_3"] is not None:
        equal = {"gvs_2_se", "gvs_3_se", "gc_2_se", "gc_3_se"}
    return [name for name in row if name.endswith("_se") and row[name] and name not in equal]


def test_every_error_is_that_of_the_scatter(samples):
    """
    The root of the mean square of the errors, within 4 times its own noise.

    That of bn is of second order: 600 contacts still make it some 10 % too large.
    """
    names = errors_of(samples)
    assert len(names) >= 15
    for name in names:
        error = np.sqrt(np.mean([one[name] ** 2 for one in samples]))
        scatter = np.std([one[name[:-3]] for one in samples], ddof=1)
        assert error == pytest.approx(scatter, rel=4 / np.sqrt(2 * SAMPLES) + 0.05), name


@pytest.mark.parametrize("name", list(SPACES))
def test_a_is_positive_where_contacts_and_stress_lie_along_the_axis(name):
    """A = F:n is 15/√6 of the axial anisotropy, of discs 2 √2; negative against the stress."""
    space, axis = SPACES[name], np.array(AXIS[name])
    measured = frame_of(name, np.random.default_rng(1))
    fabric = contact_fabric(measured.normals, space)
    factor = 2 * np.sqrt(2) if space.is_plane else 15 / np.sqrt(6)
    found = State().values(measured)
    assert found["acst_c"] == pytest.approx(factor * fabric.axial(axis))
    assert found["acst_c"] > 0
    assert found["acst_vs"] == pytest.approx(factor * measured.void.tensor.axial(axis), rel=1e-6)
    other = SampleState(1.0, 4.0, 2 * space.identity - np.outer(axis, axis), space)
    turned = State().values(replace(measured, state=other))
    assert turned["acst_c"] == pytest.approx(-found["acst_c"])


def test_tensors_of_fourth_order_are_whole_in_the_plane_too():
    """81 numbers: those with an index across it are 0; contracted they are the fabric tensor."""
    measured = frame_of("discs", np.random.default_rng(2))
    found = Harmonics().values(measured)
    for one, fabric in (("vs_tensor4", measured.void.tensor), ("c_tensor4", measured.contact)):
        tensor = np.reshape(found[one], (3, 3, 3, 3))
        np.testing.assert_allclose(np.einsum("ijkk->ij", tensor), fabric.matrix, atol=1e-12)
        assert not tensor[2].any()
