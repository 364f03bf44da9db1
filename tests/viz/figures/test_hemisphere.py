"""The disk that directions are drawn on, and the density of contact normals there."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.viz.figures.hemisphere import disk, smoothed_density


def test_the_disk_is_equal_area():
    places, directions = disk()
    assert np.linalg.norm(directions, axis=-1) == pytest.approx(np.ones(directions.shape[:2]))
    # the cap within polar angle p has the share 1 - cos p of the hemisphere, as of the disk
    rho = np.linalg.norm(places, axis=-1)
    assert rho**2 == pytest.approx(1 - directions[..., 2], abs=1e-12)


def test_the_density_of_isotropic_normals_is_one():
    normals = np.random.default_rng(0).standard_normal((200_000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    _, directions = disk()
    some = directions[::10, ::10]
    assert smoothed_density(normals, some) == pytest.approx(np.ones(some.shape[:2]), abs=0.02)
