"""The common table: the grains and contacts of one frame, cast and checked once, here."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.cell import Cell
from scanfab.errors import PackingError, ScanfabWarning

__all__ = ["ContactList", "Contacts", "LazyColumns", "Packing", "lies_within"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
ContactSource = Literal["file", "geometric"]


class ContactList(NamedTuple):
    """Contacts as a source names them, before the packing works out their geometry."""

    pairs: npt.ArrayLike
    """Rows of the two grains, shape (M, 2)."""
    image: npt.ArrayLike | None = None
    """Lattice translation of the second grain, shape (M, 3); nearest image by default."""
    force: npt.ArrayLike | None = None
    """Force on the second grain, shape (M, 3), dump's force unit."""
    source: ContactSource = "file"
    """Where the list comes from."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """
    The contacts of a packing, each pair of grains (with its periodic image) once.

    The normal is the unit branch vector from the first to the second centre; the point is the
    middle of the overlap on the branch. Both come from positions and radii, whatever the file
    stores, so that every format gives the same answer.
    """

    pairs: IntArray
    """Rows of the two grains, shape (M, 2)."""
    image: IntArray
    """Lattice translation of the second grain, shape (M, 3)."""
    normal: FloatArray
    """Unit normals, shape (M, 3), dimensionless."""
    point: FloatArray
    """Contact points, shape (M, 3), dump's length unit; next to the first grain."""
    force: FloatArray | None
    """Force on the second grain, shape (M, 3), dump's force unit; None if the dump has none."""
    source: ContactSource
    """``file`` or ``geometric``."""

    def __len__(self) -> int:
        return len(self.pairs)


class LazyColumns(MutableMapping[str, npt.NDArray[Any]]):
    """
    Columns of a large dump by name, each read when it is first asked for.

    Parameters
    ----------
    names : sequence of str
        All of them, in the order of the dump.
    ready : mapping of str to ndarray
        Those that have been read.
    load : callable
        Reads a column by its name.
    """

    def __init__(
        self,
        names: Sequence[str],
        ready: Mapping[str, npt.NDArray[Any]],
        load: Callable[[str], npt.NDArray[Any]],
    ) -> None:
        self._found: dict[str, npt.NDArray[Any] | None] = dict.fromkeys(names)
        self._load = load
        for name, values in ready.items():
            self[name] = values

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        values = self._found[name]
        if values is None:
            values = self._load(name)
            self[name] = values
        return values

    def __setitem__(self, name: str, values: npt.NDArray[Any]) -> None:
        values.flags.writeable = False
        self._found[name] = values

    def __delitem__(self, name: str) -> None:
        del self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def copy(self) -> LazyColumns:
        """Another mapping to the same arrays."""
        ready = {name: values for name, values in self._found.items() if values is not None}
        return LazyColumns(list(self), ready, self._load)


