"""Find positions, radii and ids among the columns of a dump, by the names of the columns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import AnyArray, Columns, FloatArray, IntArray
from scanfab.io.reader import GrainTable, ReadOptions
from scanfab.packing.bodies import CLUMP_COLUMNS, MOLECULE_COLUMNS
from scanfab.packing.cell import Cell

BODIES = "scanfab_bodies"
"""The column of this name numbers the body of each sphere, whatever other columns say."""
WALLS = "scanfab_wall_contacts"
"""The column of this name is each grain's number of contacts with walls."""

# upper and lower case are the same
RADIUS_NAMES = ("radius", "radii", "rad", "r", "f_radius")
DIAMETER_NAMES = ("diameter", "diam")
ID_NAMES = ("id", "ids", "particle_id", "particleid", "body_id", "bodyid")
# other likely names of a radius, such as c_rad and f_r[1]; messages suggest them
LIKE_A_RADIUS = re.compile(r"(?i)rad(i|$|[^a-z])|(^|_)r($|\[)")
# names of coordinates, best first, and whether they are fractions of the box
POSITION_NAMES = (("x y z", False), ("xu yu zu", False), ("xs ys zs", True), ("xsu ysu zsu", True))

# LIGGGHTS' half axes and exponents (and their older names): a superquadric is a sphere if all half
# axes equal its radius and all exponents equal 2, up to rounding to six digits
HALF_AXES, EXPONENTS = ("shapex", "shapey", "shapez"), ("blockiness1", "blockiness2")
OLD_EXPONENTS, SIX_DIGITS = ("roundness1", "roundness2"), 1e-5
# a grain this many radii of the largest grain away from 0 has a damaged coordinate, because
# rounding destroys its place
FAR = 1e12
# a diameter contradicts the radius if it differs from twice the radius by more than this fraction;
# smaller differences come from numbers with few digits
ROUNDED = 0.05
# doubles hold whole numbers below this exactly
EXACT = 2.0**53


def has_radius(names: Iterable[str]) -> bool:
    """Whether a column is named as a radius or a diameter."""
    lower = {name.lower() for name in names}
    return bool(lower & {*RADIUS_NAMES, *DIAMETER_NAMES})


def grain_table(
    path: Path, columns: Columns, cell: Cell | None, options: ReadOptions, where: str = ""
) -> GrainTable:
    """
    Make grains of the columns of a dump.

    Parameters
    ----------
    path : Path
        The file, for messages.
    columns : mapping of str to ndarray
        All columns by the dump's names, N rows each; coordinates may be a column ``position`` of
        shape (N, 3).
    cell : Cell, optional
        The dump's own cell.
    options : ReadOptions
        The user's names of columns, radius and cell.
    where : str, optional
        Follows the path in messages, for instance ``", step 100"``.

    Raises
    ------
    ReadError
        If coordinates or radii cannot be found.
    """
    here = f"{path}{where}"
    rest = _named_by_user(path, columns, options)
    cell = user_cell(path, cell, options)
    position = _position(here, rest, options, cell)
    radius = _radius(here, rest, options, len(position))
    _refuse_far(here, position, radius, cell)
    _refuse_superquadrics(here, rest, radius)
    position.flags.writeable = False  # so that the packing need not copy it
    id, bodies, walls = (
        None if name is None else whole_numbers(path, rest.pop(name), where)
        for name in (first_of(names, rest) for names in (ID_NAMES, [BODIES], [WALLS]))
    )
    return GrainTable(position, radius, id, rest, cell, wall_contacts=walls, bodies=bodies)


def user_cell(path: Path, cell: Cell | None, options: ReadOptions) -> Cell | None:
    """The cell of a frame: the user's options ``cell`` and ``periodic`` override the dump."""
    if options.beside is not None:
        cell = None if options.beside == "none" else options.beside
    along = options.periodic
    periodic = None if along is None else ("x" in along, "y" in along, "z" in along)
    if options.cell is not None:
        lx, ly, lz, xy, xz, yz = (*options.cell, 0.0, 0.0, 0.0)[:6]
        vectors = [[lx, 0, 0], [xy, ly, 0], [xz, yz, lz]]
        origin = np.zeros(3) if cell is None else cell.origin
        return Cell(vectors, periodic or (True, True, True), origin)
    if periodic is None:
        return cell
    if cell is None:
        lacks = f'`periodic="{along}"` needs a cell, and the dump has none'
        raise ReadError(f"{path}: {lacks}: give it with `cell=(LX, LY, LZ)`")
    return Cell(cell.vectors, periodic, cell.origin)


