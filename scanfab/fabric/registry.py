"""
The fabrics of a table: each fabric is an object with columns and values.

``OWN_FABRICS`` lists the fabrics of this package. Another package offers a fabric under the entry
point ``scanfab.fabrics``. Its columns follow the columns of this package in every computed table,
and it cannot replace any of these.
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
from scanfab.fabric.usual import Usual

GROUP = "scanfab.fabrics"


class Fabric(Protocol):
    """A fabric, or values derived from fabrics."""

    columns: tuple[Column, ...]

    def values(self, measured: Measured) -> dict[str, Any]:
        """A value for each of its columns; a missing value is None."""
        ...


# in the order of the columns in tables; a new fabric is added at the end
OWN_FABRICS: dict[str, Fabric] = {"usual": Usual()}

# groups of further columns, which the option `with_` adds, by name
GROUPS: dict[str, Fabric] = {
    "invariants": Invariants(),
    "state": State(),
    "forces": Forces(),
    "harmonics": Harmonics(),
}


def load_fabrics(taken: Iterable[str]) -> dict[str, Fabric]:
    """
    Load the fabrics of other packages, by name; usually there are none.

    A fabric that is broken, or that has a column whose name is ``taken`` by scanfab or by a fabric
    before it, is skipped with a warning.

    Raises
    ------
    ScanfabError
        If two packages use the same name for a fabric.
    """
    names = set(taken)

    def checked(plugin: Any) -> Any:
        expected = "an object with columns and values, as scanfab.fabric.registry.Fabric has them"
        having(expected, columns=tuple | list, values=Callable)(plugin)
        for column in plugin.columns:
            if not isinstance(column, Column) or column.kind not in (int, float, str):
                raise TypeError(f"expected columns that hold int, float or str, found {column!r}")
            if column.name in names:
                raise TypeError(f"there is already a column {column.name!r}: rename it")
        names.update(column.name for column in plugin.columns)
        return plugin

    return {name: offer.plugin for name, offer in load_plugins(GROUP, "fabric", checked).items()}


def checked_values(name: str, fabric: Fabric, measured: Measured) -> dict[str, Any]:
    """
    Values of another package's fabric, by column; NaN and infinite numbers become None.

    Raises
    ------
    ScanfabError
        If the fabric fails, lacks a value, or gives a value that its column cannot hold.
    """
    columns = {column.name: column.kind for column in fabric.columns}
    try:
        values = dict(fabric.values(measured))
        if values.keys() != columns.keys():
            raise ValueError(f"expected a value for each of {[*columns]}, found {values}")
        for key, kind in columns.items():
            value = values[key]
            if value is None or (kind is not str and not math.isfinite(value)):
                values[key] = None
            elif kind(value) != value:
                raise ValueError(f"{key}: expected {kind.__name__} or None, found {value!r}")
            else:
                values[key] = kind(value)
        return values
    except Exception as error:  # a foreign package may fail in any way
        raise ScanfabError(f"the fabric {name!r}: {type(error).__name__}: {error}") from error
