"""The common table: the grains and contacts of one frame, which are cast and checked here."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import LEAST, MOST, all_within, cast, grains_named
from scanfab.base.errors import PackingError
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.bodies import Bodies, bodies_of
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList, Contacts, WallForces, resolve_contacts

# grains that a message names, and the share of centres that may lie off the plane of all others
MOST_NAMED, OFF_PLANE = 5, 0.01
# fewer centres may share a coordinate by chance
FEWEST = 10


class Packing:
    """
    One frame: spheres, their contacts and the cell.

    Parameters
    ----------
    position : array_like, shape (N, 3) or (N, 2)
        Centres, dump's length unit. Wrapped into the cell along its periodic vectors. Two
        coordinates are those of discs in the x-y plane, with z = 0.
    radius : array_like, shape (N,) or float
        Radii, dump's length unit.
    id : array_like of int, shape (N,), optional
        The dump's own numbers of the grains; the row numbers by default.
    columns : mapping of str to array_like, optional
        Further columns of the dump (``type``, ``mask``, ...), N rows each.
    bodies : array_like of int, shape (N,), optional
        Number of the rigid body that each sphere is a part of. A body is one grain, and has no
        contacts with itself. A sphere with a negative number is a grain of its own. By default each
        sphere is one.
    contacts : array_like of int, shape (M, 2), or ContactList, optional
        Pairs of rows. Without them, :func:`scanfab.find_contacts` finds contacts by geometry.
    wall_contacts : array_like of int, shape (N,), optional
        Number of contacts of each grain with walls, which are not in the table.
    wall_forces : WallForces, optional
        The forces of these contacts, if the source lists them.
    cell : Cell, optional
        The (periodic) cell.
    step, time : int, float, optional
        Time step and simulation time of the dump.
    dim : {2, 3}, optional
        2 for discs, whose centres share one coordinate. The default is 3, or 2 if positions have
        two coordinates. The cell of discs does not repeat across their plane.

    Raises
    ------
    PackingError
        If a shape is wrong, a number is not finite or above 1e100, a radius is not positive or
        below 1e-100, an id occurs twice, a contact names a row that does not exist, or discs do
        not lie in one coordinate plane.

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
        bodies: npt.ArrayLike | None = None,
        contacts: npt.ArrayLike | ContactList | None = None,
        wall_contacts: npt.ArrayLike | None = None,
        wall_forces: WallForces | None = None,
        cell: Cell | None = None,
        step: int | None = None,
        time: float | None = None,
        dim: int | None = None,
    ) -> None:
        if not isinstance(cell, Cell | None):
            raise PackingError(f"cell: expected a Cell, such as Cell([1, 1, 1]), found {cell!r}")
        centres, plane = _centres(position, dim)
        count = len(centres)
        radii = np.asarray(radius)
        self.radius: FloatArray = cast(
            "radius", np.full(count, radii) if radii.ndim == 0 else radii, np.float64, (count,)
        )
        self.id: IntArray = cast("id", np.arange(count) if id is None else id, np.int64, (count,))
        check_lengths(centres, self.radius, self.id)
        _refuse_twice(self.id)
        self.space: Space = flat_space(centres, self.id) if plane == 2 else SPACE
        if cell is not None and self.space.is_plane:
            cell = _cell_in_plane(cell, self.space)
        self.cell, turns = cell, None
        self.position = centres
        if cell is not None and not cell.surely_holds(centres):
            self.position, turns = cell.place(centres)
        self.position.flags.writeable = False
        self.columns: Mapping[str, npt.NDArray[Any]] = {
            name: cast(name, values, None, (count, ...)) for name, values in (columns or {}).items()
        }
        self.bodies: Bodies | None = None
        if bodies is not None:
            named = cast("bodies", bodies, np.int64, (count,))
            self.bodies = bodies_of(named, self.position, self.radius, cell, self.space)
        self.wall_contacts: IntArray = np.broadcast_to(np.int64(0), count)
        if wall_contacts is not None:
            self.wall_contacts = cast("wall_contacts", wall_contacts, np.int64, (count,))
            if np.any(self.wall_contacts < 0):
                raise PackingError("wall_contacts: expected 0 or more for each grain")
        self.wall_forces: WallForces | None = None
        if wall_forces is not None:
            self.wall_forces = _wall_forces(wall_forces, self.position, cell)
        self.step = None if step is None else int(step)
        self.time = None if time is None else float(time)
        self.contacts: Contacts | None = None
        if contacts is not None:
            listed = contacts if isinstance(contacts, ContactList) else ContactList(contacts)
            self.contacts = resolve_contacts(listed, self, turns)

    def __len__(self) -> int:
        return len(self.radius)

    def __repr__(self) -> str:
        parts = [counted(len(self), "particle")]
        if len(self):
            low, high = self.radius.min(), self.radius.max()
            parts[0] += f" of radius {low:.4g}" + ("" if low == high else f" to {high:.4g}")
        parts += [f"2D in {self.space}"] * self.space.is_plane
        if self.bodies is not None:
            parts.append(f"parts of {counted(int(self.bodies.is_head.sum()), 'grain')}")
        parts.append("contacts not known" if self.contacts is None else self.contacts.in_words())
        parts += [] if self.step is None else [f"step {self.step}"]
        cell = "" if self.cell is None else f"\n  {self.cell!r}"
        return f"Packing: {', '.join(parts)}{cell}"

    @property
    def place_across(self) -> float:
        """The coordinate that the centres of all discs share, dump's length unit."""
        assert self.space.across is not None
        return float(self.position[0, self.space.across]) if len(self) else 0.0

    @property
    def is_periodic(self) -> bool:
        """Whether the packing repeats along any direction."""
        return self.cell is not None and self.cell.is_periodic

    def with_contacts(self, contacts: ContactList | Contacts) -> Packing:
        """
        The same grains with other contacts, and the same contacts with walls.

        Parameters
        ----------
        contacts : ContactList or Contacts
            The images in a list count from the wrapped positions. Contacts are taken as they are.

        Returns
        -------
        Packing
        """
        other = copy.copy(self)
        if isinstance(contacts, ContactList):
            contacts = resolve_contacts(contacts, self, None)
        other.contacts = contacts
        return other


