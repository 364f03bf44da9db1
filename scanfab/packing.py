"""The common table: the grains and contacts of one frame, cast and checked once, here."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.cast import cast, grains_named
from scanfab.cell import Cell
from scanfab.contact_list import ContactList, Contacts, Spheres, resolve_contacts
from scanfab.errors import PackingError

__all__ = ["ContactList", "Contacts", "Packing"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Packing:
    """
    One frame: spheres, their contacts and the cell.

    Parameters
    ----------
    position : array_like, shape (N, 3)
        Centres, dump's length unit. Wrapped into the cell along its periodic vectors.
    radius : array_like, shape (N,) or float
        Radii, dump's length unit.
    id : array_like of int, shape (N,), optional
        The dump's own numbers of the grains; the row numbers by default.
    columns : mapping of str to array_like, optional
        What else the dump says of each grain (``type``, ``mask``, ``clump``, ...), N rows each.
    contacts : array_like of int, shape (M, 2), or ContactList, optional
        Pairs of rows. Without it contacts are to be found from geometry.
    wall_contacts : array_like of int, shape (N,), optional
        Number of contacts of each grain with walls, that is with bodies that are not in the table.
    cell : Cell, optional
        The (periodic) cell.
    step, time : int, float, optional
        Of the dump.

    Raises
    ------
    PackingError
        If a shape is wrong, a number is not finite, a radius is not positive, an id occurs twice,
        or a contact names a row that does not exist.

    Examples
    --------
    >>> from scanfab import Packing
    >>> packing = Packing([[0, 0, 0], [2, 0, 0]], 1.0, contacts=[[0, 1]])
    >>> packing.contacts.normal
    array([[1., 0., 0.]])
    """

    def __init__(
        self,
        position: npt.ArrayLike,
        radius: npt.ArrayLike,
        *,
        id: npt.ArrayLike | None = None,
        columns: Mapping[str, npt.ArrayLike] | None = None,
        contacts: npt.ArrayLike | ContactList | None = None,
        wall_contacts: npt.ArrayLike | None = None,
        cell: Cell | None = None,
        step: int | None = None,
        time: float | None = None,
    ) -> None:
        centres = cast("position", position, np.float64, (None, 3))
        count = len(centres)
        radii = np.asarray(radius)
        self.radius: FloatArray = cast(
            "radius", np.full(count, radii) if radii.ndim == 0 else radii, np.float64, (count,)
        )
        self.id: IntArray = cast("id", np.arange(count) if id is None else id, np.int64, (count,))
        _check_grains(centres, self.radius, self.id)
        turns: IntArray | None = None
        self.position: FloatArray = centres
        if cell is not None:
            self.position, turns = cell.place(centres)
        self.position.flags.writeable = False
        self.columns: dict[str, npt.NDArray[Any]] = {
            name: cast(name, values, None, (count, ...)) for name, values in (columns or {}).items()
        }
        self.wall_contacts: IntArray = _wall_contacts(
            np.zeros(count, np.int64) if wall_contacts is None else wall_contacts, count
        )
        self.cell = cell
        self.step = None if step is None else int(step)
        self.time = None if time is None else float(time)
        self.contacts: Contacts | None = None
        if contacts is not None:
            listed = contacts if isinstance(contacts, ContactList) else ContactList(contacts)
            self.contacts = resolve_contacts(listed, self._spheres(turns))

    def __len__(self) -> int:
        return len(self.radius)

    def __repr__(self) -> str:
        contacts = "unknown" if self.contacts is None else len(self.contacts)
        return f"Packing(grains={len(self)}, contacts={contacts}, step={self.step})"

    @property
    def is_periodic(self) -> bool:
        """Whether the packing repeats along any direction."""
        return self.cell is not None and self.cell.is_periodic

    def with_contacts(
        self, contacts: ContactList | Contacts, wall_contacts: npt.ArrayLike | None = None
    ) -> Packing:
        """
        The same grains with other contacts.

        Parameters
        ----------
        contacts : ContactList or Contacts
            Images in a list are from the wrapped positions. Contacts that are worked out already
            are taken as they are.
        wall_contacts : array_like of int, shape (N,), optional
            Those of this packing by default.
        """
        other = copy.copy(self)
        if wall_contacts is not None:
            other.wall_contacts = _wall_contacts(wall_contacts, len(self))
        if isinstance(contacts, ContactList):
            contacts = resolve_contacts(contacts, self._spheres(None))
        other.contacts = contacts
        return other

    def _spheres(self, turns: IntArray | None) -> Spheres:
        return Spheres(self.position, self.radius, self.id, self.cell, turns)


def _wall_contacts(values: npt.ArrayLike, count: int) -> IntArray:
    numbers: IntArray = cast("wall_contacts", values, np.int64, (count,))
    if np.any(numbers < 0):
        raise PackingError("wall_contacts: expected 0 or more for each grain")
    return numbers


def _check_grains(position: FloatArray, radius: FloatArray, id: IntArray) -> None:
    """Finite numbers, positive radii, unique ids."""
    infinite = ~(np.isfinite(position).all(axis=1) & np.isfinite(radius))
    if infinite.any():
        raise PackingError(
            f"{grains_named(id, infinite)}: position and radius must be finite numbers"
        )
    if np.any(radius <= 0):
        raise PackingError(f"{grains_named(id, radius <= 0)}: the radius must be larger than zero")
    unique, counts = np.unique(id, return_counts=True)
    if unique.size < id.size:
        raise PackingError(
            f"the id {unique[np.argmax(counts > 1)]} occurs twice: "
            f"{unique.size} ids for {id.size} grains"
        )
