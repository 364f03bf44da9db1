"""
The text dumps of LIGGGHTS and LAMMPS: sections below ``ITEM:`` lines, and LAMMPS' ``dump yaml``.

A snapshot is a header and a table. The names of the table's columns stand in the last ``ITEM:``
line: ``ITEM: ATOMS id type x y z radius``. A header in YAML is translated into such sections.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import has_radius
from scanfab.io.files import first_bytes
from scanfab.io.formats.dump import Dump, box_cell, numbers_as_names
from scanfab.io.formats.shared import HEADER_BYTES, marked_frames
from scanfab.io.growing import grows
from scanfab.io.reader import Carries, FileKind, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell

carries: Carries = "cell"
# a snapshot begins with the first of these lines
MARK, YAML_MARK = re.compile(rb"ITEM: (?:UNITS|TIME|TIMESTEP)\b"), re.compile(rb"---[ \t\r]*\n")
# the words behind ITEM:, and the lines below them
SECTION = re.compile(rb"^ITEM: ([^\r\n]*)\r?\n((?:(?!ITEM: )[^\n]*\n)*)", re.MULTILINE)
YAML = re.compile(rb"---[ \t]*\r?\ncreator:[ \t]*LAMMPS[ \t]*\r?\n")
YAML_VALUE = re.compile(r"^(\w+):[ \t]*(.*)$", re.MULTILINE)
YAML_BOX = re.compile(r"^box:[ \t]*\n((?:[ \t]*-[^\n]*\n){1,4})", re.MULTILINE)
YAML_ROWS, YAML_END = re.compile(rb"^data:[ \t]*\r?\n", re.MULTILINE), b"\n..."
# the kind of box, and two letters for each axis: its lower and its upper face
BOX_KEY = re.compile(r"BOX BOUNDS(?: (abc origin|xy xz yz))?((?: (?:pp|[fsm]{2})){3})?")
# numbers in each line of a box of this kind
BOX_WIDTHS = {None: 2, "xy xz yz": 3, "abc origin": 4}
# columns of words
WORDS = ("element", "lattice")


class Header(NamedTuple):
    """What stands above the rows of a snapshot, as it stands there: nothing is checked yet."""

    sections: dict[str, list[str]]
    """The lines below each ``ITEM:`` line, by the words in it."""
    names: list[str]
    """Of the columns; none in dumps of old versions."""
    begin: int
    """The first byte of the rows; 0 if they are not there."""
    end: int | None
    """The byte behind the rows; None: the end of the snapshot."""

    @property
    def number(self) -> str:
        """What ``NUMBER OF ...`` says."""
        return "".join(self.sections.get(f"NUMBER OF {self.what}", [])[:1]).strip()

    @property
    def what(self) -> str:
        """What is counted: ATOMS, or ENTRIES (or a label of the deck) in lists of contacts."""
        keys = (key for key in self.sections if key.startswith("NUMBER OF "))
        return next(keys, "NUMBER OF ATOMS").removeprefix("NUMBER OF ")


def fits(head: bytes) -> bool:
    """Whether a file starts as these dumps do."""
    return head.startswith(b"ITEM: ") or YAML.match(head) is not None


def kind(path: Path) -> FileKind:
    """Atoms are grains if they have a radius; whatever else is counted are contacts."""
    header = _header(first_bytes(path, HEADER_BYTES))
    if header.what != "ATOMS":
        return "contacts"
    return "grains" if has_radius(header.names) else "points" if header.sections else "other"


def snapshots(path: Path) -> list[Snapshot]:
    """The snapshots of a file, in the order of their steps; an incomplete last one is left out."""
    mark = YAML_MARK if first_bytes(path, 3) == b"---" else MARK
    return marked_frames(path, mark, _moment, _lack)


def read(snapshot: Snapshot, options: ReadOptions) -> Dump:
    """
    One snapshot; words of elements stay words, all other columns are numbers.

    Raises
    ------
    ReadError
        If the header or a line is not as it should be; names the line.
    """
    data, where = text_of(snapshot), f"{snapshot.path}, step {snapshot.step}"
    header = _header(data)
    if not (header.begin and re.fullmatch(r"\d{1,18}", header.number)):
        raise ReadError(
            f"{where}: the header is incomplete: expected a whole number after ITEM: NUMBER OF "
            f"{header.what}, found {header.number[:80]!r}, and rows below ITEM: {header.what} (in "
            f"YAML below data:, with ... at their end)"
        )
    rows = data[header.begin : header.end]
    if header.end is not None:
        # entries such as "  - [ 1, 0.5, ]", one a line; without a run of blanks they parse faster
        rows = rows.replace(b"  - [ ", b"").replace(b"- [", b"").translate(None, b"],")
    names = header.names or numbers_as_names(len(rows.partition(b"\n")[0].split()))
    line = data.count(b"\n", 0, header.begin) + 1
    layout = Layout(tuple(names), line=line, whole=("id",), text=WORDS)
    columns = read_rows(snapshot, rows, layout, count=int(header.number))
    return Dump(names, columns, _cell(where, header.sections))


def _header(data: bytes) -> Header:
    if data.startswith(b"---"):
        return _yaml_header(data)
    sections: dict[str, list[str]] = {}
    for one in SECTION.finditer(data[:HEADER_BYTES]):
        key = one[1].decode("utf-8", "replace").strip()
        if f"NUMBER OF {key.partition(' ')[0]}" in sections:
            return Header(sections, key.split()[1:], one.start(2), None)
        sections[key] = one[2].decode("utf-8", "replace").splitlines()
    return Header(sections, [], 0, None)


def _yaml_header(data: bytes) -> Header:
    """The header of a document, as the sections of a text dump."""
    rows = YAML_ROWS.search(data, 0, HEADER_BYTES)
    begin, end = (0, 0) if rows is None else (rows.end(), data.rfind(YAML_END) + 1)
    text = data[: begin or HEADER_BYTES].decode("utf-8", "replace").replace("\r", "")
    values = {key: value.strip() for key, value in YAML_VALUE.findall(text)}

    def listed(text: str) -> list[str]:
        """The words of a list such as ``[ p, p, f, f, ]``; names may have brackets, too."""
        return text.strip(" -").removeprefix("[").removesuffix("]").replace(",", " ").split()

    letters = listed(values.get("boundary", ""))
    flags = [low + high for low, high in zip(letters[::2], letters[1::2], strict=False)]
    found = YAML_BOX.search(text)
    box = [listed(line) for line in found[1].splitlines()] if found else []
    if len(box) == 4:
        # the tilt stands in a line of its own
        box = [[*line, tilt] for line, tilt in zip(box, box[3], strict=False)]
        flags = ["xy", "xz", "yz", *flags]
    keys = {"timestep": "TIMESTEP", "time": "TIME", "natoms": "NUMBER OF ATOMS"}
    sections = {keys[key]: [value] for key, value in values.items() if key in keys}
    if box:
        sections[" ".join(["BOX BOUNDS", *flags])] = [" ".join(line) for line in box]
    names = listed(values.get("keywords", ""))
    return Header(sections, names, begin if begin <= end else 0, end)


def _moment(path: Path, head: bytes) -> tuple[int, float | None] | None:
    """The step and the time of a snapshot; None if its header goes on below the next mark."""
    sections = _header(head).sections
    if sections and sections.keys() <= {"UNITS", "TIME", "TIMESTEP"}:
        return None
    step = "".join(sections.get("TIMESTEP", [])[:1]).strip()
    if not re.fullmatch(r"-?\d{1,18}", step):
        raise ReadError(
            f"{path}: expected a whole number after ITEM: TIMESTEP, found {step[:80]!r}"
        )
    try:
        return int(step), float(sections["TIME"][0]) if "TIME" in sections else None
    except (LookupError, ValueError):
        raise ReadError(f"{path}, step {step}: expected a number after ITEM: TIME") from None


def _lack(data: bytes) -> str | None:
    """What the last snapshot of a file lacks."""
    header = _header(data)
    if not header.begin:
        return "its header or its end is missing"
    last = data[data.rfind(b"\n") + 1 :].split()
    # the last line may lack its end if it lacks no word
    is_line = len(last) == max(len(header.names), 1) and not grows()
    rows = data.count(b"\n", header.begin, header.end) + is_line
    # a count that is none is told where the snapshot is read
    if header.number.isdecimal() and rows < int(header.number[:18]):
        return f"it has {rows} rows of {header.number}"
    return None


def _cell(where: str, sections: dict[str, list[str]]) -> Cell | None:
    """The box, periodic along the axes with the flag pp; very old dumps have no flags."""
    key = next((key for key in sections if key.startswith("BOX BOUNDS")), None)
    if key is None:
        return None
    where = f"{where}: ITEM: {key}"
    match = BOX_KEY.fullmatch(" ".join(key.split()))
    try:
        bounds = np.array([line.split() for line in sections[key][:3]], dtype=np.float64)
    except ValueError:
        bounds = np.zeros(0)
    if match is None or bounds.shape != (3, BOX_WIDTHS[match[1]]):
        raise ReadError(
            f"{where}: expected three boundary flags such as pp, ff, fs or mm, and three lines of "
            f"two numbers (of three with xy xz yz, of four with abc origin)"
        )
    x, y, z = (flag == "pp" for flag in (match[2] or "ff ff ff").split())
    return box_cell(where, bounds, (x, y, z))