def _centres(position: npt.ArrayLike, dim: int | None) -> tuple[FloatArray, int]:
    """Positions with three coordinates (z = 0 of discs), and 2 or 3."""
    if dim not in (None, 2, 3):
        raise PackingError(f"dim: expected 2 or 3, found {dim!r}")
    with suppress(ValueError):  # rows of different lengths
        if np.shape(position)[1:] == (2,):
            if dim == 3:
                raise PackingError("dim: expected 2 for positions of two coordinates, found 3")
            flat: FloatArray = cast("position", position, np.float64, (None, 2))
            return np.column_stack([flat, np.zeros(len(flat))]), dim or 2
    return cast("position", position, np.float64, (None, 3)), dim or 3


def _wall_forces(listed: WallForces, position: FloatArray, cell: Cell | None) -> WallForces:
    """Check listed forces of walls, and move each point to the grain that it touches."""
    row = cast("wall_forces: row", listed.row, np.int64, (None,))
    point = cast("wall_forces: point", listed.point, np.float64, (len(row), 3))
    force = cast("wall_forces: force", listed.force, np.float64, (len(row), 3))
    if np.any((row < 0) | (row >= len(position))):
        raise PackingError(f"wall_forces: names a row that is none of {len(position)} grains")
    if not (np.isfinite(point).all() and np.isfinite(force).all()):
        raise PackingError("wall_forces: expected finite points and forces")
    if cell is not None and cell.is_periodic:
        point = point + cell.nearest_image(point - position[row]) @ cell.vectors
    return WallForces(row, point, force)


def check_lengths(position: FloatArray, radius: FloatArray, id: IntArray) -> None:
    """Raise a PackingError that names the first grain whose position or radius is no length."""
    if all_within(position, -MOST, MOST) and all_within(radius, LEAST, MOST):
        return
    finite = np.isfinite(position).all(axis=1) & np.isfinite(radius)
    odd = ~(np.abs(position) <= MOST).all(axis=1) | ~((radius >= LEAST) & (radius <= MOST))
    reasons = {
        "position and radius must be finite numbers": ~finite,
        "the radius must be larger than zero": radius <= 0,
        f"a radius below {LEAST:g} or a number above {MOST:g} cannot be a length": odd,
    }
    reason, wrong = next((reason, wrong) for reason, wrong in reasons.items() if wrong.any())
    first = int(np.argmax(wrong))
    place = ", ".join(f"{x:g}" for x in position[first])
    raise PackingError(
        f"{grains_named(id, wrong)}: {reason}, found radius {radius[first]:g} at ({place})"
    )


