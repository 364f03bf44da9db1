"""MFiX: ``particle_input.dat``, of rows alone (version 1) or with a header (version 2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.columns import grain_table
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.shared import GrainsOnly, numbers
from scanfab.io.reader import Carries, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of

VERSION = re.compile(rb"\A(?:\xef\xbb\xbf)?[ \t]*Version[ \t]+(\d+\.\d+)[ \t]*\r?\n", re.IGNORECASE)
NAME = re.compile(r"(?i).*particle_input.*\.dat")
# version 1 by its number of columns, in the plane and in space
ALONE = {
    6: ("x", "y", "radius", "density", "u", "v"),
    8: ("x", "y", "z", "radius", "density", "u", "v", "w"),
}
# numbers of a header, and lines such as "Diameter:  F  0.0017"
VALUE = re.compile(rb"^[ \t]*(Dimension|Particles):[ \t]*(\d{1,15})\b", re.MULTILINE)
LINE = re.compile(
    rb"^[ \t]*(Phase_ID|Diameter|Density|Velocity):[ \t]*([TF])[ \t]*(\S*)", re.MULTILINE
)
RULE = re.compile(rb"^=+[ \t]*\r?\n", re.MULTILINE)
HEADER_BYTES = 1 << 14


class MfixReader(GrainsOnly):
    """Reader plugin for MFiX."""

    name = "mfix"
    description = "MFiX particle_input.dat, versions 1 (rows alone) and 2"
    extensions: tuple[str, ...] = (".dat",)

    def recognises(self, path: Path) -> bool:
        """By the first line; rows alone by the name that MFiX looks for, and their width."""
        head = first_bytes(path, HEADER_BYTES)
        if VERSION.match(head) is not None:
            return b"Dimension:" in head and b"Particles:" in head
        return NAME.fullmatch(bare_name(path)) is not None and _width(head) in ALONE

    def carries(self, path: Path) -> Carries:
        """It has no cell."""
        return "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Rows of numbers, with Fortran's exponents (5d-3) or others."""
        path, data = snapshot.path, text_of(snapshot)
        version = VERSION.match(data)
        if version is not None and version[1] != b"2.0":
            raise ReadError(
                f"{path}: expected version 2.0, found {version[1].decode()}: read it as a table: "
                f"--format table --skip N --columns ..."
            )
        begin, count, diameter = 0, None, None
        names = ALONE.get(_width(data), ALONE[8])
        if version is not None:
            begin, count, names, diameter = _header(path, data)
        rows = data[begin:].replace(b"D", b"E").replace(b"d", b"e")
        layout = Layout(names, line=data.count(b"\n", 0, begin) + 1)
        columns = read_rows(snapshot, rows, layout, count=count, what="particles")
        if diameter is not None:
            columns["diameter"] = np.full(len(columns["x"]), diameter)
        if "z" not in columns:
            columns["z"] = np.zeros(len(columns["x"]))
        return grain_table(path, columns, None, options)


def _width(text: bytes) -> int:
    return len(text.partition(b"\n")[0].split())


def _header(path: Path, data: bytes) -> tuple[int, int, tuple[str, ...], float | None]:
    """Where the rows begin, how many there are, their columns, and the diameter of all grains."""
    head = data[:HEADER_BYTES]
    values = {name: int(number) for name, number in VALUE.findall(head)}
    dimension = values.get(b"Dimension")
    if dimension not in (2, 3) or b"Particles" not in values:
        raise ReadError(f"{path}: expected lines 'Dimension: 2 or 3' and 'Particles: N'")
    variables = {name: (read == b"T", default) for name, read, default in LINE.findall(head)}
    missing = {b"Phase_ID", b"Diameter", b"Density", b"Velocity"} - variables.keys()
    if missing:
        lost = b", ".join(sorted(missing)).decode()
        raise ReadError(f"{path}: expected lines 'NAME: T or F, default', found none of {lost}")
    names = list("xyz"[:dimension])
    singles = ((b"Phase_ID", "phase_id"), (b"Diameter", "diameter"), (b"Density", "density"))
    names += [name for variable, name in singles if variables[variable][0]]
    if variables[b"Velocity"][0]:
        names += list("uvw"[:dimension])
    begin = max((rule.end() for rule in RULE.finditer(head)), default=0)
    # temperature, species and the like stand behind, and have no names
    width = _width(data[begin:])
    names += [f"{place + 1}" for place in range(len(names), width)]
    is_read, default = variables[b"Diameter"]
    diameter = None
    if not is_read:
        where = f"{path}: Diameter: expected T, or F and a number"
        diameter = numbers(where, default.replace(b"D", b"E").replace(b"d", b"e"), 1)[0]
    return begin, values[b"Particles"], tuple(names), diameter
