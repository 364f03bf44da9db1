"""
The fabrics of a table: each an object in one file, with its columns, formula and source.

Those of this package stand in ``OWN_FABRICS``. Another package offers one under the entry point
``scanfab.fabrics``; its columns come behind the own ones of every table that is computed, none of
which it may replace.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from scanfab.base.column import Column
from scanfab.base.errors import ScanfabError
from scanfab.base.plugins import having, load_plugins
from scanfab.fabric.forces import Forces
from scanfab.fabric.harmonics import Harmonics
from scanfab.fabric.invariants import Invariants
from scanfab.fabric.measured import Measured
from scanfab.fabric.state import State
from scanfab.fabric.usual import Contact, Halves, Orientation, Scatter, Void

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

# those of tables that are asked for with `with_`, by the names of the groups
GROUPS: dict[str, Fabric] = {
    "invariants": Invariants(),
    "state": State(),
    "forces": Forces(),
    "harmonics": Harmonics(),
}


def load_fabrics(taken: Iterable[str]) -> dict[str, Fabric]:
    """
    The fabrics of other packages by name; none as a rule.

    One that is broken, or has a column whose name is ``taken`` by scanfab or by a fabric before it,
    is left out with a warning.

    Raises
    ------
    ScanfabError
        If two packages use one name for a fabric.
    """
    names = set(taken)

    def checked(plugin: Any) -> Any:
        expected = "an object with columns and values, as scanfab.fabric.registry.Fabric has them"
        having(expected, columns=tuple | list, values=Callable)(plugin)
        for column in plugin.columns:
            if not isinstance(column, Column) or column.kind not in (int, float, str):
                raise TypeError(f"expected columns that hold int, float or str, found {column!r}")
            if column.name in names:
                raise TypeError(f"there is a column {column.name!r} already: rename it")
        names.update(column.name for column in plugin.columns)
        return plugin

    return {name: offer.plugin for name, offer in load_plugins(GROUP, "fabric", checked).items()}


def checked_values(name: str, fabric: Fabric, measured: Measured) -> dict[str, Any]:
    """
    The values of another package's fabric by its columns; None for a number that is not finite.

    Raises
    ------
    ScanfabError
        If it fails, lacks a value, or gives one that its column cannot hold.
    """
    columns = {column.name: column.kind for column in fabric.columns}
    try:
        found = dict(fabric.values(measured))
        if found.keys() != columns.keys():
            raise ValueError(f"expected a value for each of {[*columns]}, found {found}")
        for key, kind in columns.items():
            value = found[key]
            if value is None or (kind is not str and not math.isfinite(value)):
                found[key] = None
            elif kind(value) != value:
                raise ValueError(f"{key}: expected {kind.__name__} or None, found {value!r}")
            else:
                found[key] = kind(value)
        return found
    except Exception as error:  # a foreign package may fail in any way
        raise ScanfabError(f"the fabric {name!r}: {type(error).__name__}: {error}") from error
