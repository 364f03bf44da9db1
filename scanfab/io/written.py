"""A packing as arrays, by names that readers know: the same for the writers of all formats."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.bodies import numbers_in_columns
from scanfab.io.columns import DIAMETER_NAMES
from scanfab.io.reader import BODIES, WALLS
from scanfab.io.sizes import other_size
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

Columns = dict[str, npt.NDArray[Any]]

# names that a reader would take for what scanfab writes under them
TAKEN = {"id", "x", "y", "z", "radius", "position"}


def standard_columns(packing: Packing) -> Columns:
    """``id``, and bodies and contacts with walls if there are any."""
    columns: Columns = {"id": packing.id}
    if packing.bodies is not None:
        columns[BODIES] = packing.bodies.number
    elif numbers_in_columns(packing.columns) is not None:
        # a reader would join the spheres that another column numbers
        columns[BODIES] = np.full(len(packing), -1)
    if packing.wall_contacts.any():
        columns[WALLS] = packing.wall_contacts
    return columns


def own_columns(packing: Packing) -> tuple[Columns, list[str]]:
    """
    The columns of the source, as numbers and texts, and notes on those that were changed.

    A column whose name a reader would misunderstand gets another name. A column that holds neither
    numbers nor texts is left out.
    """
    found: Columns = {}
    notes = []
    for name, column in packing.columns.items():
        values = np.asarray(column)
        if values.dtype.kind in "OS":
            words = [
                one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one)
                for one in values.ravel()
            ]
            values = np.array(words, dtype=str).reshape(values.shape)
        if values.dtype.kind not in "biufU":
            notes.append(f"the column {name} is left out: it holds {values.dtype}")
            continue
        if values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8):
            values = values.astype(np.float64)
        free, plain = name, re.sub(r"[^a-z0-9]", "", name.lower())
        is_size = name.lower() in DIAMETER_NAMES
        if (
            plain in TAKEN
            or name in (BODIES, WALLS)
            or (is_size and other_size(packing.radius, values) is not None)
        ):
            free = free_name(name, [*found, *packing.columns])
            notes.append(f"the column {name} is called {free}: {name} is what grains are read from")
        found[free] = values
    return found, notes


def free_name(name: str, used: Iterable[str]) -> str:
    """Another name for a column whose own name a reader would misunderstand."""
    free = f"{name}_of_dump"
    while free in used:
        free += "_"
    return free


def flat(columns: Columns) -> tuple[Columns, list[str]]:
    """Columns of one value for each grain, truth as 0 and 1; and notes on those that were split."""
    found: Columns = {}
    notes = []
    for name, values in columns.items():
        count = int(np.prod(values.shape[1:]))
        parts = [name]
        if values.ndim > 1:
            parts = [f"{name}_{axis}" for axis in ("xyz" if count == 3 else range(count))]
            notes.append(f"the column {name} stands as {', '.join(parts)}")
        table = values.astype(np.int64) if values.dtype.kind == "b" else values
        found |= zip(parts, table.reshape(len(values), count).T, strict=True)
    return found, notes


def table_columns(packing: Packing) -> tuple[Columns, Columns, list[str]]:
    """The columns of a table that readers know, those of the source, and notes on the latter."""
    own, notes = own_columns(packing)
    own, split = flat(own)
    standard = standard_columns(packing)
    place = dict(zip("xyz", packing.position.T, strict=True))
    known = {"id": standard.pop("id"), **place, "radius": packing.radius, **standard}
    return known, own, [*notes, *split]


def more_columns(packing: Packing) -> Columns:
    """
    All that there is of the grains but id, position and radius, in columns of one value a grain.

    Parameters
    ----------
    packing : Packing
        To be written.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        By names that a reader takes for what they are.
    """
    known, own, _ = table_columns(packing)
    return {name: values for name, values in known.items() if name not in TAKEN} | own


def csv_bytes(columns: Columns, separator: str = ",", *, with_names: bool = True) -> bytes:
    """A table as text, with all digits; texts are in quotes where need be if it has names."""
    import polars

    stream = io.BytesIO()
    polars.DataFrame({name: np.array(values) for name, values in columns.items()}).write_csv(
        stream,
        separator=separator,
        include_header=with_names,
        quote_style="necessary" if with_names else "never",
    )
    return stream.getvalue()


def frame_arrays(packing: Packing) -> dict[str, Any]:
    """``step``, ``time``, and the cell as ``cell``, ``origin`` and ``periodic``, if known."""
    cell = packing.cell
    found: dict[str, Any] = {"step": packing.step, "time": packing.time}
    if cell is not None:
        found |= {"cell": cell.vectors, "origin": cell.origin, "periodic": np.array(cell.periodic)}
    return {name: values for name, values in found.items() if values is not None}


def contact_arrays(packing: Packing) -> Columns:
    """Image and force of each contact, or the normal force if no more is known."""
    contacts = packing.contacts
    if contacts is None:
        return {}
    found: Columns = {"image": contacts.image}
    if contacts.force is not None:
        found["force"] = contacts.force
    elif contacts.force_n is not None:
        found["force_n"] = contacts.force_n
    return found


def cell_of(path: Path, arrays: Mapping[str, Any]) -> Cell | None:
    """The cell of :func:`frame_arrays`; ReadError if it is none."""
    if "cell" not in arrays:
        return None
    try:
        vectors, origin = (np.asarray(arrays[name], np.float64) for name in ("cell", "origin"))
        x, y, z = (bool(one) for one in np.ravel(arrays["periodic"]))
        return Cell(vectors.reshape(3, 3), (x, y, z), origin.reshape(3))
    except (KeyError, TypeError, ValueError, PackingError) as error:
        raise ReadError(f"{path}: cell, origin and periodic are no cell: {error}") from None


def contacts_of(path: Path, pairs: npt.NDArray[Any], arrays: Mapping[str, Any]) -> ContactList:
    """The contacts of :func:`contact_arrays`, by rows; ReadError if an array does not fit."""
    count = len(pairs)
    known = {"image": (count, 3), "force": (count, 3), "force_n": (count,)}
    found = {name: arrays[name] for name in known if name in arrays}
    for name, values in found.items():
        if values.shape != known[name] or values.dtype.kind not in "iuf":
            raise ReadError(f"{path}: {name}: expected numbers of shape {known[name]}")
    force = found.get("force")
    force_n = found.get("force_n") if force is None else None
    return ContactList(pairs, found.get("image"), force, force_n=force_n)