def _named_by_user(path: Path, columns: Columns, options: ReadOptions) -> dict[str, Any]:
    """All columns; those that the user named get their standard names."""
    rest, named = dict(columns), {}
    for standard, own in options.columns.items():
        if own not in rest:
            listed = f"the columns are {', '.join(rest)}"
            raise ReadError(f"{path}: there is no column {own!r} to serve as {standard}; {listed}")
        named[standard] = rest.pop(own)
    # if the file itself has a column of that standard name, it is another quantity: rename it
    return {name + "_of_dump" * (name in named): values for name, values in rest.items()} | named


def _position(
    where: str, rest: dict[str, Any], options: ReadOptions, cell: Cell | None
) -> FloatArray:
    """Remove the coordinates from the columns and return them, shape (N, 3)."""
    # a dump may also have a column "position" of single numbers
    if "position" in rest and np.ndim(rest["position"]) == 2:
        return _lengths(where, rest.pop("position"), "a coordinate")
    for names, scaled in POSITION_NAMES:
        pairs = zip(names.split(), "xyz", strict=True)
        wanted = [first_of([a if a in options.columns else name], rest) for name, a in pairs]
        if not all(wanted):
            continue
        coordinates = np.column_stack([rest.pop(name) for name in wanted if name])
        position = _lengths(where, coordinates, "a coordinate")
        if not scaled:
            return position
        if cell is None:
            raise ReadError(f"{where}: {names} are fractions of a box, but there is no box")
        # Packing refuses infinite results
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(cell.origin + position @ cell.vectors)
    names, advice = ", ".join(rest) or "none", '`columns={"x": ..., "y": ..., "z": ...}` names them'
    raise ReadError(f"{where}: no coordinates (x y z, xu yu zu, xs ys zs) in {names}; {advice}")


def _refuse_far(where: str, position: FloatArray, radius: FloatArray, cell: Cell | None) -> None:
    """ReadError if a grain is so far away that rounding destroys its place or size."""
    away = np.abs(position - (0.0 if cell is None else cell.origin)).max(axis=1, initial=0.0)
    # numbers that cannot be lengths are refused by Packing
    far = np.flatnonzero((away < MOST) & (away / FAR > radius.max(initial=0.0)))
    if len(far) and radius.max() > 0:
        found = f"grain {far[0] + 1} lies {away[far[0]]:g} from the origin"
        raise ReadError(f"{where}: {found}, too far away: is a number damaged?")


def _radius(where: str, rest: dict[str, Any], options: ReadOptions, count: int) -> FloatArray:
    """Remove radii or diameters from the columns and return radii; or the user's radius for all."""
    own = options.columns
    # if the user names only a radius or only a diameter, the other column is ignored
    sizes = own.keys() & {"radius", "diameter"} or {"radius", "diameter"}
    name = first_of(RADIUS_NAMES, rest) if "radius" in sizes else None
    other = first_of(DIAMETER_NAMES, rest) if "diameter" in sizes else None
    if options.radius is not None:
        if has_radius(rest):
            raise ReadError(f"{where}: `radius` is for dumps without radii, but this one has them")
        return np.full(count, options.radius)
    if name is not None:
        radius = _lengths(where, rest.pop(name), "a radius")
        row = None if other is None else other_size(radius, rest[other])
        if row is not None:
            names = own.get("radius", name), own.get("diameter", other)
            problem = f"the columns {names[0]!r} and {names[1]!r} contradict each other"
            advice = f'`columns={{"radius": "{names[0]}"}}` names one'
            raise ReadError(f"{where}: {problem} at grain {row + 1}: {advice}")
        return radius
    if other is not None:
        return 0.5 * _lengths(where, rest.pop(other), "a diameter")
    like = next((name for name in rest if LIKE_A_RADIUS.search(name)), "...")
    listed, doubt = ", ".join(rest) or "none", " (if that is one)" * (like != "...")
    advice = (
        f'name it with `columns={{"radius": "{like}"}}`{doubt} or `columns={{"diameter": "..."}}`'
    )
    found = f"no radius: expected radius or diameter, found {listed}"
    raise ReadError(f"{where}: {found}; {advice}, or give all grains a `radius`")


