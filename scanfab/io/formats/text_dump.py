"""
Text dumps of LIGGGHTS and LAMMPS: sections below ``ITEM:`` lines, and LAMMPS' ``dump yaml``.

A snapshot is a header and a table. The last ``ITEM:`` line has the names of the table's columns:
``ITEM: ATOMS id type x y z radius``. A header in YAML is translated into the same sections.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.columns import has_radius
from scanfab.io.files import first_bytes
from scanfab.io.formats import shared
from scanfab.io.reader import FileKind, Snapshot
from scanfab.io.text import CutError, Layout, read_rows, text_of
from scanfab.packing.cell import Cell

# the first line of a snapshot, as text and as YAML
MARK, YAML_MARK = re.compile(rb"ITEM: (?:UNITS|TIME|TIMESTEP)\b"), re.compile(rb"---[ \t\r]*\n")
# the words behind ITEM:, and the lines of the section
SECTION = re.compile(rb"^ITEM: ([^\r\n]*)\r?\n((?:(?!ITEM: )[^\n]*\n)*)", re.MULTILINE)
YAML_VALUE = re.compile(r"^(\w+):(.*(?:\n[ \t]+-.*)*)", re.MULTILINE)
YAML_ROWS = re.compile(rb"^data:[ \t]*\r?\n", re.MULTILINE)
YAML_KEYS = {"timestep": "TIMESTEP", "time": "TIME", "natoms": "NUMBER OF ATOMS"}
# the kind of box, and for each axis two letters for its lower and its upper face
BOX_KEY = re.compile(r"BOX BOUNDS(?: abc origin| xy xz yz)?((?: (?:pp|[fsm]{2})){3})?")
# columns of words
WORDS = ("element", "lattice")


class Header(NamedTuple):
    """The header of a snapshot, not checked yet."""

    sections: dict[str, str]
    """The text below each ``ITEM:`` line, by the words in this line."""
    words: Sequence[str] = ()
    """The words above the rows: ATOMS or ENTRIES, and the names of the columns, which dumps of old
    versions lack. Empty if the header is incomplete."""
    rows: bytes = b""
    line: int = 1
    """Line number of the first row."""


class TextDump(shared.GrainsOnly):
    """Reads text dumps, for the readers of both programs."""

    def recognises(self, path: Path) -> bool:
        """Recognised by the first words of the file."""
        head = first_bytes(path)
        is_yaml = YAML_MARK.match(head) is not None and b"creator: LAMMPS" in head[:100]
        return is_yaml or head.startswith(b"ITEM: ")

    def kind(self, path: Path) -> FileKind:
        """Atoms are grains if they have a radius, else points; entries are contacts."""
        header, _ = _whole_header(f"{path}", first_bytes(path, shared.HEADER_BYTES))
        what, *names = header.words
        return "contacts" if what != "ATOMS" else "grains" if has_radius(names) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The snapshots in the order of their steps; an incomplete last one is left out."""
        mark = YAML_MARK if first_bytes(path, 3) == b"---" else MARK
        return shared.marked_frames(path, mark, self.table, _moment)

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """
        Columns by name (or number if they have no names) and the box; only elements are words.

        Raises
        ------
        ReadError
            If the header or a line is damaged; the message names the line.
        """
        data, where = text_of(snapshot), f"{snapshot.path}, step {snapshot.step}"
        header, count = _whole_header(where, data)
        # the rows of large dumps are not held twice
        del data
        what, *names = header.words
        # LAMMPS called ids tags until 2008
        names = ["id" if name == "tag" else name for name in names]
        names = names or shared.numbered(len(header.rows.partition(b"\n")[0].split()))
        text = WORDS if what == "ATOMS" else ()
        layout = Layout(tuple(names), line=header.line, whole=("id",), text=text)
        columns = read_rows(snapshot, header.rows, layout, count=count)
        return columns, _cell(where, header.sections)


