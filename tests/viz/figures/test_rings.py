"""Values around a polar angle."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.viz.figures.rings import contact_ring


def test_contact_rings_of_isotropic_normals_are_one():
    normals = np.random.default_rng(0).standard_normal((200_000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for phi in (30.0, 90.0):
        ring = contact_ring(normals, phi)
        assert np.all(np.abs(ring.value - 1) < 5 * ring.error)
        assert ring.value.mean() == pytest.approx(1, abs=0.02)
