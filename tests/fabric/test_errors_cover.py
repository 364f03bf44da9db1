"""Errors of all groups of columns against the scatter of drawn samples, in space and of discs."""

from dataclasses import replace

import numpy as np
import pytest

from scanfab.base.space import SPACE, Space
from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.forces import Forces
from scanfab.fabric.harmonics import Harmonics
from scanfab.fabric.invariants import Invariants
from scanfab.fabric.measured import ContactForces, Measured, SampleState
from scanfab.fabric.state import State
from scanfab.scan.directions import direction_rule, plane_rule
from tests.helpers.measured import drawn

SPACES = {"space": SPACE, "discs": Space(2)}
AXIS = {"space": (0.0, 0.0, 1.0), "discs": (0.0, 1.0, 0.0)}
COUNT, SAMPLES = 600, 300


def made(name, rng):
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
        blocked=None,
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
        measured = made(request.param, rng)
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
    measured = made(name, np.random.default_rng(1))
    fabric = contact_fabric(measured.normals, space)
    factor = 2 * np.sqrt(2) if space.is_plane else 15 / np.sqrt(6)
    sideways = [k for k in range(3) if space.identity[k, k] and not axis[k]]
    found = State().values(measured)
    assert found["acst_c"] == pytest.approx(factor * fabric.axial(axis))
    assert found["acst_c"] > 0
    assert found["acst_vs"] == pytest.approx(factor * measured.void.tensor.axial(axis), rel=1e-6)
    across = sum(np.outer(np.eye(3)[k], np.eye(3)[k]) for k in sideways)
    other = SampleState(1.0, 4.0, space.identity + across, space)
    turned = State().values(replace(measured, state=other))
    assert turned["acst_c"] == pytest.approx(-found["acst_c"])


def test_tensors_of_fourth_order_are_whole():
    """81 numbers, in the plane too: those with an index across it are 0."""
    for name, space in SPACES.items():
        found = Harmonics().values(made(name, np.random.default_rng(2)))
        for one in ("vs_tensor4", "c_tensor4"):
            tensor = np.reshape(found[one], (3, 3, 3, 3))
            assert np.einsum("iijj", tensor) == pytest.approx(1.0)
            if space.is_plane:
                assert not tensor[2].any()