def _header(data: bytes) -> Header:
    if data.startswith(b"---"):
        return _yaml_header(data)
    sections: dict[str, str] = {}
    for section in SECTION.finditer(data[: shared.HEADER_BYTES]):
        key = section[1].decode("utf-8", "replace").strip()
        if f"NUMBER OF {key.partition(' ')[0]}" in sections:
            line = data.count(b"\n", 0, section.start(2)) + 1
            return Header(sections, key.split(), data[section.start(2) :], line)
        sections[key] = section[2].decode("utf-8", "replace").strip()
    return Header(sections)


def _whole_header(where: str, data: bytes) -> tuple[Header, int]:
    """The header and the number of rows; ReadError without it, CutError if it is cut off."""
    header = _header(data)
    number = header.sections.get(f"NUMBER OF {''.join(header.words[:1])}", "")
    if not re.fullmatch(r"\d{1,18}", number):
        expected = "a whole number after ITEM: NUMBER OF ATOMS (or ENTRIES), and names of columns"
        error = ReadError if header.words else CutError
        raise error(f"{where}: the header is incomplete: expected {expected}")
    return header, int(number)


def _yaml_header(data: bytes) -> Header:
    """The header of a YAML document, translated into the sections of a text dump."""
    begin = YAML_ROWS.search(data, 0, shared.HEADER_BYTES)
    head = data[: begin.end() if begin else shared.HEADER_BYTES]
    # the words of lists such as "- [ p, p, f, f, ]"; single brackets only, as names may have some
    values = {
        key: [word for word in value.replace(",", " ").split() if word not in ("-", "[", "]")]
        for key, value in YAML_VALUE.findall(head.decode("utf-8", "replace").replace("\r", ""))
    }
    sections = {YAML_KEYS[key]: " ".join(values[key]) for key in values if key in YAML_KEYS}
    faces, box = "".join(values.get("boundary", [])), values.get("box", [])
    tilt = box[6:9]
    if tilt:
        # YAML has the tilt behind the bounds of all axes, text dumps have it in each line
        box = [word for axis, factor in enumerate(tilt) for word in (*box[2 * axis :][:2], factor)]
    key = f"BOX BOUNDS {'xy xz yz ' * bool(tilt)}{faces[:2]} {faces[2:4]} {faces[4:]}"
    sections[key] = " ".join(box)
    if begin is None:
        return Header(sections)
    # a document ends with a line of dots
    rows = data[begin.end() : data.rfind(b"\n.") + 1 or None]
    # rows such as "  - [ 1, 0.5, ]"; they parse faster if no run of blanks is left
    rows = rows.replace(b"  - [ ", b"").replace(b"- [", b"").translate(None, b"],")
    return Header(sections, ["ATOMS", *values.get("keywords", [])], rows, head.count(b"\n") + 1)


def _moment(path: Path, head: bytes) -> tuple[int | None, float | None] | None:
    """The step and time of a snapshot; None if its header goes on behind the next mark."""
    header = _header(head)
    if header.sections and header.sections.keys() <= {"UNITS", "TIME", "TIMESTEP"}:
        return None
    if header.sections and not header.words:
        return None, None
    step, time = header.sections.get("TIMESTEP", ""), header.sections.get("TIME")
    if not re.fullmatch(r"-?\d{1,18}", step):
        raise ReadError(f"{path}: expected a whole number as ITEM: TIMESTEP, found {step[:80]!r}")
    where = f"{path}, step {step}: ITEM: TIME"
    return int(step), None if time is None else shared.numbers(where, time.encode(), 1)[0]


def _cell(where: str, sections: dict[str, str]) -> Cell | None:
    """The box, periodic along axes with the flag pp; very old dumps have no flags."""
    key = next((key for key in sections if key.startswith("BOX BOUNDS")), None)
    if key is None:
        return None
    where = f"{where}: ITEM: {key}"
    match = BOX_KEY.fullmatch(" ".join(key.split()))
    if match is None:
        raise ReadError(f"{where}: expected three boundary flags such as pp, ff, fs or mm")
    # a line has two bounds and perhaps a tilt, or a vector and a coordinate of the origin
    width, flags = 4 if "abc" in key else 3 if "xy" in key else 2, match[1] or "ff ff ff"
    bounds = np.reshape(shared.numbers(where, sections[key].encode(), 3 * width), (3, width))
    return shared.box_cell(where, bounds, [flag == "pp" for flag in flags.split()])
