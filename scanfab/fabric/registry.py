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

    One with a column whose name is taken is left out with a warning, like a broken one.

    Raises
    ------
    ScanfabError
        If two packages use one name for a fabric, or for a column.
    """
    names = set(taken)
    offers = load_plugins(GROUP, "fabric", lambda one: _fabric(one, names))
    owners: dict[str, str] = {}
    for name, offer in offers.items():
        for column in offer.plugin.columns:
            who = f"{name!r} of {offer.package}"
            other = owners.setdefault(column.name, who)
            if other != who:
                raise ScanfabError(
                    f"two fabrics have a column called {column.name!r}: {other} and {who}; remove "
                    f"one of them"
                )
    return {name: offer.plugin for name, offer in offers.items()}


def _fabric(plugin: Any, taken: set[str]) -> Any:
    expected = "an object with columns and values, as scanfab.fabric.registry.Fabric has them"
    having(expected, columns=tuple | list, values=Callable)(plugin)
    for column in plugin.columns:
        if not isinstance(column, Column) or column.kind not in (int, float, str):
            raise TypeError(f"expected columns that hold int, float or str, found {column!r}")
        if column.name in taken:
            raise TypeError(f"its column {column.name!r} is one of scanfab's own: rename it")
    return plugin


def checked_values(name: str, fabric: Fabric, measured: Measured) -> dict[str, Any]:
    """
    The values of another package's fabric by its columns; what is not finite does not exist.

    Raises
    ------
    ScanfabError
        If it fails, lacks a value, or gives one that its column cannot hold.
    """
    columns = {column.name: column for column in fabric.columns}
    try:
        found = dict(fabric.values(measured))
        if found.keys() != columns.keys():
            raise ValueError(f"expected a value for each of {[*columns]}, found {found}")
        return {key: _value(column, found[key]) for key, column in columns.items()}
    except Exception as error:  # a foreign package may fail in any way
        raise ScanfabError(f"the fabric {name!r}: {type(error).__name__}: {error}") from error


def _value(column: Column, value: Any) -> Any:
    """A value as its column holds it."""
    if value is None or (column.kind is not str and not math.isfinite(value)):
        return None
    kept = column.kind(value)
    if kept != value:
        raise ValueError(f"{column.name}: expected {column.kind.__name__} or None, found {value!r}")
    return kept
