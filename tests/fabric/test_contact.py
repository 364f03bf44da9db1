"""The contact fabric equals its formula written out, and its error is that of a mean."""

import numpy as np
import pytest

from scanfab import contact_fabric
from scanfab.fabric.contact import axial_error
from tests.helpers import naive


def random_normals(count, seed=0):
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


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


def test_contact_fabric_equals_the_written_out_mean_whatever_the_signs():
    normals = random_normals(50)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (50, 1))
    found = contact_fabric(normals).matrix
    assert found == pytest.approx(naive.contact_tensor(normals))
    assert np.array_equal(contact_fabric(normals * signs).matrix, found)
    assert np.trace(found) == pytest.approx(1.0)


def test_too_few_contacts_have_no_fabric_and_no_error():
    assert contact_fabric([]) is None
    assert axial_error(np.zeros((0, 3)), (0, 0, 1)) is None
    assert axial_error(np.eye(3)[:1], (0, 0, 1)) is None
