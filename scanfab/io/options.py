"""What users say of a source that it does not say itself: the options of ``read_series``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from scanfab.base.option import Option, number, one_of, optional, unusable, whole


def _reader_names() -> Iterable[str]:
    from scanfab.io.reader import installed_readers

    return installed_readers()


def parse_text(name: str, value: Any) -> str | None:
    """Words that whoever uses them checks."""
    if not isinstance(value, str | None):
        raise unusable(name, "text", value)
    return value


def parse_contacts(name: str, value: Any) -> str | PathLike[str]:
    """A word or a path; whether that exists, is found out where it is looked for."""
    if not isinstance(value, str | PathLike):
        raise unusable(name, "auto, file, geometric or a path", value)
    return value


def parse_columns(name: str, value: Any) -> dict[str, str] | None:
    """Standard names to a file's own, from a mapping or from ``NAME=COLUMN,NAME=COLUMN``."""
    if value is None or isinstance(value, Mapping):
        return None if value is None else dict(value)
    names = {}
    for part in str(value).split(","):
        standard, equals, own = part.partition("=")
        if not (equals and standard.strip() and own.strip()):
            raise unusable(name, 'NAME=COLUMN such as "radius=c_rad,x=px"', part)
        if standard.strip() in names:
            raise unusable(name, f"one column as {standard.strip()}", value)
        names[standard.strip()] = own.strip()
    return names


def parse_cell(name: str, value: Any) -> tuple[float, ...] | str | PathLike[str] | None:
    """Three or six numbers, or the name of a file that has those of each frame."""
    if value is None or (isinstance(value, str | PathLike) and Path(value).is_file()):
        return value
    try:
        numbers = tuple(map(float, value.split() if isinstance(value, str) else value))
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) not in (3, 6) or not min(numbers[:3]) > 0:
        raise unusable(
            name,
            "three lengths LX LY LZ above 0, or six numbers with XY XZ YZ, or a CSV file with "
            "those of each frame",
            value,
        )
    return numbers


def parse_frames(text: str | int | slice | None, name: str = "frames") -> slice:
    """A slice from ``A:B:C`` or a single number."""
    if text is None:
        return slice(None)
    if isinstance(text, slice):
        return text
    words = str(text).split(":")
    with suppress(ValueError):
        if len(words) == 1:
            first = int(words[0])
            # nothing is behind the last frame, which is -1
            return slice(first, first + 1 or None)
        numbers = [int(word) if word.strip() else None for word in words]
        if len(numbers) <= 3 and numbers[2:] != [0]:
            return slice(*numbers)
    raise unusable(name, "a slice such as 0:10:2, :5 or -1:", text)


def parse_periodic(name: str, value: Any) -> str | None:
    """Letters out of xyz."""
    if value is not None and not (
        isinstance(value, str) and len(value) <= 3 and set(value) <= set("xyz")
    ):
        raise unusable(name, "letters out of xyz", value)
    return value


def parse_dim(name: str, value: Any) -> str | int:
    """``auto``, or a number of dimensions."""
    word = one_of("auto", "2", "3")(name, str(value))
    return word if word == "auto" else int(word)


parse_radius = optional(number("a length above 0", lambda value: 0 < value < math.inf))
parse_skip = whole("how many lines to skip, 0 or more", lambda value: 0 <= value < 2**31)
parse_max_unpacked = optional(number("a number above 0", lambda value: value > 0))

_reading = partial(Option, group="reading")
READING_OPTIONS = (
    _reading(
        name="format",
        parse=parse_text,
        help="Reader to use (default: by content).",
        meaning="reader of the dumps; not given: found by their content",
        metavar="NAME",
        choices=_reader_names,
    ),
    _reading(
        name="columns",
        parse=parse_columns,
        help='Names of columns that are not the usual ones: "radius=c_rad,x=px"; of tables without '
        'names their numbers from 1: "x=1,y=2,z=3,diameter=4".',
        meaning="names of columns that are not the usual ones",
        takes="dict",
        metavar="NAMES",
    ),
    _reading(
        name="contact_columns",
        parse=parse_text,
        help='Columns of a dump local: LIGGGHTS keywords "pos id force", or LAMMPS names '
        '"id1=NAME,id2=NAME", which serve tables too.',
        meaning="what the columns of the contact files are",
        metavar="KEYWORDS",
    ),
    _reading(
        name="skip",
        default=0,
        parse=parse_skip,
        help="Lines before the table, of tables of text.",
        meaning="lines that are skipped before a table",
        takes="int",
        kind=int,
        metavar="N",
    ),
    _reading(
        name="radius",
        parse=parse_radius,
        help="Radius for dumps without one.",
        meaning="radius of grains whose dump has none, dump's unit",
        takes="float",
        kind=float,
        metavar="L",
    ),
    _reading(
        name="cell",
        parse=parse_cell,
        help="The cell, for formats that do not carry it (periodic in xyz unless `periodic`); "
        "FILE.csv has one for each step or frame: step lx ly lz, and xy xz yz if tilted.",
        meaning="the periodic cell, where the dump carries none, dump's unit",
        takes="tuple of float or path",
        metavar="LX LY LZ [XY XZ YZ]|FILE.csv",
    ),
    _reading(
        name="periodic",
        parse=parse_periodic,
        help="Periodic directions (default: the dump's).",
        meaning="directions in which the sample repeats; not given: the dump's",
        metavar="xyz",
    ),
    _reading(
        name="bodies",
        parse=parse_text,
        help="Column that says which clump a sphere belongs to (default: id_multisphere, clumpId, "
        "clump_id or clump, if there is one; id: each sphere is a grain).",
        meaning="column that says which clump a sphere belongs to; not given: the format's own",
        metavar="COLUMN",
    ),
    _reading(
        name="max_unpacked",
        parse=parse_max_unpacked,
        help="Times its size that a packed file may unpack to (default: 1000).",
        meaning="times its size that a packed file may unpack to; not given: 1000",
        takes="float",
        kind=float,
        metavar="TIMES",
    ),
    _reading(
        name="contacts",
        default="auto",
        parse=parse_contacts,
        help="Contacts: a file, folder or glob matched by step; from the dump's own contact files; "
        "or by geometry (default: file if there is one, else geometric).",
        meaning="where the contacts come from: contact files, or the geometry of the grains",
        takes="str or path",
        metavar="PATH|file|geometric",
        choices=lambda: ("file", "geometric"),
        files=True,
    ),
    _reading(
        name="dim",
        default="auto",
        parse=parse_dim,
        help="2: discs in a coordinate plane; auto: 2 if all centres of the first frame with any, "
        "ten at least, share exactly one coordinate, for the whole series.",
        meaning="3: spheres; 2: discs in a coordinate plane; auto: as the first frame has them",
        takes="str or int",
        metavar="auto|2|3",
        choices=lambda: ("auto", "2", "3"),
    ),
)


def take_reading(options: dict[str, Any]) -> dict[str, Any]:
    """
    Take the options of ``read_series`` out of others, checked, and the usual ones in their place.

    Raises
    ------
    SettingsError
        If a value cannot be used.
    """
    return {
        one.name: one.parse(one.name, options.pop(one.name, one.default)) for one in READING_OPTIONS
    }
