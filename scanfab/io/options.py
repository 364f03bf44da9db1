"""The options of ``read_series``: what users add to the information in the files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from scanfab.base.option import accepted, number, numbers, optional, options_of, reading, unusable
from scanfab.io.reader import installed_readers, reader_named

parse_positive = optional(number("a number above 0", lambda value: 0 < value < math.inf))
parse_skip = number("how many lines to skip, 0 or more", lambda value: 0 <= value < 2**31, int)


# texts and paths are checked further where they are used
parse_text = optional(accepted("text", lambda value: isinstance(value, str)))
parse_contacts = accepted(
    "auto, file, geometric or a path", lambda value: isinstance(value, str | PathLike)
)
parse_periodic = optional(
    accepted(
        "letters out of xyz",
        lambda value: isinstance(value, str) and len(value) <= 3 and set(value) <= set("xyz"),
    )
)


def parse_format(name: str, value: Any) -> str | None:
    """The name of an installed reader."""
    given: str | None = parse_text(name, value)
    if given is not None:
        reader_named(given)
    return given


def parse_columns(name: str, value: Any) -> dict[str, str] | None:
    """A dict of standard name to column, from a mapping or from ``NAME=COLUMN,NAME=COLUMN``."""
    if value is None:
        return None
    parts: Any = [part.partition("=")[::2] for part in str(value).split(",")]
    if isinstance(value, Mapping):
        parts = value.items()
    names = {f"{standard}".strip(): f"{column}".strip() for standard, column in parts}
    if not all([*names, *names.values()]) or len({*names.values()}) < len(parts):
        expected = 'NAME=COLUMN such as "radius=c_rad,x=px", each name and each column once'
        raise unusable(name, expected, value)
    return names


def parse_cell(name: str, value: Any) -> tuple[float, ...] | str | PathLike[str] | None:
    """Three or six numbers, or the path of a file with the numbers of each frame."""
    if value is None or (isinstance(value, str | PathLike) and Path(value).is_file()):
        return value
    expected = (
        "three lengths LX LY LZ above 0, or six numbers LX LY LZ XY XZ YZ, or a CSV file with the "
        "cell of each frame"
    )
    return numbers(expected, lambda cell: len(cell) in (3, 6) and min(cell[:3]) > 0)(name, value)


def parse_frames(name: str, value: str | int | slice | None) -> slice:
    """A slice from ``A:B:C`` or a single number; None gives all frames."""
    if value is None or (isinstance(value, slice) and value.step != 0):
        return value or slice(None)
    words = str(value).split(":")
    with suppress(ValueError):
        if len(words) == 1:
            first = int(words[0])
            # -1 is the last frame: the slice -1:0 would be empty, so the end is None
            return slice(first, first + 1 or None)
        parts = [int(word) if word.strip() else None for word in words]
        if len(parts) <= 3 and parts[2:] != [0]:
            return slice(*parts)
    raise unusable(name, "a slice such as 0:10:2, :5 or -1:", value)


def parse_dim(name: str, value: Any) -> str | int:
    """``auto``, 2 or 3."""
    if str(value) not in ("auto", "2", "3"):
        raise unusable(name, "auto, 2 or 3", value)
    return "auto" if value == "auto" else int(value)


@dataclass(frozen=True)
class Reading:
    """The options of ``read_series``."""

    format: str | None = reading(parse_format, form="NAME", words=installed_readers)
    """Reader to use (default: chosen by the content of the file)."""
    columns: dict[str, str] | None = reading(parse_columns, form="NAMES")
    """
    Names of columns that differ from the usual names: "radius=c_rad,x=px". In a table without names
    use the numbers of the columns, from 1: "x=1,y=2,z=3,diameter=4".
    """
    contact_columns: str | None = reading(parse_text, form="KEYWORDS")
    """
    Meaning of the columns of a dump local: LIGGGHTS keywords "pos id force", or names of columns
    "id1=NAME,id2=NAME", which also work for tables of contacts.
    """
    skip: int = reading(parse_skip, default=0)
    """Number of lines to skip at the top of a text table."""
    radius: float | None = reading(parse_positive, form="L")
    """Radius of all grains in the dump's units, for dumps without radii."""
    cell: tuple[float, ...] | None = reading(parse_cell, form="LX LY LZ [XY XZ YZ]|FILE.csv")
    """
    Periodic cell, for formats that do not store it. It repeats along x, y and z unless `periodic`
    says otherwise. FILE.csv lists the cell of each step or frame: columns step lx ly lz, and
    xy xz yz if it is tilted.
    """
    periodic: str | None = reading(parse_periodic, form="xyz")
    """Periodic directions (default: from the dump)."""
    bodies: str | None = reading(parse_text, form="COLUMN")
    """
    Column that numbers the clump of each sphere; a negative number is a grain of its own (default:
    id_multisphere, clumpId, clump_id or clump, if there is one); id: each sphere is a grain.
    """
    max_unpacked: float | None = reading(parse_positive, form="TIMES")
    """How many times its compressed size a file may grow to (default: 1000)."""
    contacts: str | PathLike[str] = reading(
        parse_contacts, default="auto", form="file|geometric|PATH"
    )
    """
    Source of the contacts. PATH: a file, folder or glob, matched by step; file: the contact files
    of the dump; geometric: positions and radii (default: file if there is one, else geometric).
    """
    dim: str | int = reading(parse_dim, default="auto", form="auto|2|3")
    """
    2: discs in a coordinate plane; 3: spheres; auto: 2 if the first frame with grains has at least
    ten grains and all centres share exactly one coordinate. The first frame decides for all.
    """


READING_OPTIONS = options_of(Reading)


def take_reading(options: dict[str, Any]) -> dict[str, Any]:
    """
    Remove the options of ``read_series`` from ``options``, and return them checked, with defaults.

    Raises
    ------
    SettingsError
        If a value is not valid.
    """
    return {
        known.name: known.parse(known.name, options.pop(known.name, known.default))
        for known in READING_OPTIONS
    }
