"""Invariants: closed forms, what few contacts give an isotropic sample, coverage of the errors."""

import numpy as np
import pytest

from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.invariants import Invariants, intensity
from scanfab.fabric.void import void_fabric
from scanfab.scan.directions import direction_rule
from tests.helpers.lattices import unit_vectors
from tests.helpers.measured import measured_of

Z = np.array([0.0, 0.0, 1.0])


def values(normals, **more):
    return Invariants().values(measured_of(normals, **more))


@pytest.mark.parametrize("lateral", [0.25, 0.3, 1 / 3, 0.4])
def test_a_is_seven_and_a_half_alpha_for_transverse_isotropy(lateral):
    matrix = np.diag([lateral, lateral, 1 - 2 * lateral])
    axial = 1 - 3 * lateral
    assert intensity(matrix) == pytest.approx(7.5 * abs(axial), abs=1e-14)


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
    assert found["f_c"] == pytest.approx(intensity(contact_fabric(normals).matrix))
