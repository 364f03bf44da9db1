"""MFiX: ``particle_input.dat``, of rows alone (version 1) or with a header (version 2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.shared import GrainsOnly, numbers
from scanfab.io.reader import Carries, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, text_of
from scanfab.packing.cell import Cell

VERSION = re.compile(rb"[ \t]*Version[ \t]+(\d+\.\d+)[ \t]*\r?\n", re.IGNORECASE)
NAME = re.compile(r"(?i).*particle_input.*\.dat")
# version 1 by its number of columns, in the plane and in space
ALONE = {
    6: ("x", "y", "radius", "density", "u", "v"),
    8: ("x", "y", "z", "radius", "density", "u", "v", "w"),
}
# numbers of a header, and lines such as "Diameter:  F  0.0017": whether a column has the values, or
# what all grains have
VALUE = re.compile(rb"^[ \t]*(Dimension|Particles):[ \t]*(\d{1,15})\b", re.MULTILINE)
LINE = re.compile(
    rb"^[ \t]*(Phase_ID|Diameter|Density|Velocity):[ \t]*([TF])[ \t]*(\S*)", re.MULTILINE
)
NAMES = {b"Phase_ID": ["phase_id"], b"Diameter": ["diameter"], b"Density": ["density"]}
NAMES |= {b"Velocity": ["u", "v", "w"]}
RULE = re.compile(rb"^=+[ \t]*\r?\n", re.MULTILINE)
HEADER_BYTES = 1 << 14


class MfixReader(GrainsOnly):
    """Reader plugin for MFiX."""

    name = "mfix"
    description = "MFiX particle_input.dat, versions 1 (rows alone) and 2"
    extensions: tuple[str, ...] = (".dat",)
    has_cell: Carries = "nothing"

    def recognises(self, path: Path) -> bool:
        """By the first line; rows alone by the name that MFiX looks for, and their width."""
        head = first_bytes(path, HEADER_BYTES)
        if VERSION.match(head) is not None:
            return b"Dimension:" in head and b"Particles:" in head
        return NAME.fullmatch(bare_name(path)) is not None and _width(head) in ALONE

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """Rows of numbers, with Fortran's exponents (5d-3) or others."""
        data = text_of(snapshot)
        begin, count, diameter = 0, None, None
        names = ALONE.get(_width(data), ALONE[8])
        if VERSION.match(data):
            begin, count, names, diameter = _header(snapshot.path, data)
        layout = Layout(names, line=data.count(b"\n", 0, begin) + 1)
        rows = _with_e(data[begin:])
        columns = read_rows(snapshot, rows, layout, count=count, what="particles")
        if diameter is not None:
            columns["diameter"] = np.full(len(columns["x"]), diameter)
        return columns, None


def _width(text: bytes) -> int:
    return len(text.partition(b"\n")[0].split())


def _with_e(text: bytes) -> bytes:
    """Numbers with e in place of Fortran's d."""
    return text.replace(b"D", b"E").replace(b"d", b"e")


def _header(path: Path, data: bytes) -> tuple[int, int, tuple[str, ...], float | None]:
    """Where the rows begin, how many there are, their columns, and the diameter of all grains."""
    head = data[:HEADER_BYTES]
    values = {name: int(number) for name, number in VALUE.findall(head)}
    lines = {name: (letter == b"T", default) for name, letter, default in LINE.findall(head)}
    dimension = values.get(b"Dimension")
    version = VERSION.match(head)
    assert version is not None
    lost = sorted(NAMES.keys() - lines.keys())
    if version[1] != b"2.0" or dimension not in (2, 3) or b"Particles" not in values or lost:
        raise ReadError(
            f"{path}: expected version 2.0, found {version[1].decode()}, with 'Dimension: 2 or 3', "
            f"'Particles: N' and lines 'NAME: T or F, default', found none of "
            f"{b', '.join(lost).decode() or 'these numbers'}: read it as a table: --format table "
            f"--skip N --columns ..."
        )
    names = list("xyz"[:dimension])
    for name, own in NAMES.items():
        names += own[:dimension] if lines[name][0] else []
    begin = max((rule.end() for rule in RULE.finditer(head)), default=0)
    # temperature, species and the like stand behind, and have no names
    names += [f"{place + 1}" for place in range(len(names), _width(data[begin:]))]
    is_column, default = lines[b"Diameter"]
    where = f"{path}: Diameter: expected T, or F and a number"
    diameter = None if is_column else numbers(where, _with_e(default), 1)[0]
    return begin, values[b"Particles"], tuple(names), diameter
