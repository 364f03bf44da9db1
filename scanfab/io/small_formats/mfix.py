"""MFiX: ``particle_input.dat``, of rows alone (version 1) or with a header (version 2)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import bare_name, first_bytes
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import counted_rows, text_of
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)

VERSION = re.compile(rb"\A(?:\xef\xbb\xbf)?[ \t]*Version[ \t]+(\d+\.\d+)[ \t]*\r?\n", re.IGNORECASE)
NAME = re.compile(r"(?i).*particle_input.*\.dat")
# version 1, in the plane and in space: the third or fourth column is the radius
FLAT = ["x", "y", "radius", "density", "u", "v"]
SOLID = ["x", "y", "z", "radius", "density", "u", "v", "w"]
# number of a header, and lines such as "Diameter:  F  0.0017"
VALUE = re.compile(rb"^[ \t]*(Dimension|Particles):[ \t]*(\d{1,15})\b", re.MULTILINE)
LINE = re.compile(
    rb"^[ \t]*(Phase_ID|Diameter|Density|Velocity):[ \t]*([TF])[ \t]*(\S*)", re.MULTILINE
)
RULE = re.compile(rb"^=+[ \t]*\r?\n", re.MULTILINE)
DIGITS = re.compile(rb"(?<=[\d.])[dD](?=[-+\d])")
NUMERIC = b"0123456789.+-DdEe \t\r\n"
AS_E = bytes.maketrans(b"Dd", b"ee")
HEADER_BYTES = 1 << 14


class MfixReader:
    """Reader plugin for MFiX."""

    name = "mfix"
    description = "MFiX particle_input.dat, versions 1 (rows alone) and 2"
    extensions: tuple[str, ...] = (".dat",)

    def recognises(self, path: Path) -> bool:
        """By the first line; rows alone by the name that MFiX looks for, and their number."""
        head = first_bytes(path, HEADER_BYTES)
        if VERSION.match(head) is not None:
            return b"Dimension:" in head and b"Particles:" in head
        first = head.partition(b"\n")[0].split()
        return NAME.fullmatch(bare_name(path)) is not None and len(first) in (len(FLAT), len(SOLID))

    def kind(self, path: Path) -> FileKind:
        """Grains; rows alone by another name may be anything."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One: what a run begins with."""
        return [Snapshot(path)]

    def carries(self, path: Path) -> Carries:
        """It has no cell."""
        return "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Rows of numbers, with D or E exponents."""
        data = text_of(snapshot)
        version = VERSION.match(data)
        if version is None:
            return grain_table(snapshot.path, _rows_alone(snapshot, data), None, options)
        if version[1] != b"2.0":
            raise ReadError(
                f"{snapshot.path}: expected version 2.0, found {version[1].decode()}: read it as a "
                f"table: --format table --skip N --columns ..."
            )
        return grain_table(snapshot.path, _with_header(snapshot, data), None, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """It has none."""
        raise ReadError(f"{snapshot.path}: particle_input.dat holds no contacts")


Columns = dict[str, npt.NDArray[np.float64]]


def _rows_alone(snapshot: Snapshot, data: bytes) -> Columns:
    widths = (len(SOLID), len(FLAT))
    values = _numbers(snapshot, data, 0, widths=widths, names="x y z radius density u v w")
    names = FLAT if values.shape[1] == len(FLAT) else SOLID
    return _in_space(dict(zip(names, values.T, strict=True)))


def _with_header(snapshot: Snapshot, data: bytes) -> Columns:
    """Which variables stand in the rows is said above them, with the values of the others."""
    path = snapshot.path
    head = data[:HEADER_BYTES]
    numbers = {name: int(number) for name, number in VALUE.findall(head)}
    if numbers.get(b"Dimension") not in (2, 3) or b"Particles" not in numbers:
        raise ReadError(f"{path}: expected lines 'Dimension: 2 or 3' and 'Particles: N'")
    variables = {name: (read == b"T", default) for name, read, default in LINE.findall(head)}
    missing = {b"Phase_ID", b"Diameter", b"Density", b"Velocity"} - variables.keys()
    if missing:
        lost = b", ".join(sorted(missing)).decode()
        raise ReadError(f"{path}: expected lines 'NAME: T or F, default', found none of {lost}")
    axes = "xyz"[: numbers[b"Dimension"]]
    names = list(axes)
    singles = ((b"Phase_ID", "phase_id"), (b"Diameter", "diameter"), (b"Density", "density"))
    names += [own for name, own in singles if variables[name][0]]
    if variables[b"Velocity"][0]:
        names += list("uvw"[: len(axes)])
    # temperature, species and whatever else stands behind
    rules = list(RULE.finditer(head))
    begin = rules[-1].end() if rules else 0
    values = _numbers(
        snapshot,
        data,
        begin,
        count=numbers[b"Particles"],
        widths=tuple(range(len(names), len(names) + 40)),
        names="particles",
    )
    more = [f"{place + 1}" for place in range(len(names), values.shape[1])]
    columns = dict(zip([*names, *more], values.T, strict=True))
    if "diameter" not in columns:
        columns["diameter"] = np.full(len(values), _default(snapshot, variables[b"Diameter"][1]))
    return _in_space(columns)


def _default(snapshot: Snapshot, word: bytes) -> float:
    try:
        return float(DIGITS.sub(b"e", word))
    except ValueError:
        raise ReadError(
            f"{snapshot.path}: Diameter: expected T, or F and a number, found "
            f"{word[:50].decode('utf-8', 'replace')!r}"
        ) from None


def _numbers(
    snapshot: Snapshot,
    data: bytes,
    begin: int,
    *,
    widths: tuple[int, ...],
    names: str,
    count: int | None = None,
) -> FloatArray:
    rows = data[begin:]
    if b"D" in rows or b"d" in rows:
        # the quick way would spell the words of messages otherwise
        has_words = bool(rows.translate(None, NUMERIC))
        rows = DIGITS.sub(b"e", rows) if has_words else rows.translate(AS_E)
    text = data[:begin] + rows
    return counted_rows(snapshot, text, begin, len(text), widths=widths, names=names, count=count)


def _in_space(columns: Columns) -> Columns:
    if "z" not in columns:
        columns["z"] = np.zeros(len(columns["x"]))
    return columns
