"""Which column of a table is what, by the names that programs give them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.columns import DIAMETER_NAMES, ID_NAMES, RADIUS_NAMES, refuse_named_twice
from scanfab.io.layout import TextTable

Names = Mapping[str, tuple[str, ...]]
"""The names that a column may have, by what it is; as :func:`plain_name` has them."""

# columns that tell frames of one file apart
FRAME_NAMES = ("step", "timestep", "time.step", "frame", "time", "time.s", "time.ms")
# names of a coordinate (an axis and its number), of a grain of a contact, and of its force along an
# axis; PFC's and EDEM's are among them
CENTRE = (
    "{0} pos.{0} pos{0} position.{0} points.{1} ball.pos.{0} ball.position.{0} ball.{0} "
    "particle.position.{0}"
)
END = (
    "id{0} id.{0} grain{0} particle{0} particle.{0} body{0} contact.end{0}.id contact.end{0} "
    "end{0}.id end{0} contact.id{0}"
)
FORCE = "f{0} force.{0} f.{0} contact.force.global.{0} force.global.{0}"
# of contacts: the force on either grain, the image of the second, the force on the first or second,
# the normal and the tangential part
ALONG = {"f{0}": FORCE, "i{0}": "i{0} image.{0}", "f{0}1": "f{0}1", "f{0}2": "f{0}2"}
ALONG |= {"fn{0}": "fn{0} contact.normal.force.{0}", "ft{0}": "ft{0} contact.tangential.force.{0}"}
FORCES: dict[str, tuple[str, ...]] = {
    "fn": ("fn", "force.n", "normal.force", "contact.force.normal", "force.normal"),
    "kind": ("contact.type", "kind"),
}
FORCES |= {k.format(x): tuple(v.format(x).split()) for x in "xyz" for k, v in ALONG.items()}
TABLE: Names = {
    **{axis: tuple(CENTRE.format(axis, number).split()) for number, axis in enumerate("xyz")},
    "radius": (*RADIUS_NAMES, "f.radius", "ball.radius", "particle.radius"),
    "diameter": (*DIAMETER_NAMES, "ball.diameter", "particle.diameter"),
    "id": (*ID_NAMES, "particle.id", "body.id", "ball.id"),
    "id1": (*END.format(1).split(), "geoa", "i", "contact.idfirst", "contact.id.first"),
    "id2": (*END.format(2).split(), "geob", "j", "contact.idsecond", "contact.id.second"),
    **FORCES,
}
PFC: Names = {**TABLE, "kind": ("contact.type", "type")}
EDEM: Names = {**TABLE, "volume": ("particle.volume", "volume")}

LENGTHS = ("x", "y", "z", "radius", "diameter", "volume")
# EDEM numbers its queries: "Q05 : Particle Position X:"
QUERY = re.compile(r"^q[0-9]+[\s:.]+")
CUBE = re.compile(r"^cu |(\^|\*\*)?3$")
UNIT = re.compile(r"\s*[\[(]\s*([^\])]*)\s*[\])]\s*$")


def plain_name(name: str) -> str:
    """Small letters and digits with one point between words, without number of a query or unit."""
    text = QUERY.sub("", UNIT.sub("", name.strip()).lower())
    return re.sub(r"[^a-z0-9]+", ".", text).strip(".")


def is_frame_name(name: str) -> bool:
    """Whether a column tells frames of one file apart."""
    return plain_name(name) in FRAME_NAMES


def find_columns(
    path: Path, table: TextTable, known: Names, named: Mapping[str, str], option: str
) -> dict[str, str]:
    """
    The key of each column that is known (its name in the layout), by what it is.

    Parameters
    ----------
    path : Path
        For messages.
    table : TextTable
        With the names of all columns.
    known : mapping
        The usual names.
    named : mapping of str to str
        What the user says; a number from 1 means the column at that place, if none has that name.
    option : str
        The argument by which the user says it.

    Raises
    ------
    ReadError
        If the user names a column that is not there or twice, or two columns have a name that
        matters.
    """
    names, plain = table.own, [plain_name(name) for name in table.own]
    found: dict[str, str] = {}
    for standard in (*named, *(one for one in known if one not in named)):
        own = f"{named.get(standard, '')}"
        if standard in named:
            places = [place for place, name in enumerate(names) if name == own]
            if not places and re.fullmatch(r"[0-9]{1,6}", own) and 1 <= int(own) <= len(names):
                places = [int(own) - 1]
            if not places:
                told = f"there is no column {own!r} to serve as {standard}"
                raise ReadError(f"{path}: {told}; the columns are {', '.join(names)}")
        else:
            word = next((one for one in known[standard] if one in plain), None)
            places = [place for place, name in enumerate(plain) if name == word]
        if len(places) > 1:
            listed = ", ".join(f"{names[place]!r} (column {place + 1})" for place in places)
            advice = f'choose one by its number: `{option}={{"{standard}": {places[0] + 1}}}`'
            raise ReadError(f"{path}: several columns may be {standard}: {listed}: {advice}")
        keys = [table.layout.names[place] for place in places]
        if standard in named or not {*keys} <= {*found.values()}:
            found[standard] = keys[0]
    refuse_named_twice(path, {standard: found[standard] for standard in named}, option)
    return found


def check_units(path: Path, found: Mapping[str, str], contacts: bool = False) -> None:
    """
    Lengths of one table have one unit, as have forces, and volumes have its cube.

    Raises
    ------
    ReadError
        If the names of the columns say two units.
    """
    units: dict[str, str] = {}
    for what, name in found.items():
        # micro has two letters that look alike, and a cube many spellings
        unit = UNIT.search(unicodedata.normalize("NFKC", name))
        if unit and unit[1].strip() and (what.startswith("f") if contacts else what in LENGTHS):
            units[name] = CUBE.sub("", unit[1].strip())
    if len({*units.values()}) > 1:
        kind = "forces" if contacts else "lengths (and volumes in its cube)"
        raise ReadError(f"{path}: expected {kind} of one unit, found {', '.join(units)}")


def refuse_frames(path: Path, columns: Columns) -> None:
    """ReadError for a table of several frames."""
    for name, values in columns.items():
        count = len(np.unique(values)) if is_frame_name(name) else 1
        if count > 1:
            expected = "expected one frame in a file"
            raise ReadError(f"{path}: the column {name} has {count} values: {expected}")
