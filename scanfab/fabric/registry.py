"""
Fabrics besides those of voids and contacts: each a file with its columns, here or elsewhere.

A package offers one under the entry point ``scanfab.fabrics``; its columns come behind the own
ones of every table that is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

from scanfab.base.column import Column
from scanfab.base.plugins import load_plugins
from scanfab.base.typing import FloatArray, IntArray

__all__ = ["Fabric", "Measured", "installed_fabrics"]

GROUP = "scanfab.fabrics"


@dataclass(frozen=True, eq=False)
class Measured:
    """What a fabric is computed from: the scan and the contacts of one frame and variant."""

    axis: FloatArray
    """Loading axis, a unit vector, shape (3,)."""
    axes: FloatArray
    """Unit vectors along which each replicate was scanned, shape (R, D, 3)."""
    weights: FloatArray
    """Of the direction rule, shape (D,)."""
    length: FloatArray
    """Sum of the lengths of the kept void segments, shape (R, D), dump's length unit."""
    segments: FloatArray | IntArray
    """Number of the kept void segments, shape (R, D)."""
    normals: FloatArray
    """Unit normals of the contacts, shape (M, 3)."""
    points: FloatArray
    """Where these contacts are, shape (M, 3), dump's length unit."""


class Fabric(Protocol):
    """One more fabric."""

    columns: tuple[Column, ...]

    def values(self, measured: Measured) -> dict[str, Any]:
        """A value for each of its columns; None for one that does not exist."""
        ...


@cache
def installed_fabrics() -> dict[str, Fabric]:
    """The fabrics of other packages by name; none as a rule."""
    return load_plugins(GROUP, "fabric")
