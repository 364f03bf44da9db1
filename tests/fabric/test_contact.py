"""The contact fabric equals its formula written out, and its error is that of a mean."""

import numpy as np
import pytest

from scanfab import contact_fabric
from scanfab.fabric.contact import axial_error
from tests.helpers import naive


def random_normals(count, seed=0):
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_contact_fabric_equals_the_written_out_mean():
    normals = random_normals(50)
    assert contact_fabric(normals).matrix == pytest.approx(naive.contact_tensor(normals))


def test_signs_of_the_normals_do_not_matter():
    normals = random_normals(50)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (50, 1))
    assert np.array_equal(contact_fabric(normals * signs).matrix, contact_fabric(normals).matrix)


def test_trace_is_one():
    assert np.trace(contact_fabric(random_normals(7)).matrix) == pytest.approx(1.0)


@pytest.mark.parametrize("normals", [[], np.zeros((0, 3))])
def test_no_contacts_have_no_fabric(normals):
    assert contact_fabric(normals) is None


def test_axial_error_is_the_error_of_a_mean():
    normals, axis = random_normals(40), np.array([0.6, 0.0, 0.8])
    each = [naive.axial(naive.contact_tensor([normal]), axis) for normal in normals]
    assert np.mean(each) == pytest.approx(contact_fabric(normals).axial(axis))
    assert axial_error(normals, axis) == pytest.approx(np.std(each, ddof=1) / np.sqrt(40))


def test_axial_error_is_the_scatter_over_samples():
    """Of 400 samples of 200 random normals each; for random normals 1/√5 / √200."""
    samples = [random_normals(200, seed) for seed in range(400)]
    scatter = np.std([contact_fabric(normals).axial((0, 0, 1)) for normals in samples], ddof=1)
    mean_error = np.mean([axial_error(normals, (0, 0, 1)) for normals in samples])
    assert mean_error == pytest.approx(1 / np.sqrt(5 * 200), rel=0.02)
    assert scatter == pytest.approx(mean_error, rel=0.15)


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_contacts_have_no_error(count):
    assert axial_error(np.eye(3)[:count], (0, 0, 1)) is None
