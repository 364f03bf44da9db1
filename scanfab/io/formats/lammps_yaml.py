"""LAMMPS' ``dump yaml``: a document for each frame, which ends in three dots."""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO

from scanfab.base.errors import ReadError
from scanfab.io.files import plain
from scanfab.io.formats.columns import grain_table, has_radius
from scanfab.io.formats.lammps_box import dump_cell
from scanfab.io.parse.counted_rows import counted_rows, text_of
from scanfab.io.parse.growing import warn_incomplete
from scanfab.io.parse.number_rows import exact_column
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

START = re.compile(rb"\A(?:\xef\xbb\xbf)?---[ \t]*\r?\ncreator:[ \t]*LAMMPS[ \t]*\r?\n")
DATA = re.compile(rb"^data:[ \t]*\r?\n", re.MULTILINE)
BEGIN, END = b"---", b"..."
MARK = b"\xef\xbb\xbf"
# bytes that are searched at a time
PIECE = 1 << 20
# a header never comes near this size
HEADER_BYTES = 1 << 16


def is_yaml(head: bytes) -> bool:
    """Whether a file starts as such dumps do."""
    return START.match(head) is not None


def yaml_kind(head: bytes) -> FileKind:
    """Grains; without a radius they are points."""
    return "grains" if has_radius(_listed(head, b"keywords")) else "points"


def index_yaml(path: Path) -> list[Snapshot]:
    """The documents; a last one without its end is left out with a warning if there are others."""
    with open(plain(path), "rb") as stream:
        starts, ends = _borders(stream)
        if len(ends) == len(starts) - 1 and ends:
            warn_incomplete(
                f"{path}: the last snapshot, number {len(starts)}, is incomplete and is left out"
            )
            starts.pop()
        if not starts or len(starts) != len(ends):
            raise ReadError(
                f"{path}: expected documents between lines of --- and ..., found {len(starts)} "
                f"beginnings and {len(ends)} ends: the file is incomplete"
            )
        found = []
        for start, stop in zip(starts, ends, strict=True):
            stream.seek(start)
            head = stream.read(min(HEADER_BYTES, max(stop - start, 0)))
            found.append(_snapshot(path, head, start, stop))
    return sorted(found, key=lambda one: one.step or 0)


def _borders(stream: IO[bytes]) -> tuple[list[int], list[int]]:
    """First bytes of the lines that begin documents, and those behind the lines that end them."""
    found: dict[bytes, list[int]] = {BEGIN: [], END: []}
    place = 0
    # whole lines, so that no border is cut in two
    while piece := stream.read(PIECE) + stream.readline(HEADER_BYTES):
        data = b"\n" + piece
        if place == 0 and piece.startswith(MARK + BEGIN):
            data = b"\n" * (1 + len(MARK)) + piece.removeprefix(MARK)
        for word, places in found.items():
            at = data.find(b"\n" + word)
            while at >= 0:
                end = data.find(b"\n", at + 1)
                end = len(data) if end < 0 else end + 1
                if data[at + 1 : end].rstrip() == word:
                    places.append(place + (at if word == BEGIN else end - 1))
                at = data.find(b"\n" + word, end - 1)
        place += len(piece)
    return found[BEGIN], found[END]


def read_yaml_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    Columns by their names.

    Raises
    ------
    ReadError
        If the document is not as LAMMPS writes it.
    """
    path, data = snapshot.path, text_of(snapshot)
    body = DATA.search(data)
    end = data.rfind(END)
    if body is None or end < body.end():
        raise ReadError(f"{path}: expected data: and rows to the end, found none")
    head = data[: body.start()]
    names = _listed(head, b"keywords")
    if not names:
        raise ReadError(f"{path}: expected keywords: [ id, ... ] above the data, found none")
    rows = _plain(data[body.end() : end])
    text = data[: body.end()] + rows
    count = _value(head, b"natoms")
    if not re.fullmatch(r"\d{1,15}", count):
        raise ReadError(f"{path}: expected natoms: and a whole number, found {count!r}")
    values = counted_rows(
        snapshot,
        text,
        body.end(),
        len(text),
        count=int(count),
        widths=(len(names),),
        names="atoms",
    )
    columns = {name: values[:, names.index(name)] for name in names}
    if "id" in columns:
        columns["id"] = exact_column(values, rows, names.index("id"))
    return grain_table(path, columns, _cell(path, head), options, f", step {snapshot.step}")


def _snapshot(path: Path, head: bytes, start: int, stop: int) -> Snapshot:
    step, time = _value(head, b"timestep"), _value(head, b"time")
    if not re.fullmatch(r"-?\d{1,18}", step):
        raise ReadError(f"{path}: expected timestep: and a whole number, found {step!r}")
    try:
        seconds = float(time)
    except ValueError:
        seconds = None
    return Snapshot(path, int(step), seconds, start, stop)


def _plain(rows: bytes) -> bytes:
    """Entries such as ``- [ 1, 0.5, ]``, one a line, without their brackets and commas."""
    return rows.replace(b"- [", b"").translate(None, b"],")


def _value(head: bytes, key: bytes) -> str:
    """What stands behind a key at the start of a line."""
    found = re.search(rb"^" + key + rb":[ \t]*([^\r\n]*)", head, re.MULTILINE)
    return "" if found is None else found[1].decode("utf-8", "replace").strip()


def _listed(head: bytes, key: bytes) -> list[str]:
    """The words of a list behind a key; names of columns may have brackets of their own."""
    text = _value(head, key)
    if not (text.startswith("[") and text.endswith("]")):
        return []
    return text[1:-1].replace(",", " ").split()


def _cell(path: Path, head: bytes) -> Cell | None:
    """Bounds and flags, as text dumps have them."""
    box = re.search(rb"^box:[ \t]*\r?\n((?:[ \t]*-[^\n]*\n){1,4})", head, re.MULTILINE)
    if box is None:
        return None
    lines = _plain(box[1]).decode("utf-8", "replace").splitlines()
    letters = _listed(head, b"boundary")
    flags = [letters[place] + letters[place + 1] for place in range(0, len(letters) - 1, 2)]
    if len(lines) == 4:
        # the tilt stands in a line of its own
        tilts = lines.pop().split()
        lines = [f"{line} {tilt}" for line, tilt in zip(lines, tilts, strict=False)]
        flags = ["xy", "xz", "yz", *flags]
    return dump_cell(f"{path}", {" ".join(["BOX BOUNDS", *flags]): lines})
