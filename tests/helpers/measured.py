"""What fabrics are computed from, made up by a test: contacts, forces, a void fabric."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from scanfab.base.space import SPACE
from scanfab.fabric.tensor import contact_fabric
from tests.helpers.lattices import unit_vectors


def measured_of(normals: np.ndarray, axis: Any = (0.0, 0.0, 1.0), **more: Any) -> Any:
    """As ``Measured``, of contacts with these normals; no void fabric unless ``void`` is one."""
    usual = {"void": None, "forces": None, "state": None, "segment_count": 0, "space": SPACE}
    found = {**usual, **more}
    contact = contact_fabric(normals)
    return SimpleNamespace(normals=normals, axis=np.asarray(axis), contact=contact, **found)


def drawn(
    random: np.random.Generator, count: int, density: Callable[[Any], Any], most: float, space=SPACE
) -> np.ndarray:
    """Unit vectors whose density is nowhere above ``most``, by rejection."""
    found = np.zeros((0, 3))
    while len(found) < count:
        n = unit_vectors(random, 3 * count) @ space.identity
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        found = np.concatenate([found, n[random.random(len(n)) * most < density(n)]])
    return found[:count]
