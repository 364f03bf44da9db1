"""From the columns of a dump, by name, to positions, radii and ids."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
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
"""A column of this name is the number of each sphere's body, whatever other columns say."""
WALLS = "scanfab_wall_contacts"
"""A column of this name is the number of contacts with walls of each grain."""

# names are compared without regard to case
RADIUS_NAMES = ("radius", "radii", "rad", "r", "f_radius")
DIAMETER_NAMES = ("diameter", "diam")
ID_NAMES = ("id", "ids", "particle_id", "particleid", "body_id", "bodyid")
# other names that a radius may have, such as c_rad and f_r[1]
LIKE_A_RADIUS = re.compile(r"(?i)rad(i|$|[^a-z])|(^|_)r($|\[)")
# coordinates in the order of preference, and whether they are fractions of the box
POSITION_NAMES = (("x y z", False), ("xu yu zu", False), ("xs ys zs", True), ("xsu ysu zsu", True))

# LIGGGHTS' half axes and exponents (and their older names): a superquadric is a sphere if all half
# axes are its radius and the exponents 2, within the rounding of six digits
HALF_AXES, EXPONENTS = ("shapex", "shapey", "shapez"), ("blockiness1", "blockiness2")
OLD_EXPONENTS, SIX_DIGITS = ("roundness1", "roundness2"), 1e-5
# a number is damaged if a grain lies this many periodic cells from the cell's origin, or without a
# cell this many times as far from 0 as the others: rounding would leave nothing of its place
FAR = 1e12
# a diameter that differs from twice the radius by more than this share of it is another size:
# numbers of few digits are rounded
ROUNDED = 0.05
# whole numbers below this are exact as decimals
EXACT = 2.0**53


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
        lacks = f'`periodic="{asked}"` needs a cell, which the dump does not name'
        raise ReadError(f"{path}: {lacks}: give it with `cell=(LX, LY, LZ)`")
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
    serves: dict[str, str] = {}
    for standard, own in named.items():
        if serves.setdefault(own, standard) != standard:
            both = f"as {serves[own]} and as {standard}"
            raise ReadError(f"{path}: the column {own!r} is named twice in `{option}`, {both}")


def _named_by_user(path: Path, columns: Columns, options: ReadOptions) -> dict[str, Any]:
    """All columns, those that the user named by their standard names."""
    refuse_named_twice(path, options.columns, "columns")
    rest, named = dict(columns), {}
    for standard, own in options.columns.items():
        if own not in rest:
            there = f"the columns are {', '.join(rest)}"
            raise ReadError(f"{path}: there is no column {own!r} to serve as {standard}; {there}")
        named[standard] = rest.pop(own)
    # a column of the file that has such a standard name already is something else
    return {name + "_of_dump" * (name in named): one for name, one in rest.items()} | named


def _position(
    where: str, rest: dict[str, Any], options: ReadOptions, cell: Cell | None
) -> FloatArray:
    """Take the coordinates out of the columns."""
    # a dump may have a column of single numbers called position, too
    if "position" in rest and np.ndim(rest["position"]) == 2:
        return _lengths(where, rest.pop("position"), "a coordinate")
    for names, scaled in POSITION_NAMES:
        known = zip(names.split(), "xyz", strict=True)
        wanted = [first_of([a if a in options.columns else name], rest) for name, a in known]
        if not all(wanted):
            continue
        found = np.column_stack([rest.pop(name) for name in wanted if name])
        position = _lengths(where, found, "a coordinate")
        if not scaled:
            return position
        if cell is None:
            raise ReadError(f"{where}: {names} are fractions of a box, but there is no box")
        # Packing refuses numbers that are not finite
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(cell.origin + position @ cell.vectors)
    there, advice = ", ".join(rest) or "none", '`columns={"x": ..., "y": ..., "z": ...}` names them'
    raise ReadError(f"{where}: no coordinates (x y z, xu yu zu, xs ys zs) in {there}; {advice}")


@np.errstate(over="ignore", invalid="ignore")
def _refuse_far(where: str, position: FloatArray, radius: FloatArray, cell: Cell | None) -> None:
    """ReadError if a grain is so far away that rounding leaves nothing of its place or size."""
    periodic = cell if cell is not None and cell.is_periodic else None
    if not len(radius):
        return
    away = np.abs(position - (0.0 if periodic is None else periodic.origin)).max(axis=1)
    size = np.median(away) if periodic is None else np.abs(periodic.vectors).max()
    # Packing refuses numbers that cannot be lengths
    far = np.flatnonzero((away < MOST) & (away > FAR * max(radius.max(), size)))
    if len(far):
        found = f"grain {far[0] + 1} lies {away[far[0]]:g} from the origin"
        raise ReadError(f"{where}: {found}, too far away: is a number damaged?")


