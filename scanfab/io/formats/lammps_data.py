"""Data files of LAMMPS and LIGGGHTS (``write_data``, ``read``): the section of atoms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly, box_cell, grains_of, numbered, numbers
from scanfab.io.reader import Carries, FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell

# the first line is a comment; these two must stand below it
ATOMS = re.compile(rb"^[ \t]*\d{1,15}[ \t]+atoms[ \t]*(?:#[^\n]*)?\r?$", re.MULTILINE)
BOX = re.compile(rb"^[^\n]*[ \t]xlo[ \t]+xhi\b", re.MULTILINE)
STEP = re.compile(rb"timestep = (\d{1,18})\b")
# a section begins with a line of words, at times with a style behind a #; Python finds the end of
# the line before it much faster than beginnings of lines
SECTION = re.compile(rb"\n[ \t]*([A-Z][A-Za-z ]*?)[ \t]*(?:#[ \t]*(\S+)[^\n]*)?\r?$", re.MULTILINE)
# the box in the header: bounds and perhaps a tilt, or vectors and their origin
BOUNDS, TILT = (b"xlo xhi", b"ylo yhi", b"zlo zhi"), b"xy xz yz"
VECTORS, ORIGIN = (b"avec", b"bvec", b"cvec"), b"abc origin"
# order of the columns; image flags and the columns of other styles of a hybrid stand behind them
PLAIN = ("id", "type", "diameter", "density", "x", "y", "z")
HYBRID = ("id", "type", "x", "y", "z", "diameter", "density")
STYLES = ("", "sphere", "granular", "hybrid")
FLAGS = ("ix", "iy", "iz")
# atoms that are not spheres: their third column is a flag instead of a diameter
NO_SPHERES = (b"ellipsoids", b"lines", b"triangles", b"bodies")
# YADE writes this first line, and radii in the column of diameters
OF_YADE = b"LIGGGHTS Description"


class DataFile(GrainsOnly):
    """What DumpReader needs of data files."""

    # without boundary flags nothing is periodic unless the user says so
    has_cell: Carries = "box"

    def recognises(self, path: Path) -> bool:
        """By the first line, or the number of atoms and the box below it."""
        head = first_bytes(path)
        has_both = ATOMS.search(head) is not None and BOX.search(head) is not None
        return has_both or head.startswith(b"LAMMPS data file")

    def kind(self, path: Path) -> FileKind:
        """Grains that a simulation starts from, or an error: columns have no names."""
        return "start" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, with the step that the first line of LAMMPS names."""
        step = STEP.search(first_bytes(path).partition(b"\n")[0])
        return [Snapshot(path, step=None if step is None else int(step[1]))]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """
        The Atoms section, by the order of the atom style, or by numbers if the user numbers it.

        Raises
        ------
        ReadError
            If the atoms are no spheres, or a line is not as it should be.
        """
        path, data = snapshot.path, text_of(snapshot)
        # a header of one line is at most a comment
        sections = SECTION.finditer(data, max(data.find(b"\n"), 0))
        atoms = next((one for one in sections if one[1] == b"Atoms"), None)
        header = _header(data[: atoms.start()]) if atoms else {}
        count = header.get(b"atoms", b"")
        if atoms is None or not re.fullmatch(rb"\d{1,15}", count):
            raise ReadError(f"{path}: expected a line 'N atoms' and a section Atoms below it")
        behind = SECTION.search(data, atoms.end())
        rows = data[atoms.end() : behind.start() + 1 if behind else None]
        rows = re.sub(rb"[ \t]*#[^\n]*", b"", rows) if b"#" in rows else rows
        names = numbered(len(rows.lstrip().partition(b"\n")[0].split()) or len(PLAIN))
        id, line = f"{options.columns.get('id', 1)}", data.count(b"\n", 0, atoms.end()) + 1
        layout = Layout(tuple(names), line=line, whole=(id,))
        columns = read_rows(snapshot, rows, layout, count=int(count), what="atoms")
        cell = _cell(path, header)
        own = {f"{name}" for name in options.columns.values()}
        if not own or not own <= {*names}:
            style = (atoms[2] or b"").decode("utf-8", "replace")
            others = [one.decode() for one in NO_SPHERES if header.get(one, b"0") != b"0"]
            others += [f"'Atoms # {style}'"] if style not in STYLES else []
            others += ["YADE's radii in their place"] if data.startswith(OF_YADE) else []
            if others:
                told = f"expected diameters (atom_style sphere), found {', '.join(others)}"
                advice = '`columns="id=1,radius=3,x=5,y=6,z=7"` names the columns'
                raise ReadError(f"{path}: {told}: {advice}")
            columns = _named(path, style, columns, cell)
        return grains_of(snapshot, columns, cell, options)


