"""Which column of a table is what, by the names that programs give them."""

from __future__ import annotations

import re
import unicodedata
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.columns import (
    DIAMETER_NAMES,
    ID_NAMES,
    RADIUS_NAMES,
    refuse_cylindrical,
    refuse_named_twice,
)
from scanfab.io.layout import unique

Names = Mapping[str, tuple[str, ...]]
"""The names that a column may have, by what it is; as :func:`plain_name` has them."""

# columns that tell frames of one file apart
FRAME_NAMES = ("step", "timestep", "time.step", "frame", "time", "time.s", "time.ms")
# those that may, and may be a property of grains, too
PERHAPS_FRAMES = ("t", "iteration", "iter", "cycle", "cycles", "snapshot", "increment")
# what has one unit in a table of grains
LENGTHS = ("x", "y", "z", "radius", "diameter")
# what a contact table must have, and what it may
IDS = ("id1", "id2")
# the force on either grain, the image of the second, the force on the first or second, the normal
# and the tangential part
FORCES = {
    **{f"f{axis}": (f"f{axis}", f"force.{axis}", f"f.{axis}") for axis in "xyz"},
    **{f"i{axis}": (f"i{axis}", f"image.{axis}") for axis in "xyz"},
    **{name: (name,) for axis in "xyz" for name in (f"f{axis}1", f"f{axis}2")},
    **{name: (name,) for axis in "xyz" for name in (f"fn{axis}", f"ft{axis}")},
    "fn": ("fn", "force.n", "normal.force"),
    "kind": ("contact.type", "kind"),
}
TABLE: Names = {
    **{
        axis: (axis, f"pos.{axis}", f"pos{axis}", f"position.{axis}", f"points.{number}")
        for number, axis in enumerate("xyz")
    },
    "radius": (*RADIUS_NAMES, "f.radius"),
    "diameter": DIAMETER_NAMES,
    "id": (*ID_NAMES, "particle.id", "body.id"),
    "id1": ("id1", "id.1", "grain1", "particle1", "particle.1", "body1", "geoa", "i"),
    "id2": ("id2", "id.2", "grain2", "particle2", "particle.2", "body2", "geob", "j"),
    **FORCES,
}
PFC: Names = {
    **{
        axis: (f"ball.pos.{axis}", f"pos.{axis}", f"ball.position.{axis}", f"ball.{axis}", axis)
        for axis in "xyz"
    },
    "radius": ("ball.radius", "radius", "rad"),
    "diameter": ("ball.diameter", "diameter"),
    "id": ("ball.id", "id"),
    "id1": ("contact.end1.id", "contact.end1", "end1.id", "end1", "contact.id1", "id1"),
    "id2": ("contact.end2.id", "contact.end2", "end2.id", "end2", "contact.id2", "id2"),
    **FORCES,
    **{
        f"f{axis}": (f"contact.force.global.{axis}", f"force.global.{axis}", f"force.{axis}")
        for axis in "xyz"
    },
    "fn": ("contact.force.normal", "force.normal"),
    "kind": ("contact.type", "type"),
}
EDEM: Names = {
    **{axis: (f"particle.position.{axis}", f"position.{axis}") for axis in "xyz"},
    **{what: (f"particle.{what}", what) for what in ("radius", "diameter", "volume", "id")},
    "id1": ("contact.idfirst", "contact.id.first", "contact.first.id"),
    "id2": ("contact.idsecond", "contact.id.second", "contact.second.id"),
    **{f"fn{axis}": (f"contact.normal.force.{axis}",) for axis in "xyz"},
    **{f"ft{axis}": (f"contact.tangential.force.{axis}",) for axis in "xyz"},
}

# EDEM numbers its queries: "Q05 : Particle Position X:"
QUERY = re.compile(r"^q[0-9]+[\s:.]+")
UNIT = re.compile(r"\s*[\[(]\s*([^\])]*)\s*[\])]\s*$")


def plain_name(name: str) -> str:
    """Small letters and digits with one point between words, without number of a query or unit."""
    text = QUERY.sub("", UNIT.sub("", name.strip()).lower())
    return re.sub(r"[^a-z0-9]+", ".", text).strip(".")


