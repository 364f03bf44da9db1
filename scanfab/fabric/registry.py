"""
The fabrics of a table: each an object in one file, with its columns, formula and source.

Those of this package stand in ``OWN_FABRICS``. Another package offers one under the entry point
``scanfab.fabrics``; its columns come behind the own ones of every table that is computed.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Protocol

from scanfab.base.column import Column
from scanfab.base.plugins import load_plugins
from scanfab.fabric.contact import Contact
from scanfab.fabric.jackknife import Halves, Scatter
from scanfab.fabric.measured import Measured
from scanfab.fabric.orientation import Orientation
from scanfab.fabric.void import Void

__all__ = ["OWN_FABRICS", "Fabric", "Measured", "installed_fabrics"]

GROUP = "scanfab.fabrics"


class Fabric(Protocol):
    """One fabric, or what is made of fabrics."""

    columns: tuple[Column, ...]

    def values(self, measured: Measured) -> dict[str, Any]:
        """A value for each of its columns; None for one that does not exist."""
        ...


# in the order of their columns; a new one comes behind
OWN_FABRICS: dict[str, Fabric] = {
    "void": Void(),
    "contact": Contact(),
    "scatter": Scatter(),
    "orientation": Orientation(),
    "halves": Halves(),
}


@cache
def installed_fabrics() -> dict[str, Fabric]:
    """The fabrics of other packages by name; none as a rule."""
    return load_plugins(GROUP, "fabric")