def _header(text: bytes) -> dict[bytes, bytes]:
    """The numbers before each keyword such as ``atoms`` or ``xlo xhi``; the first line is free."""
    found = {}
    for line in text.splitlines()[1:]:
        words = line.partition(b"#")[0].split()
        count = next((k for k, word in enumerate(words) if word[:1].isalpha()), len(words))
        found[b" ".join(words[count:])] = b" ".join(words[:count])
    return found


def _cell(path: Path, header: dict[bytes, bytes]) -> Cell | None:
    """The box, from its lower and upper bounds and its tilt, or from three vectors."""
    is_general = VECTORS[0] in header
    keys, behind = (VECTORS, ORIGIN) if is_general else (BOUNDS, TILT)
    count = 12 if is_general else 9 if behind in header else 6
    # the tilt or the origin has a number for each line above it
    more = header.get(behind, b"").split()
    lines = [b" ".join([header.get(key, b""), *more[k : k + 1]]) for k, key in enumerate(keys)]
    where = f"{path}: {b', '.join((*keys, behind)[: count // 3]).decode()}"
    bounds = np.reshape(numbers(where, b" ".join(lines), count), (3, -1))
    return box_cell(path, bounds, (False, False, False), is_around=False)


@np.errstate(invalid="ignore")
def _named(path: Path, style: str, columns: Columns, cell: Cell | None) -> Columns:
    """
    The columns by the names of atom_style sphere or of a hybrid with it.

    A file that does not name its style has the order of a hybrid if it has more columns than the
    seven of atom_style sphere and the three image flags. ReadError if diameters or densities are
    not above zero then, types are not whole, or centres are outside the box.
    """
    values = list(columns.values())
    more = len(values) - len(PLAIN)
    has_flags = more >= 3 and all(np.all(one == np.rint(one)) for one in values[-3:])
    flags, more = (FLAGS, more - 3) if has_flags else ((), more)
    is_hybrid = style == "hybrid" or (more > 0 and not style)
    order = HYBRID if is_hybrid else PLAIN
    named = dict(zip(order, values, strict=False))
    fits = more >= 0 if is_hybrid else more == 0
    if fits and not style:
        # grains may reach out of the box, and lie outside of a periodic one
        centres = np.column_stack([named[axis] for axis in "xyz"])
        place = np.full_like(centres, np.nan) if cell is None else cell.fractional(centres)
        are_inside, are_whole = (place > -0.5) & (place < 1.5), named["type"] % 1 == 0
        are_sizes = (named["diameter"] > 0) & (named["density"] > 0)
        fits = bool(are_inside.all() and are_whole.all() and are_sizes.all())
    if not fits:
        told = f"are not {' '.join(PLAIN)} (or a hybrid's {' '.join(HYBRID)})"
        advice = '`columns="id=1,diameter=3,x=5,y=6,z=7"` names them'
        raise ReadError(f"{path}: the {len(columns)} columns below 'Atoms' {told}: {advice}")
    names = [*order, *["mol", *list(columns)[len(PLAIN) + 1 :]][:more], *flags]
    return dict(zip(names, values, strict=True))