def other_size(radius: FloatArray, diameter: AnyArray) -> int | None:
    """
    Find the first grain whose diameter is not twice its radius, up to rounding.

    Parameters
    ----------
    radius : ndarray, shape (N,)
        Dump's length unit.
    diameter : ndarray
        A column that may hold diameters.

    Returns
    -------
    int or None
        The row of the grain; None if all agree, or if the column does not hold lengths.
    """
    if diameter.shape != radius.shape or diameter.dtype.kind not in "iuf":
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        differ = np.abs(2.0 * radius - diameter) > ROUNDED * 2.0 * radius
    return int(np.argmax(differ)) if differ.any() else None


def _refuse_superquadrics(where: str, rest: Columns, radius: FloatArray) -> None:
    """ReadError if particles are superquadrics: their radius is that of an enclosing sphere."""
    expected = dict.fromkeys(HALF_AXES, radius) | dict.fromkeys((*EXPONENTS, *OLD_EXPONENTS), 2.0)
    for name in [name for name in rest if name.lower() in expected]:
        value = expected[name.lower()]
        count = np.count_nonzero(np.abs(rest[name] - value) > SIX_DIGITS * np.abs(value))
        if count:
            problem = f"{count} of {len(radius)} particles are superquadrics (by the column {name})"
            raise ReadError(f"{where}: {problem}: fill them with spheres, joined by `bodies`")


def first_of(known: Sequence[str], names: Iterable[str]) -> str | None:
    """The first of the known names that is among ``names``, ignoring case; None if none is."""
    lower = {name.lower(): name for name in reversed([*names])} | {name: name for name in names}
    return next((lower[name] for name in known if name in lower), None)


def whole_numbers(path: Path, values: npt.ArrayLike, where: str = "") -> npt.NDArray[np.int64]:
    """Ids as int64; ReadError if they are not whole numbers."""
    numbers = np.asarray(values)
    is_whole = numbers.ndim == 1 and numbers.dtype.kind in "biuf"
    if is_whole and numbers.dtype.kind in "uf":
        # larger floats may have been rounded; comparisons with NaN are False
        most = EXACT if numbers.dtype.kind == "f" else 2.0**63
        is_whole = bool(np.all((np.abs(numbers) < most) & (numbers == np.rint(numbers))))
    if not is_whole:
        expected = "ids must be whole numbers, and below 2^53 if the file has them as decimals"
        raise ReadError(f"{path}{where}: {expected}")
    whole = numbers.astype(np.int64, copy=False)
    whole.flags.writeable = False  # so that the packing need not copy it
    return whole


def _lengths(where: str, values: npt.ArrayLike, what: str) -> FloatArray:
    """Numbers as doubles; Packing checks later whether they are possible lengths."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ReadError(f"{where}: expected numbers for {what}, found {array.dtype}")
    return doubles(array)


def body_numbers(path: Path, grains: GrainTable, named: str | None) -> IntArray | None:
    """
    Number the rigid body (clump) to which each sphere belongs.

    Parameters
    ----------
    path : Path
        The file, for messages.
    grains : GrainTable
        The spheres of one frame.
    named : str, optional
        The column with the numbers; ``id`` makes each sphere a grain. By default a column with a
        usual name for clumps. A column of molecules must be named, because molecules may be bonded
        spheres that move relative to each other.

    Returns
    -------
    ndarray of int, shape (N,), or None
        Negative for a sphere that is a grain of its own; None if all spheres are.

    Raises
    ------
    ReadError
        If there is no such column, or it does not hold whole numbers.
    """
    columns, name = grains.columns, named
    if named is None:
        if grains.bodies is not None:
            return grains.bodies
        name = first_of(CLUMP_COLUMNS, columns)
    # an empty frame may lack the column; `id` makes each sphere a grain, even if there are no ids
    if name is None or not len(grains.radius) or (name == "id" and name not in columns):
        return None
    if name not in columns:
        listed = ", ".join(["id", *columns])
        raise ReadError(f"{path}: `bodies`: there is no column {name!r}; the columns are {listed}")
    numbers = whole_numbers(path, columns[name], f": `bodies`: the column {name}")
    return np.where(numbers > 0, numbers, -1) if name.lower() in MOLECULE_COLUMNS else numbers
