"""From the columns of a dump, by name, to positions, radii and ids."""

from __future__ import annotations

import re
from collections.abc import Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import all_within, doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.reader import BODIES, WALLS, GrainTable, ReadOptions
from scanfab.io.sizes import refuse_other_size
from scanfab.packing.cell import Cell
from scanfab.packing.packing import lies_within

Columns = Mapping[str, npt.NDArray[Any]]

# names are compared without regard to case
RADIUS_NAMES = ("radius", "radii", "rad", "r", "f_radius")
DIAMETER_NAMES = ("diameter", "diam")
ID_NAMES = ("id", "ids", "particle_id", "particleid", "body_id", "bodyid")
# other names that a radius may have, such as c_rad and f_r[1]
LIKE_A_RADIUS = re.compile(r"(?i)rad(i|$|[^a-z])|(^|_)r($|\[)")
ANGLES = ("theta", "phi", "azimuth")
# coordinates in the order of preference, and whether they are fractions of the box
POSITION_NAMES = (("x y z", False), ("xu yu zu", False), ("xs ys zs", True), ("xsu ysu zsu", True))

# LIGGGHTS' half axes and exponents (and their older names): a superquadric is a sphere if all half
# axes are its radius and the exponents 2, within the rounding of six digits
HALF_AXES, EXPONENTS = ("shapex", "shapey", "shapez"), ("blockiness1", "blockiness2")
OLD_EXPONENTS, SIX_DIGITS = ("roundness1", "roundness2"), 1e-5
# no grain is further from a periodic cell, in cells
MOST_TURNS = 1e9
# without a cell, no grain is so many times as far away as the others, where there are some
FAR, FEW = 1e12, 10
# whole numbers below 2^53 are exact as decimals
MOST_DECIMAL = 2.0**53 - 1.0


def has_radius(names: Sequence[str]) -> bool:
    """Whether some column is a radius or a diameter."""
    lower = {name.lower() for name in names}
    return bool(lower & {*RADIUS_NAMES, *DIAMETER_NAMES})


def grain_table(
    path: Path, columns: Columns, cell: Cell | None, options: ReadOptions, where: str = ""
) -> GrainTable:
    """
    Sort out which column is what.

    Parameters
    ----------
    path : Path
        For messages.
    columns : mapping of str to ndarray
        All columns by the dump's names, N rows each; coordinates may be a column ``position`` of
        shape (N, 3).
    cell : Cell, optional
        From the dump.
    options : ReadOptions
        Names, radius and cell from the user.
    where : str, optional
        For messages, such as ``", step 100"``.

    Raises
    ------
    ReadError
        If coordinates or radii cannot be found.
    """
    rest = dict(columns)
    named = _named_by_user(path, rest, options)
    cell = user_cell(path, cell, options)
    position = _position(path, rest, named, cell, where)
    radius = _radius(path, rest, named, len(position), options, where)
    _refuse_far(path, position, radius, cell, where)
    position.flags.writeable = False  # so that the packing need not copy it
    id = named.get("id", _take(rest, ID_NAMES))
    _refuse_superquadrics(path, rest, radius, where)
    bodies, walls = (
        whole_numbers(path, rest.pop(name), where) if name in rest else None
        for name in (BODIES, WALLS)
    )
    id = None if id is None else whole_numbers(path, id, where)
    return GrainTable(position, radius, id, rest, cell, wall_contacts=walls, bodies=bodies)


def user_cell(path: Path, cell: Cell | None, options: ReadOptions) -> Cell | None:
    """The dump's cell with the user's cell and periodic on top."""
    if options.beside is not None:
        cell = None if options.beside == "none" else options.beside
    asked = options.periodic
    periodic = None if asked is None else ("x" in asked, "y" in asked, "z" in asked)
    if options.cell is not None:
        lx, ly, lz, xy, xz, yz = (*options.cell, 0.0, 0.0, 0.0)[:6]
        vectors = [[lx, 0, 0], [xy, ly, 0], [xz, yz, lz]]
        origin = np.zeros(3) if cell is None else cell.origin
        return Cell(vectors, periodic or (True, True, True), origin)
    if periodic is None:
        return cell
    if cell is None:
        raise ReadError(
            f'{path}: `periodic="{asked}"` was asked for, but the dump names no cell: give it with '
            f"`cell=(LX, LY, LZ)`"
        )
    return Cell(cell.vectors, periodic, cell.origin)


