"""MFiX: ``particle_input.dat``, either rows only (version 1) or with a header (version 2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.shared import GrainsOnly, in_space, numbers
from scanfab.io.reader import Carries, Snapshot
from scanfab.io.text import Layout, read_rows, spelt, text_of
from scanfab.packing.cell import Cell

VERSION = re.compile(rb"[ \t]*Version[ \t]+(\d+\.\d+)[ \t]*\r?\n", re.IGNORECASE)
NAME = re.compile(r"(?i).*particle_input.*\.dat")
# columns of version 1, in 2D (six) and in 3D (eight)
ALONE = {6: "x y radius density u v", 8: "x y z radius density u v w"}
# a line of the header: "Particles:  2000", or "Diameter:  F  0.0017"; T means that a column has the
# values, F that all grains have the value in this line
FIELD = re.compile(rb"^[ \t]*(\w+):[ \t]*(\S*)[ \t]*(\S*)", re.MULTILINE)
ASKED = (b"Dimension", b"Particles", b"Phase_ID", b"Diameter", b"Density", b"Velocity")
ANSWERS = re.compile(rb"[23] \d{1,15}(?: [TF]){4}")
RULE = re.compile(rb"^=+[ \t]*\r?\n", re.MULTILINE)
HEADER_BYTES = 1 << 14


class MfixReader(GrainsOnly):
    """Reader plugin for MFiX."""

    name = "mfix"
    description = "MFiX particle_input.dat, versions 1 (rows alone) and 2"
    extensions: tuple[str, ...] = (".dat",)
    has_cell: Carries = "nothing"

    def recognises(self, path: Path) -> bool:
        """Version 2 by its header, version 1 by the file name and the number of columns."""
        head = first_bytes(path, HEADER_BYTES)
        if VERSION.match(head):
            return b"Dimension:" in head and b"Particles:" in head
        return bool(NAME.fullmatch(bare_name(path))) and _width(head) in ALONE

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The columns of the grains, without a cell. Numbers may be Fortran's (5d-3)."""
        path, data = snapshot.path, text_of(snapshot)
        version = VERSION.match(data)
        if version is None:
            layout = Layout(tuple(ALONE.get(_width(data), ALONE[8]).split()))
            return in_space(read_rows(snapshot, data, layout)), None
        begin = max((rule.end() for rule in RULE.finditer(data[:HEADER_BYTES])), default=0)
        fields = {name: words for name, *words in FIELD.findall(data[:begin])}
        answers = b" ".join(fields.get(name, [b""])[0] for name in ASKED)
        if version[1] != b"2.0" or not ANSWERS.fullmatch(answers):
            raise ReadError(
                f"{path}: expected version 2.0 with 2 or 3, a number, T or F ... for "
                f"{b', '.join(ASKED).decode()}, found {version[1].decode()} with {spelt(answers)}"
            )
        dimension, count = (int(word) for word in answers.split()[:2])
        names = [*"xyz"[:dimension]]
        for name in ASKED[2:]:
            own = ["u", "v", "w"][:dimension] if name == b"Velocity" else [name.decode().lower()]
            names += own if fields[name][0] == b"T" else []
        # temperature, species and others follow; they have no names here
        names += [f"{place + 1}" for place in range(len(names), _width(data[begin:]))]
        layout = Layout(tuple(names), line=data.count(b"\n", 0, begin) + 1)
        columns = read_rows(snapshot, data[begin:], layout, count=count, what="particles")
        if "diameter" not in columns:
            where, word = f"{path}: Diameter: expected T, or F and a number", fields[b"Diameter"][1]
            diameter = numbers(where, word.upper().replace(b"D", b"E"), 1)
            columns["diameter"] = np.full(len(columns["x"]), diameter)
        return in_space(columns), None


def _width(text: bytes) -> int:
    return len(text.partition(b"\n")[0].split())
