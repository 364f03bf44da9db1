"""What fabrics are computed from, made up by a test: contacts, forces, a void fabric."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from scanfab.fabric.contact import contact_fabric

__all__ = ["measured_of"]


def measured_of(normals: np.ndarray, axis: Any = (0.0, 0.0, 1.0), **more: Any) -> Any:
    """As ``Measured``, of contacts with these normals; no void fabric unless ``void`` is one."""
    found = {"void": None, "forces": None, "state": None, "segment_count": 0, **more}
    contact = contact_fabric(normals)
    return SimpleNamespace(normals=normals, axis=np.asarray(axis), contact=contact, **found)