def spelt_some(id: IntArray) -> str:
    """The ids of the first grains of some, and how many more there are."""
    more = f" and {len(id) - MOST_NAMED} more" if len(id) > MOST_NAMED else ""
    return f"{counted(len(id), 'grain')} (id {', '.join(map(str, id[:MOST_NAMED]))}{more})"


def space_of(position: FloatArray) -> Space:
    """
    The plane in which centres lie, or all space.

    There is a plane if at least ten centres all share exactly one coordinate.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.packing.packing import space_of
    >>> line = np.arange(12.0)
    >>> space_of(np.column_stack([line, line**2, np.ones(12)]))
    Space: the plane x-y
    """
    if len(position) < FEWEST:
        return SPACE
    # in most packings the first centres show that no coordinate is shared
    few = np.flatnonzero((position[:FEWEST] == position[0]).all(axis=0))
    shared = [int(axis) for axis in few if np.all(position[:, axis] == position[0, axis])]
    return Space(shared[0]) if len(shared) == 1 else SPACE


def off_plane(position: FloatArray) -> tuple[Space, IntArray]:
    """
    The plane in which nearly all centres lie, and the rows of the few that lie off it.

    All space and no rows, unless at least 99 % of the centres, but not all, share exactly one
    coordinate.
    """
    off = position != np.median(position, axis=0)
    few = np.flatnonzero((off.mean(axis=0) <= OFF_PLANE) & off.any(axis=0))
    if len(position) < FEWEST or len(few) != 1 or not off.any(axis=0).all():
        return SPACE, np.zeros(0, np.int64)
    return Space(int(few[0])), np.flatnonzero(off[:, few[0]])


def flat_space(position: FloatArray, id: IntArray | None = None) -> Space:
    """
    The plane of discs; if centres share several coordinates, the last of them is constant.

    ``id`` names the grains in the error.

    Raises
    ------
    PackingError
        If they do not share a coordinate.
    """
    shared = np.flatnonzero((position == position[:1]).all(axis=0))
    if len(shared) == 0:
        plane, rows = off_plane(position)
        if len(rows):
            names = rows if id is None else id[rows]
            raise PackingError(
                f"the centres do not lie in one coordinate plane: all lie in {plane} but those of "
                f"{spelt_some(names)}: discs share one coordinate exactly; `dim=3` reads spheres"
            )
        extents = ", ".join(f"{edge:.4g}" for edge in np.ptp(position, axis=0))
        raise PackingError(
            f"the centres do not lie in one coordinate plane (their extents along x, y, z are "
            f"{extents}): discs share one coordinate exactly; `dim=3` reads spheres"
        )
    return Space(int(shared[-1]))


def spelt_plane(position: FloatArray, space: Space) -> str:
    """Spell the coordinate that some centres share, such as ``z = 0``."""
    assert space.across is not None
    return f"{'xyz'[space.across]} = {position[0, space.across]:g}"


def _refuse_twice(id: IntArray) -> None:
    ordered = np.sort(id)
    again = ordered[1:][ordered[1:] == ordered[:-1]]
    if again.size:
        raise PackingError(
            f"the id {again[0]} occurs twice: {len(id) - again.size} ids for {len(id)} grains"
        )


def _cell_in_plane(cell: Cell, space: Space) -> Cell:
    """
    The cell of discs, which does not repeat across their plane.

    Two of its vectors must lie in the plane, else PackingError. The third is turned to the normal.
    """
    leaving = np.flatnonzero(cell.vectors[:, space.across])
    if len(leaving) != 1:
        raise PackingError(
            f"the cell's vectors {cell.vectors.tolist()} do not fit discs in {space}: expected "
            f"two of them in the plane"
        )
    vectors, periodic = cell.vectors.copy(), list(cell.periodic)
    vectors[leaving[0]] *= space.normal
    periodic[leaving[0]] = False
    return Cell(vectors, (periodic[0], periodic[1], periodic[2]), cell.origin, space)