def refuse_named_twice(path: Path, named: Mapping[str, str], option: str) -> None:
    """
    One column serves as one thing.

    Parameters
    ----------
    path : Path
        For messages.
    named : mapping of str to str
        What the user says: the file's own name or number of each column, by what it is.
    option : str
        The argument by which the user says it.

    Raises
    ------
    ReadError
        If two of them are the same column.
    """
    places: dict[str, str] = {}
    for standard, own in named.items():
        if own in places:
            raise ReadError(
                f"{path}: the column {own!r} is named twice in `{option}`, as {places[own]} and as "
                f"{standard}: expected one column for each"
            )
        places[own] = standard


def _named_by_user(
    path: Path, rest: MutableMapping[str, Any], options: ReadOptions
) -> dict[str, Any]:
    """Columns that the user named, taken out of the rest."""
    named = {}
    refuse_named_twice(path, options.columns, "columns")
    for standard, own in options.columns.items():
        if own not in rest:
            raise ReadError(
                f"{path}: there is no column {own!r} to serve as {standard}; "
                f"the columns are {', '.join(rest)}"
            )
        named[standard] = rest.pop(own)
    for standard in [name for name in named if name not in ("x", "y", "z", "id", "radius")]:
        rest[standard] = named.pop(standard)
    return named


def _position(
    path: Path, rest: MutableMapping[str, Any], named: dict[str, Any], cell: Cell | None, where: str
) -> FloatArray:
    # a column of a dump may have that name, too
    if "position" in rest and np.ndim(rest["position"]) == 2:
        return _lengths(path, rest.pop("position"), "a coordinate", where)
    for names, scaled in POSITION_NAMES:
        found = [
            named[axis] if axis in named else _take(rest, (name,), keep=True)
            for name, axis in zip(names.split(), "xyz", strict=True)
        ]
        if any(column is None for column in found):
            continue
        for name in names.split():
            _take(rest, (name,))
        position = _lengths(path, np.column_stack(found), "a coordinate", where)
        if not scaled:
            return position
        if cell is None:
            raise ReadError(f"{path}{where}: {names} are fractions of a box, but there is no box")
        # what is not finite is the packing's to refuse
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(cell.origin + position @ cell.vectors)
    raise ReadError(
        f"{path}{where}: no coordinates: expected the columns x y z (or xu yu zu, xs ys zs), "
        f"found {', '.join(rest) or 'none'}; name them with "
        f'`columns={{"x": ..., "y": ..., "z": ...}}`'
    )


@np.errstate(over="ignore", invalid="ignore")
def _refuse_far(
    path: Path, position: FloatArray, radius: FloatArray, cell: Cell | None, where: str
) -> None:
    """ReadError if a grain is so far away that rounding leaves nothing of its place or size."""
    if cell is not None:
        if lies_within(cell, position, -MOST_TURNS, MOST_TURNS):
            return
        turns = np.abs(cell.fractional(position[np.isfinite(position).all(axis=1)]))
        if np.any(turns > MOST_TURNS):
            raise ReadError(
                f"{path}{where}: a grain is {turns.max():g} cells away from the cell: has the cell "
                f"the unit of the coordinates?"
            )
        return
    place = np.abs(position).max(axis=1)
    if len(radius) < FEW or not np.all(np.isfinite(place)):
        return
    row = int(np.argmax(place))
    if place[row] > FAR * max(radius.max(), np.median(place)):
        raise ReadError(
            f"{path}{where}: grain {row + 1} has a coordinate of {place[row]:g}, {FAR:g} times as "
            f"far as other grains: is the number damaged?"
        )