def is_of_contacts(standard: str) -> bool:
    """Whether a column says something of a contact that a packing has: its grains, image, force."""
    return standard in (*IDS, "kind", "ix", "iy", "iz") or standard.startswith("f")


def is_frame_name(name: str) -> bool:
    """Whether a column tells frames of one file apart."""
    return plain_name(name) in FRAME_NAMES


def is_contacts(found: Mapping[str, str]) -> bool:
    """Whether columns are of a contact table: both ids, and not a grain's place and size."""
    is_grain = {"x", "y", "z"} <= found.keys() and found.keys() & {"radius", "diameter", "volume"}
    return set(IDS) <= found.keys() and not is_grain


def find_columns(
    path: Path, names: Sequence[str], known: Names, named: Mapping[str, str], option: str
) -> dict[str, str]:
    """
    The file's own name of each column that is known, as :func:`unique` has it, by what it is.

    Parameters
    ----------
    path : Path
        For messages.
    names : sequence of str
        Of all columns.
    known : mapping
        The usual names.
    named : mapping of str to str
        What the user says; a number from 1 means the column at that place, if none has that name.
    option : str
        The argument by which the user says it.

    Raises
    ------
    ReadError
        If the user names a column that is not there or twice, two columns have a name that
        matters, or lengths have different units.
    """
    found: dict[str, str] = {}
    keys = unique(names)
    for standard, own in named.items():
        found[standard] = _column(path, names, str(own), standard, option)
    refuse_named_twice(path, found, option)
    plain = [plain_name(name) for name in names]
    for standard, usual in known.items():
        if standard in found:
            continue
        places = next(
            (p for one in usual if (p := [k for k, name in enumerate(plain) if name == one])), []
        )
        if len(places) > 1:
            listed = ", ".join(f"{names[place]!r} (column {place + 1})" for place in places)
            raise ReadError(
                f"{path}: several columns may be {standard}: {listed}: choose one by its number: "
                f'`{option}={{"{standard}": {places[0] + 1}}}`'
            )
        if places and keys[places[0]] not in found.values():
            found[standard] = keys[places[0]]
            if standard == "radius" and not named.keys() & {"radius", "diameter"}:
                refuse_cylindrical(path, names[places[0]], names)
    return found


def _column(path: Path, names: Sequence[str], own: str, standard: str, option: str) -> str:
    if list(names).count(own) > 1:
        raise ReadError(
            f"{path}: there are several columns {own!r}: choose one by its number in `{option}`"
        )
    if own in names:
        return own
    if re.fullmatch(r"[0-9]{1,6}", own) and 1 <= int(own) <= len(names):
        return unique(names)[int(own) - 1]
    raise ReadError(
        f"{path}: there is no column {own!r} to serve as {standard}; the columns are "
        f"{', '.join(names)}"
    )


def check_units(path: Path, found: Mapping[str, str], contacts: bool = False) -> None:
    """
    Lengths of one table have one unit, as have forces, and volumes have its cube.

    Raises
    ------
    ReadError
        If the names of the columns say two units.
    """
    what = "forces" if contacts else "lengths"
    wanted = [one for one in found if one.startswith("f")] if contacts else LENGTHS
    units = {found[one]: _unit_of(found[one]) for one in wanted if one in found}
    named = [name for name, unit in units.items() if unit]
    if len({units[name] for name in named}) > 1:
        raise ReadError(f"{path}: {what} of one unit are expected, found {', '.join(named)}")
    if contacts or not named:
        return
    unit = units[named[0]]
    cube = _unit_of(found.get("volume", ""))
    if cube and cube not in (f"{unit}^3", f"{unit}3", f"{unit}**3", f"cu {unit}"):
        raise ReadError(
            f"{path}: volumes in the cube of the unit of lengths, {unit}, are expected, found "
            f"{found['volume']}"
        )
    if len(named) < len(units):
        lacking = ", ".join(name for name in units if name not in named)
        warnings.warn(
            f"{path}: {', '.join(named)} name a unit, {lacking} none: all are taken to be in the "
            f"same one",
            ScanfabWarning,
            stacklevel=3,
        )


def _unit_of(name: str) -> str | None:
    """The unit in brackets behind the name of a column; micro has two letters that look alike."""
    match = UNIT.search(name)
    return unicodedata.normalize("NFKC", match[1]).strip() if match else None