def lies_within(cell: Cell, position: FloatArray, low: float, high: float) -> bool:
    """
    Whether all positions surely have low <= fraction < high along the cell's periodic vectors.

    The fractions are linear, so the corners of the box around the positions settle it. False if
    only those lie outside, or if a position is not a number.
    """
    if not cell.is_periodic or len(position) == 0:
        return True
    sides = [(column.min(), column.max()) for column in position.T]
    fractions = cell.fractional(list(product(*sides)))[:, list(cell.periodic)]
    return bool(np.all((fractions >= low) & (fractions < high)))


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
        centres = _cast("position", position, np.float64, (None, 3))
        count = len(centres)
        radii = np.asarray(radius)
        self.radius: FloatArray = _cast(
            "radius", np.full(count, radii) if radii.ndim == 0 else radii, np.float64, (count,)
        )
        self.id: IntArray = _cast("id", np.arange(count) if id is None else id, np.int64, (count,))
        _check_grains(centres, self.radius, self.id)
        inside = cell is None or lies_within(cell, centres, 0.0, 1.0)
        self.position: FloatArray = centres if cell is None or inside else cell.wrap(centres)
        self.position.flags.writeable = False
        self.columns: Mapping[str, npt.NDArray[Any]] = (
            columns if isinstance(columns, LazyColumns) else _cast_columns(columns or {}, count)
        )
        if wall_contacts is None:
            wall_contacts = np.zeros(count, np.int64)
            wall_contacts.flags.writeable = False
        self.wall_contacts: IntArray = _cast("wall_contacts", wall_contacts, np.int64, (count,))
        self.cell = cell
        self.step = None if step is None else int(step)
        self.time = None if time is None else float(time)
        if np.any(self.wall_contacts < 0):
            raise PackingError("wall_contacts: expected 0 or more for each grain")
        self.contacts: Contacts | None = None
        if contacts is not None:
            listed = contacts if isinstance(contacts, ContactList) else ContactList(contacts)
            self.contacts = self._resolve(listed)

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
        self, contacts: ContactList, wall_contacts: npt.ArrayLike | None = None
    ) -> Packing:
        """The same grains with another list of contacts."""
        return Packing(
            self.position,
            self.radius,
            id=self.id,
            columns=self.columns,
            contacts=contacts,
            wall_contacts=self.wall_contacts if wall_contacts is None else wall_contacts,
            cell=self.cell,
            step=self.step,
            time=self.time,
        )

    def _resolve(self, listed: ContactList) -> Contacts:
        """Geometry of the listed contacts, each pair and image once."""
        pairs = _cast("contacts", listed.pairs, np.int64, (None, 2))
        if pairs.size and (pairs.min() < 0 or pairs.max() >= len(self)):
            wrong = int(np.flatnonzero(np.any((pairs < 0) | (pairs >= len(self)), axis=1))[0])
            raise PackingError(
                f"contact {wrong} names the rows {pairs[wrong].tolist()}, "
                f"but there are {len(self)} grains (rows from 0)"
            )
        first, second = pairs.T
        branch = self.position[second] - self.position[first]
        if listed.image is not None:
            image = _cast("image", listed.image, np.int64, (len(pairs), 3))
        elif self.cell is not None and self.cell.is_periodic:
            image = self.cell.nearest_image(branch)
        else:
            image = np.zeros((len(pairs), 3), np.int64)
        if self.cell is not None:
            branch = branch + image @ self.cell.vectors
        keep = _first_of_each(pairs, image)
        force = None
        if listed.force is not None:
            force = _cast("force", listed.force, np.float64, (len(pairs), 3))[keep]
        pairs, image, branch = pairs[keep], image[keep], branch[keep]
        length: FloatArray = np.linalg.norm(branch, axis=1)
        itself = (pairs[:, 0] == pairs[:, 1]) & ~image.any(axis=1)
        if np.any(itself):
            raise PackingError(f"{_grains(self.id[pairs[:, 0]], itself)}: in contact with itself")
        if np.any(length == 0):
            self._warn_of_same_centre(pairs[length == 0])
            some = length > 0
            pairs, image, branch, length = pairs[some], image[some], branch[some], length[some]
            force = None if force is None else force[some]
        if listed.source == "file":
            self._refuse_long_contacts(pairs, length)
        normal = branch / length[:, None]
        radius = self.radius[pairs]
        middle = 0.5 * (length + radius[:, 0] - radius[:, 1])
        point = self.position[pairs[:, 0]] + middle[:, None] * normal
        return Contacts(pairs, image, normal, point, force, listed.source)

    def _warn_of_same_centre(self, pairs: IntArray) -> None:
        one, two = self.id[pairs[0]]
        warnings.warn(
            f"the grains {one} and {two} have the same centre ({len(pairs)} such pairs): a contact "
            f"between them has no direction and is left out",
            ScanfabWarning,
            stacklevel=4,
        )

    def _refuse_long_contacts(self, pairs: IntArray, length: FloatArray) -> None:
        """An error if the centres of a listed contact are too far apart for a contact."""
        radius = self.radius[pairs]
        # a gap of half a grain, by the smaller of the two
        excess = length - radius.sum(axis=1) - radius.min(axis=1)
        if np.any(excess > 0):
            worst = int(np.argmax(excess))
            one, two = self.id[pairs[worst]]
            advice = (
                "is this the contact list of another step?"
                if self.is_periodic
                else "if the sample is periodic, name its cell (--cell and --periodic); "
                "otherwise the contact list belongs to another step"
            )
            raise PackingError(
                f"the grains {one} and {two} are listed as a contact, but their centres are "
                f"{length[worst]:g} apart and their radii add up to {radius[worst].sum():g}: "
                f"{advice}"
            )


