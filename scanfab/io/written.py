"""What a packing says of its grains, as columns that a file can hold and a reader finds again."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.io.bodies import numbers_in_columns
from scanfab.io.formats.columns import DIAMETER_NAMES
from scanfab.io.reader import BODIES, WALLS
from scanfab.io.sizes import other_size
from scanfab.packing.bodies import bodies_of
from scanfab.packing.packing import Packing

Columns = dict[str, npt.NDArray[Any]]

# names that a reader would take for what scanfab writes under them
TAKEN = {"id", "x", "y", "z", "radius", "position"}


def standard_columns(packing: Packing) -> Columns:
    """``id``, and if need be bodies and contacts with walls, by names that readers know."""
    columns: Columns = {"id": packing.id}
    bodies = _bodies(packing)
    if bodies is not None:
        columns[BODIES] = bodies
    if packing.wall_contacts.any():
        columns[WALLS] = packing.wall_contacts
    return columns


def _bodies(packing: Packing) -> npt.NDArray[Any] | None:
    """The number of each sphere's body, unless other columns give the same by themselves."""
    of_columns = numbers_in_columns(packing.columns)
    by_itself = (
        None
        if of_columns is None
        else bodies_of(of_columns, packing.position, packing.radius, packing.cell)
    )
    if packing.bodies is None:
        return None if by_itself is None else np.full(len(packing), -1)
    number = packing.bodies.number
    same = by_itself is not None and np.array_equal(by_itself.number, number)
    return None if same else number


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
    standard = standard_columns(packing)
    del standard["id"]
    return {**standard, **flat(own_columns(packing)[0])[0]}


def own_columns(packing: Packing) -> tuple[Columns, list[str]]:
    """
    The columns of the source, as numbers and texts, and what is to be said of them.

    A column whose name a reader would misunderstand gets another; what is neither number nor text
    is left out.
    """
    found: Columns = {}
    notes = []
    for name, values in packing.columns.items():
        plain = np.asarray(values)
        if plain.dtype.kind in "OS":
            plain = np.array([_text(one) for one in plain.ravel()], dtype=str).reshape(plain.shape)
        if plain.dtype.kind not in "biufU":
            notes.append(f"the column {name} is left out: it holds {plain.dtype}")
            continue
        disagrees = name.lower() in DIAMETER_NAMES and other_size(packing.radius, plain) is not None
        free = _free_name(name, [*found, *packing.columns], is_taken=disagrees)
        if free != name:
            notes.append(f"the column {name} is called {free}: {name} is what grains are read from")
        found[free] = plain
    return found, notes


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _free_name(name: str, used: Iterable[str], *, is_taken: bool) -> str:
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    if not is_taken and plain not in TAKEN and name not in (BODIES, WALLS):
        return name
    return free_name(name, used)


def free_name(name: str, used: Iterable[str]) -> str:
    """Another name for a column whose own one a reader would misunderstand."""
    free = f"{name}_of_dump"
    while free in used:
        free += "_"
    return free


def parts_of(name: str, values: npt.NDArray[Any]) -> list[str]:
    """The names of the columns of an array: one, or one for each of its components."""
    if values.ndim == 1:
        return [name]
    count = int(np.prod(values.shape[1:]))
    return [f"{name}_{axis}" for axis in ("xyz" if count == 3 else range(count))]


def flat(columns: Columns) -> tuple[Columns, list[str]]:
    """Columns of one value a grain, truth as 0 and 1, and what is to be said of them."""
    found: Columns = {}
    notes = []
    for name, values in columns.items():
        parts = parts_of(name, values)
        if values.ndim > 1:
            notes.append(f"the column {name} stands as {', '.join(parts)}")
        table = values.reshape(len(values), len(parts))
        for place, part in enumerate(parts):
            one = table[:, place]
            found[part] = one.astype(np.int64) if one.dtype.kind == "b" else one
    return found, notes
