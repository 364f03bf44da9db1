"""Data files of LAMMPS and LIGGGHTS (``write_data``): the section Atoms is read."""

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
# a section begins with a line of words, perhaps followed by # and a style; the pattern begins with
# \n, not with ^, because Python finds it much faster
SECTION = re.compile(rb"\n[ \t]*([A-Z][A-Za-z ]*?)[ \t]*(?:#[ \t]*(\S+)[^\n]*)?\r?$", re.MULTILINE)
# keys of the box in the header: bounds and perhaps a tilt, or three vectors and their origin
BOUNDS, TILT = (b"xlo xhi", b"ylo yhi", b"zlo zhi"), b"xy xz yz"
VECTORS, ORIGIN = (b"avec", b"bvec", b"cvec"), b"abc origin"
# order of the columns; columns of other styles in a hybrid, and image flags, follow
PLAIN = ("id", "type", "diameter", "density", "x", "y", "z")
HYBRID = ("id", "type", "x", "y", "z", "diameter", "density")
STYLES = ("", "sphere", "granular", "hybrid")
FLAGS = ("ix", "iy", "iz")
# header counts of atoms that are not spheres: their third column is not a diameter
NO_SPHERES = (b"ellipsoids", b"lines", b"triangles", b"bodies")
# the first line of YADE, which writes radii in the column of diameters
OF_YADE = b"LIGGGHTS Description"


class DataFile(GrainsOnly):
    """Reads data files, for the readers of both programs."""

    # the files have no boundary flags: the user says what is periodic
    has_cell: Carries = "box"

    def recognises(self, path: Path) -> bool:
        """Recognised by the first line, or by the number of atoms and the box below it."""
        head = first_bytes(path)
        has_both = ATOMS.search(head) is not None and BOX.search(head) is not None
        return has_both or head.startswith(b"LAMMPS data file")

    def kind(self, path: Path) -> FileKind:
        """``start``, as simulations start from data files; reading may still refuse the columns."""
        return "start" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One snapshot, with the step in the first line that LAMMPS writes."""
        step = STEP.search(first_bytes(path).partition(b"\n")[0])
        return [Snapshot(path, step=None if step is None else int(step[1]))]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """
        Read the section Atoms; the atom style, or the user's numbers, say what its columns are.

        Raises
        ------
        ReadError
            If the atoms are not spheres, or a line is damaged.
        """
        path, data = snapshot.path, text_of(snapshot)
        # the first line is a comment
        sections = SECTION.finditer(data, max(data.find(b"\n"), 0))
        atoms = next((section for section in sections if section[1] == b"Atoms"), None)
        header = _header(data[: atoms.start()]) if atoms else {}
        count = header.get(b"atoms", b"")
        if atoms is None or not re.fullmatch(rb"\d{1,15}", count):
            raise ReadError(f"{path}: expected a line 'N atoms' and a section Atoms below it")
        behind = SECTION.search(data, atoms.end())
        rows = data[atoms.end() : behind.start() + 1 if behind else None]
        rows = re.sub(rb"[ \t]*#[^\n]*", b"", rows) if b"#" in rows else rows
        names = numbered(len(rows.lstrip().partition(b"\n")[0].split()) or len(PLAIN))
        id, line = options.columns.get("id", "1"), data.count(b"\n", 0, atoms.end()) + 1
        layout = Layout(tuple(names), line=line, whole=(id,))
        columns = read_rows(snapshot, rows, layout, count=int(count), what="atoms")
        cell = _cell(path, header)
        own = {*options.columns.values()}
        if not own or not own <= {*names}:
            style = (atoms[2] or b"").decode("utf-8", "replace")
            others = [kind.decode() for kind in NO_SPHERES if header.get(kind, b"0") != b"0"]
            others += [f"'Atoms # {style}'"] if style not in STYLES else []
            others += ["YADE's radii in their place"] if data.startswith(OF_YADE) else []
            if others:
                problem = f"expected diameters (atom_style sphere), found {', '.join(others)}"
                advice = '`columns="id=1,radius=3,x=5,y=6,z=7"` names the columns'
                raise ReadError(f"{path}: {problem}: {advice}")
            columns = _named(path, style, columns, cell)
        return grains_of(snapshot, columns, cell, options)


def _header(text: bytes) -> dict[bytes, bytes]:
    """The numbers before each keyword (``atoms``, ``xlo xhi``); the first line is a comment."""
    header = {}
    for line in text.splitlines()[1:]:
        words = line.partition(b"#")[0].split()
        count = next((k for k, word in enumerate(words) if word[:1].isalpha()), len(words))
        header[b" ".join(words[count:])] = b" ".join(words[:count])
    return header


def _cell(path: Path, header: dict[bytes, bytes]) -> Cell | None:
    """The box, from its bounds and its tilt, or from three vectors and an origin."""
    is_general = VECTORS[0] in header
    keys, behind = (VECTORS, ORIGIN) if is_general else (BOUNDS, TILT)
    count = 12 if is_general else 9 if behind in header else 6
    # append one number of the tilt or the origin to each of the three lines
    more = header.get(behind, b"").split()
    lines = [b" ".join([header.get(key, b""), *more[k : k + 1]]) for k, key in enumerate(keys)]
    where = f"{path}: {b', '.join((*keys, behind)[: count // 3]).decode()}"
    bounds = np.reshape(numbers(where, b" ".join(lines), count), (3, -1))
    return box_cell(path, bounds, (False, False, False), is_around=False)


@np.errstate(invalid="ignore")
def _named(path: Path, style: str, columns: Columns, cell: Cell | None) -> Columns:
    """
    Name the columns as in atom_style sphere, or as in a hybrid style with sphere.

    If the file does not name its style, it is a hybrid if it has more columns than the seven of
    atom_style sphere and three image flags. This guess is checked: ReadError if diameters or
    densities are not positive, types are not whole, or centres are outside the box.
    """
    values = list(columns.values())
    more = len(values) - len(PLAIN)
    has_flags = more >= 3 and all(np.all(column == np.rint(column)) for column in values[-3:])
    flags, more = (FLAGS, more - 3) if has_flags else ((), more)
    is_hybrid = style == "hybrid" or (more > 0 and not style)
    order = HYBRID if is_hybrid else PLAIN
    named = dict(zip(order, values, strict=False))
    problem = f"are not {' '.join(PLAIN)} (or a hybrid's {' '.join(HYBRID)})"
    fits = more >= 0 if is_hybrid else more == 0
    if fits and not style:
        # centres may lie a little outside the box, as LAMMPS wraps periodic boxes only now and then
        centres = np.column_stack([named[axis] for axis in "xyz"])
        place = np.full_like(centres, np.nan) if cell is None else cell.fractional(centres)
        expected = {
            "a positive diameter and density": (named["diameter"] > 0) & (named["density"] > 0),
            "a whole type": named["type"] % 1 == 0,
            "the centre in the box": np.all((place > -0.5) & (place < 1.5), axis=1),
        }
        for what, holds in expected.items():
            if fits and not holds.all():
                fits, atom = False, int(np.argmin(holds))
                found = " ".join(f"{column[atom]:g}" for column in values)
                problem = f"do not read as {' '.join(order)}: expected {what}, found '{found}'"
    if not fits:
        advice = '`columns="id=1,diameter=3,x=5,y=6,z=7"` names them'
        raise ReadError(f"{path}: the {len(columns)} columns below 'Atoms' {problem}: {advice}")
    names = [*order, *["mol", *list(columns)[len(PLAIN) + 1 :]][:more], *flags]
    return dict(zip(names, values, strict=True))
