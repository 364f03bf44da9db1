"""LAMMPS' ``dump yaml``: a document for each frame, which ends in three dots."""

from __future__ import annotations

import re
from pathlib import Path

from scanfab.base.errors import ReadError
from scanfab.io.columns import grain_table, has_radius
from scanfab.io.files import check_lines, plain
from scanfab.io.formats.lammps_box import dump_cell
from scanfab.io.parse.growing import leave_out_last
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell

START = re.compile(rb"\A(?:\xef\xbb\xbf)?---[ \t]*\r?\ncreator:[ \t]*LAMMPS[ \t]*\r?\n")
DATA = re.compile(rb"^data:[ \t]*\r?\n", re.MULTILINE)
BOX = re.compile(rb"^box:[ \t]*\r?\n((?:[ \t]*-[^\n]*\n){1,4})", re.MULTILINE)
BEGIN, END = (b"---", b"\xef\xbb\xbf---"), b"..."
# a header is shorter
HEADER_BYTES = 1 << 16


def is_yaml(head: bytes) -> bool:
    """Whether a file starts as such dumps do."""
    return START.match(head) is not None


def yaml_kind(head: bytes) -> FileKind:
    """Grains; without a radius they are points."""
    return "grains" if has_radius(_listed(head, "keywords")) else "points"


def index_yaml(path: Path) -> list[Snapshot]:
    """The documents; if the last one has no end, it is left out with a warning."""
    check_lines(path, plain(path))
    found: list[Snapshot] = []
    start, place = -1, 0
    with open(plain(path), "rb") as stream:
        for line in stream:
            if line.rstrip() in BEGIN:
                if start >= 0:
                    raise ReadError(f"{path}: expected ... above the document at byte {place:,}")
                start = place
            place += len(line)
            if start >= 0 and line.rstrip() == END:
                found.append(Snapshot(path, start=start, stop=place))
                start = -1
        if start >= 0 or not found:
            leave_out_last(path, len(found), "expected a line of ... at the end of a document")
        for number, one in enumerate(found):
            stream.seek(one.start)
            head = stream.read(min(HEADER_BYTES, (one.stop or 0) - one.start))
            step, time = _value(head, "timestep"), _value(head, "time")
            if not re.fullmatch(r"-?\d{1,18}", step):
                raise ReadError(f"{path}: expected timestep: and a whole number, found {step!r}")
            seconds = float(time) if re.fullmatch(r"[-+.\d]+(e[-+]?\d+)?", time) else None
            found[number] = Snapshot(path, int(step), seconds, one.start, one.stop)
    return sorted(found, key=lambda one: one.step or 0)


def read_yaml_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    Columns by their names.

    Raises
    ------
    ReadError
        If the document is not as LAMMPS writes it.
    """
    path, data = snapshot.path, text_of(snapshot)
    where = f"{path}, step {snapshot.step}"
    body, end = DATA.search(data), data.rfind(END)
    if body is None or end < body.end():
        raise ReadError(f"{where}: expected data: and rows to the end, found none")
    head = data[: body.start()]
    names, count = _listed(head, "keywords"), _value(head, "natoms")
    if not names:
        raise ReadError(f"{where}: expected keywords: [ id, ... ] above the data, found none")
    if not re.fullmatch(r"\d{1,15}", count):
        raise ReadError(f"{where}: expected natoms: and a whole number, found {count!r}")
    line = data.count(b"\n", 0, body.end()) + 1
    layout = Layout(tuple(names), line=line, whole=["id"], text=["element"])
    rows = _plain(data[body.end() : end])
    columns = read_rows(snapshot, rows, layout, count=int(count), what="atoms")
    return grain_table(path, columns, _cell(where, head), options, f", step {snapshot.step}")


def _plain(rows: bytes) -> bytes:
    """Entries such as ``- [ 1, 0.5, ]``, one a line, without their brackets and commas."""
    return rows.replace(b"- [", b"").translate(None, b"],")


def _value(head: bytes, key: str) -> str:
    """What stands behind a key at the start of a line."""
    found = re.search(rb"^" + key.encode() + rb":[ \t]*([^\r\n]*)", head, re.MULTILINE)
    return "" if found is None else found[1].decode("utf-8", "replace").strip()


def _listed(head: bytes, key: str) -> list[str]:
    """The words of a list behind a key; names of columns may have brackets of their own."""
    text = _value(head, key)
    if not (text.startswith("[") and text.endswith("]")):
        return []
    return text[1:-1].replace(",", " ").split()


def _cell(where: str, head: bytes) -> Cell | None:
    """Bounds and flags, as text dumps have them."""
    box = BOX.search(head)
    if box is None:
        return None
    lines = _plain(box[1]).decode("utf-8", "replace").splitlines()
    letters = _listed(head, "boundary")
    flags = [low + high for low, high in zip(letters[::2], letters[1::2], strict=False)]
    if len(lines) == 4:
        # the tilt stands in a line of its own
        tilts = lines.pop().split()
        lines = [f"{line} {tilt}" for line, tilt in zip(lines, tilts, strict=False)]
        flags = ["xy", "xz", "yz", *flags]
    return dump_cell(where, {" ".join(["BOX BOUNDS", *flags]): lines})
