"""Moved to scanfab.io.columns."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.io.columns import DIAMETER_NAMES as DIAMETER_NAMES
from scanfab.io.columns import ID_NAMES as ID_NAMES
from scanfab.io.columns import POSITION_NAMES, _first_of
from scanfab.io.columns import RADIUS_NAMES as RADIUS_NAMES
from scanfab.io.columns import grain_table as grain_table
from scanfab.io.columns import has_radius as has_radius
from scanfab.io.columns import refuse_cylindrical as refuse_cylindrical
from scanfab.io.columns import refuse_named_twice as refuse_named_twice
from scanfab.io.columns import user_cell as user_cell
from scanfab.io.columns import whole_numbers as whole_numbers
from scanfab.io.reader import ReadOptions
from scanfab.packing.bodies import CLUMP_COLUMNS, MOLECULE_COLUMNS
from scanfab.packing.boundary import CLASS_COLUMNS


def room_for_columns(
    options: ReadOptions, names: Sequence[str], count: int
) -> tuple[dict[str, npt.NDArray[Any]], dict[str, npt.NDArray[Any]]]:
    """
    Empty arrays for those of a dump's columns that :func:`grain_table` or most users ask for.

    Returns them by the dump's names, where they are to be filled in, and by the names that
    ``grain_table`` knows: coordinates are columns of one array, ``position``.
    """
    coordinates = {name for system, _ in POSITION_NAMES for name in system.split()}
    known = {
        *coordinates,
        *RADIUS_NAMES,
        *DIAMETER_NAMES,
        *ID_NAMES,
        *CLASS_COLUMNS,
        *CLUMP_COLUMNS,
        *MOLECULE_COLUMNS,
    }
    own = options.columns
    id = own.get("id", _first_of(ID_NAMES, names))
    columns: dict[str, npt.NDArray[Any]] = {
        name: np.empty(count, np.int64 if name == id else np.float64)
        for name in names
        if name.lower() in known or name in own.values() or name == options.bodies
    }
    for system, scaled in POSITION_NAMES:
        found = [_first_of((name,), names) for name in system.split()]
        chosen = [name for name in found if name is not None]
        if len(chosen) < 3:
            continue
        named = not set(own.values()) <= set(names) - set(chosen) or own.keys() & set("xyz")
        if scaled or named or "position" in names:
            break
        position = np.empty((count, 3))
        filled = columns | dict(zip(chosen, position.T, strict=True))
        others = {name: column for name, column in columns.items() if name not in chosen}
        return filled, others | {"position": position}
    return columns, columns