def _radius(where: str, rest: dict[str, Any], options: ReadOptions, count: int) -> FloatArray:
    """Take the radii out of the columns, or half the diameters; or the user's for all."""
    own = options.columns
    # if the user names one size, the other column is not compared with it
    sizes = own.keys() & {"radius", "diameter"} or {"radius", "diameter"}
    name = first_of(RADIUS_NAMES, rest) if "radius" in sizes else None
    other = first_of(DIAMETER_NAMES, rest) if "diameter" in sizes else None
    if options.radius is not None:
        if has_radius(list(rest)):
            raise ReadError(f"{where}: `radius` is for dumps without radii, but this one has them")
        return np.full(count, options.radius)
    if name is not None:
        radius = _lengths(where, rest.pop(name), "a radius")
        row = None if other is None else other_size(radius, rest[other])
        if row is not None:
            names = own.get("radius", name), own.get("diameter", other)
            told = f"the columns {names[0]!r} and {names[1]!r} contradict each other"
            advice = f'`columns={{"radius": "{names[0]}"}}` names one'
            raise ReadError(f"{where}: {told} at grain {row + 1}: {advice}")
        return radius
    if other is not None:
        return 0.5 * _lengths(where, rest.pop(other), "a diameter")
    like = next((name for name in rest if LIKE_A_RADIUS.search(name)), "...")
    found, doubt = ", ".join(rest) or "none", " (if that is one)" * (like != "...")
    advice = f'name it with `columns={{"radius": "{like}"}}`{doubt}, or give all grains a `radius`'
    raise ReadError(f"{where}: no radius: expected radius or diameter, found {found}; {advice}")


def other_size(radius: FloatArray, diameter: AnyArray) -> int | None:
    """
    The first grain whose diameter is not twice its radius, as nearly as numbers are printed.

    Parameters
    ----------
    radius : ndarray, shape (N,)
        Dump's length unit.
    diameter : ndarray
        A column that may be one of diameters.

    Returns
    -------
    int or None
        Its row; None if all agree, or the column is none of lengths.
    """
    if diameter.shape != radius.shape or diameter.dtype.kind not in "iuf":
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        differ = np.abs(2.0 * radius - diameter) > ROUNDED * 2.0 * radius
    return int(np.argmax(differ)) if differ.any() else None


def _refuse_superquadrics(where: str, rest: Columns, radius: FloatArray) -> None:
    """ReadError if some particles are no spheres: their radius is that of a sphere around them."""
    expected = dict.fromkeys(HALF_AXES, radius) | dict.fromkeys((*EXPONENTS, *OLD_EXPONENTS), 2.0)
    for name in [name for name in rest if name.lower() in expected]:
        value = expected[name.lower()]
        count = np.count_nonzero(np.abs(rest[name] - value) > SIX_DIGITS * np.abs(value))
        if count:
            told = f"{count} of {len(radius)} particles are superquadrics (by the column {name})"
            raise ReadError(f"{where}: {told}: fill them with spheres, to be joined by `bodies`")


def first_of(known: Sequence[str], names: Iterable[str]) -> str | None:
    """The first name that is one of those known, in the order of these; without regard to case."""
    lower = {name.lower(): name for name in reversed([*names])} | {name: name for name in names}
    return next((lower[name] for name in known if name in lower), None)


def whole_numbers(path: Path, values: npt.ArrayLike, where: str = "") -> npt.NDArray[np.int64]:
    """Ids as whole numbers; ReadError if they are not."""
    numbers = np.asarray(values)
    is_whole = numbers.ndim == 1 and numbers.dtype.kind in "biuf"
    if is_whole and numbers.dtype.kind in "uf":
        # larger decimals may have been rounded; comparisons with NaN are false
        most = EXACT if numbers.dtype.kind == "f" else 2.0**63
        is_whole = bool(np.all((np.abs(numbers) < most) & (numbers == np.rint(numbers))))
    if not is_whole:
        told = "ids must be whole numbers, below 2^53 where they are read as decimals"
        raise ReadError(f"{path}{where}: {told}")
    whole = numbers.astype(np.int64, copy=False)
    whole.flags.writeable = False  # so that the packing need not copy it
    return whole


def _lengths(where: str, values: npt.ArrayLike, what: str) -> FloatArray:
    """Numbers that may be lengths; which of them cannot be is the packing's to say."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ReadError(f"{where}: expected numbers for {what}, found {array.dtype}")
    return doubles(array)


def body_numbers(path: Path, grains: GrainTable, named: str | None) -> IntArray | None:
    """
    The number of the body that each sphere is of, shape (N,); negative: a grain of its own.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Of one frame.
    named : str, optional
        The column that says it; ``id``: each sphere is a grain. Without it a column that numbers
        clumps whatever the format; one of molecules is never taken unasked, as these may be bonded
        spheres that move against one another.

    Returns
    -------
    ndarray of int, shape (N,), or None
        None if each sphere is a grain.

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
    # an empty frame may have lost its columns; `id` makes each sphere a grain, also without ids
    if name is None or not len(grains.radius) or (name == "id" and name not in columns):
        return None
    if name not in columns:
        there = ", ".join(["id", *columns])
        raise ReadError(f"{path}: `bodies`: there is no column {name!r}; the columns are {there}")
    numbers = whole_numbers(path, columns[name], f": `bodies`: the column {name}")
    return np.where(numbers > 0, numbers, -1) if name.lower() in MOLECULE_COLUMNS else numbers