def _cast(
    name: str, values: npt.ArrayLike, dtype: type | None, shape: tuple[Any, ...]
) -> npt.NDArray[Any]:
    """An array of the given type and shape (None: any length; ...: any further dimensions)."""
    try:
        array = np.asarray(values)
        if array.size == 0 and shape[0] is None:
            array = np.zeros((0, *shape[1:]))  # an empty list
        # nobody can change an array that is read-only and no view of another
        shared = array.flags.owndata and not array.flags.writeable
        cast = array.astype(array.dtype if dtype is None else dtype, copy=not shared)
    except (TypeError, ValueError) as error:
        raise PackingError(f"{name}: expected numbers of shape {_spell(shape)}: {error}") from None
    wanted = shape[:-1] if shape[-1] is ... else shape
    fits = len(cast.shape) >= len(wanted) if shape[-1] is ... else len(cast.shape) == len(wanted)
    lengths = zip(cast.shape, wanted, strict=False)
    if not fits or any(want is not None and have != want for have, want in lengths):
        raise PackingError(f"{name}: expected shape {_spell(shape)}, found {cast.shape}")
    if dtype is np.int64 and array.dtype.kind == "f" and not np.array_equal(array, cast):
        raise PackingError(f"{name}: expected whole numbers")
    cast.flags.writeable = False
    return cast


def _cast_columns(columns: Mapping[str, npt.ArrayLike], count: int) -> dict[str, npt.NDArray[Any]]:
    return {name: _cast(name, values, None, (count, ...)) for name, values in columns.items()}


def _spell(shape: tuple[Any, ...]) -> str:
    return "(" + ", ".join("N" if n is None else "..." if n is ... else str(n) for n in shape) + ")"


def _check_grains(position: FloatArray, radius: FloatArray, id: IntArray) -> None:
    """Finite numbers, positive radii, unique ids."""
    if not (np.isfinite(position).all() and np.isfinite(radius).all()):
        infinite = ~(np.isfinite(position).all(axis=1) & np.isfinite(radius))
        raise PackingError(f"{_grains(id, infinite)}: position and radius must be finite numbers")
    if np.any(radius <= 0):
        raise PackingError(f"{_grains(id, radius <= 0)}: the radius must be larger than zero")
    if not _are_unique(id):
        unique, counts = np.unique(id, return_counts=True)
        raise PackingError(
            f"the id {unique[np.argmax(counts > 1)]} occurs twice: "
            f"{unique.size} ids for {id.size} grains"
        )


def _are_unique(id: IntArray) -> bool:
    """Whether no number occurs twice; without sorting if they lie close together, as ids do."""
    if id.size == 0:
        return True
    low, high = int(id.min()), int(id.max())
    if high - low >= 8 * id.size:
        return bool(np.unique(id).size == id.size)
    seen = np.zeros(high - low + 1, np.bool_)
    seen[id - low] = True
    return bool(np.count_nonzero(seen) == id.size)


def _grains(id: IntArray, wrong: npt.NDArray[np.bool_]) -> str:
    """'grain 7' or '3 grains, first 7'."""
    first = id[np.argmax(wrong)]
    number = np.count_nonzero(wrong)
    return f"grain {first}" if number == 1 else f"{number} grains, the first is {first}"


def _first_of_each(pairs: IntArray, image: IntArray) -> npt.NDArray[np.intp]:
    """Rows of the first mention of each contact, whichever grain is named first."""
    swapped = pairs[:, 0] > pairs[:, 1]
    turned = np.where(swapped[:, None], -image, image)
    # a grain and its own image: the contact with the opposite image is the same one
    itself = pairs[:, 0] == pairs[:, 1]
    lead = np.where(turned[:, 0] != 0, turned[:, 0], turned[:, 1])
    lead = np.where(lead != 0, lead, turned[:, 2])
    turned = np.where((itself & (lead < 0))[:, None], -turned, turned)
    # one number for each contact: rows, then image
    reach = int(np.abs(turned).max(initial=0))
    code = (turned + reach) @ (2 * reach + 1) ** np.arange(3)
    key = (pairs.min(axis=1) * (pairs.max(initial=0) + 1) + pairs.max(axis=1)) * (
        2 * reach + 1
    ) ** 3 + code
    _, first = np.unique(key, return_index=True)
    return np.sort(first)