def _radius(
    path: Path,
    rest: MutableMapping[str, Any],
    named: dict[str, Any],
    count: int,
    options: ReadOptions,
    where: str,
) -> FloatArray:
    if options.radius is not None:
        if "radius" in named or has_radius(list(rest)):
            raise ReadError(
                f"{path}{where}: `radius` is for dumps without radii, but this one has them: "
                f"leave it out"
            )
        return np.full(count, options.radius)
    own = options.columns
    if "radius" in named:
        radius = _lengths(path, named["radius"], "a radius", where)
        if "diameter" in own:
            pair = own["radius"], own["diameter"]
            refuse_other_size(path, radius, rest["diameter"], pair, where)
        return radius
    if "diameter" in own:
        return 0.5 * _lengths(path, rest.pop("diameter"), "a diameter", where)
    name = _first_of(RADIUS_NAMES, list(rest))
    if name is not None:
        refuse_cylindrical(path, name, list(rest), where)
        radius = _lengths(path, rest.pop(name), "a radius", where)
        other = _first_of(DIAMETER_NAMES, list(rest))
        if other is not None:
            refuse_other_size(path, radius, rest[other], (name, other), where)
        return radius
    diameter = _take(rest, DIAMETER_NAMES)
    if diameter is not None:
        return 0.5 * _lengths(path, diameter, "a diameter", where)
    like = next((name for name in rest if LIKE_A_RADIUS.search(name)), "...")
    raise ReadError(
        f"{path}{where}: no radius: expected a column radius (or diameter), found "
        f'{", ".join(rest) or "none"}; name it with `columns={{"radius": "{like}"}}`'
        f"{'' if like == '...' else ' (if that is one)'}, or give one radius for all grains with "
        f"`radius`"
    )


def _refuse_superquadrics(path: Path, rest: Columns, radius: FloatArray, where: str) -> None:
    """ReadError if some particles are no spheres: their radius is that of a sphere around them."""
    expected = dict.fromkeys(HALF_AXES, radius) | dict.fromkeys((*EXPONENTS, *OLD_EXPONENTS), 2.0)
    for name in [name for name in rest if name.lower() in expected]:
        value = expected[name.lower()]
        count = np.count_nonzero(np.abs(rest[name] - value) > SIX_DIGITS * np.abs(value))
        if count:
            raise ReadError(
                f"{path}{where}: {count} of {len(radius)} particles are superquadrics (by the "
                f"column {name}), whose radius is that of the sphere around them: scanfab measures "
                f"spheres, and clumps of spheres; fill them with spheres, and say with `bodies` "
                f"which of these are one particle"
            )


def refuse_cylindrical(path: Path, name: str, names: Sequence[str], where: str = "") -> None:
    """ReadError for an r that stands beside an angle: it may be the distance from an axis."""
    angle = _first_of(ANGLES, names)
    if name.lower() == "r" and angle is not None:
        raise ReadError(
            f"{path}{where}: the column {name} may be a radius of grains or, beside {angle}, the "
            f'distance from an axis: say which column is the radius, by `columns={{"radius": ...}}`'
        )


def _take(rest: MutableMapping[str, Any], names: Sequence[str], keep: bool = False) -> Any:
    """The first column that has one of the names; taken out of the rest unless kept."""
    found = _first_of(names, list(rest))
    if found is None:
        return None
    return rest[found] if keep else rest.pop(found)


def _first_of(known: Sequence[str], names: Sequence[str]) -> str | None:
    """The first name that is one of those known, in the order of these."""
    lower = {name.lower(): name for name in reversed(names)}
    return next((lower[name] for name in known if name in lower), None)


def whole_numbers(path: Path, values: npt.ArrayLike, where: str = "") -> npt.NDArray[np.int64]:
    """Ids as whole numbers; ReadError if they are not."""
    numbers = np.asarray(values)
    if numbers.ndim != 1 or not _are_whole(numbers):
        raise ReadError(
            f"{path}{where}: ids must be whole numbers, below 2^53 where they are read as decimals"
        )
    whole = numbers.astype(np.int64, copy=False)
    whole.flags.writeable = False  # so that the packing need not copy it
    return whole


def _are_whole(numbers: npt.NDArray[Any]) -> bool:
    if numbers.dtype == np.int64 or numbers.size == 0:
        return True
    # larger decimals may have been rounded; comparisons with NaN are false
    if numbers.dtype.kind == "f" and not all_within(numbers, -MOST_DECIMAL, MOST_DECIMAL):
        return False
    return numbers.dtype.kind in "biuf" and bool(np.all(numbers == numbers.astype(np.int64)))


def _lengths(path: Path, values: npt.ArrayLike, what: str, where: str) -> FloatArray:
    """Numbers that may be lengths; which of them cannot be is the packing's to say."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ReadError(f"{path}{where}: expected numbers for {what}, found {array.dtype}")
    return doubles(array)
