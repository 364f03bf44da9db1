"""Find the meaning of the columns of a table by the names that programs give them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path

from scanfab.base.errors import ReadError
from scanfab.io.columns import DIAMETER_NAMES, ID_NAMES, RADIUS_NAMES, refuse_named_twice
from scanfab.io.layout import TextTable

Names = Mapping[str, tuple[str, ...]]
"""The names that a column may have for each quantity, in the form of :func:`plain_name`."""

# names of columns that number the frames in a file
FRAME_NAMES = ("step", "timestep", "time.step", "frame", "time", "time.s", "time.ms")
# names of a coordinate (axis and its number), of a grain in a contact, and of a force component,
# including the names of PFC and EDEM
CENTRE = (
    "{0} pos.{0} pos{0} position.{0} points.{1} ball.pos.{0} ball.position.{0} ball.{0} "
    "particle.position.{0}"
)
END = (
    "id{0} id.{0} grain{0} particle{0} particle.{0} body{0} contact.end{0}.id contact.end{0} "
    "end{0}.id end{0} contact.id{0}"
)
FORCE = "f{0} force.{0} f.{0} contact.force.global.{0} force.global.{0}"
# contacts: force on either grain, image of the second, force on the first or second grain, normal
# and tangential part of the force
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
    """A name in small letters, points between words, without the number of a query and the unit."""
    text = QUERY.sub("", UNIT.sub("", name.strip()).lower())
    return re.sub(r"[^a-z0-9]+", ".", text).strip(".")


def is_frame_name(name: str) -> bool:
    """Whether a column of this name numbers the frames in a file."""
    return plain_name(name) in FRAME_NAMES


def find_columns(
    path: Path, table: TextTable, known: Names, named: Mapping[str, str], option: str
) -> dict[str, str]:
    """
    Find the column (its name in the layout) for each known quantity.

    Parameters
    ----------
    path : Path
        The file, for messages.
    table : TextTable
        The table, with the names of all columns.
    known : mapping
        The usual names of each quantity.
    named : mapping of str to str
        The user's choice: quantity to name or number (from 1) of a column; a name comes first.
    option : str
        The name of the option with the user's choice, for messages.

    Raises
    ------
    ReadError
        If the user names a column that does not exist, or one column twice, or if two columns have
        the name of one quantity.
    """
    names, plain = table.own, [plain_name(name) for name in table.own]
    roles: dict[str, str] = {}
    for standard in (*named, *(what for what in known if what not in named)):
        key = f"{named.get(standard, '')}"
        if standard in named:
            places = [place for place, name in enumerate(names) if name == key]
            if not places and re.fullmatch(r"[0-9]{1,6}", key) and 1 <= int(key) <= len(names):
                places = [int(key) - 1]
            if not places:
                problem = f"there is no column {key!r} to serve as {standard}"
                raise ReadError(f"{path}: {problem}; the columns are {', '.join(names)}")
        else:
            word = next((name for name in known[standard] if name in plain), None)
            places = [place for place, name in enumerate(plain) if name == word]
        if len(places) > 1:
            listed = ", ".join(f"{names[place]!r} (column {place + 1})" for place in places)
            advice = f'choose one by its number: `{option}={{"{standard}": {places[0] + 1}}}`'
            raise ReadError(f"{path}: several columns may be {standard}: {listed}: {advice}")
        keys = [table.layout.names[place] for place in places]
        if standard in named or not {*keys} <= {*roles.values()}:
            roles[standard] = keys[0]
    refuse_named_twice(path, {standard: roles[standard] for standard in named}, option)
    return roles


def check_units(path: Path, roles: Mapping[str, str], contacts: bool = False) -> None:
    """
    Check that all lengths have one unit and volumes its cube; for contacts, that forces have one.

    Raises
    ------
    ReadError
        If the names of the columns state different units.
    """
    units: dict[str, str] = {}
    for what, name in roles.items():
        # NFKC unifies the two letters for micro; CUBE knows the spellings of a cube
        unit = UNIT.search(unicodedata.normalize("NFKC", name))
        if unit and unit[1].strip() and (what.startswith("f") if contacts else what in LENGTHS):
            units[name] = CUBE.sub("", unit[1].strip())
    if len({*units.values()}) > 1:
        kind = "forces" if contacts else "lengths (and volumes in its cube)"
        raise ReadError(f"{path}: expected {kind} of one unit, found {', '.join(units)}")
