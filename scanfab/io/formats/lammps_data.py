"""Data files of LAMMPS and LIGGGHTS (``write_data``, ``read``): the section of atoms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.io.files import first_bytes
from scanfab.io.formats.dump import Dump, box_cell, numbers_as_names
from scanfab.io.reader import Carries, FileKind, ReadOptions, Snapshot
from scanfab.io.text import Columns, Layout, read_rows, text_of
from scanfab.packing.cell import Cell

carries: Carries = "box"
FIRST_LINE = re.compile(rb"LAMMPS data file[^\n]*")
# the first line is a comment; these two must stand below it
ATOMS = re.compile(rb"^[ \t]*\d{1,15}[ \t]+atoms[ \t]*(?:#[^\n]*)?\r?$", re.MULTILINE)
BOX = re.compile(rb"^[^\n]*[ \t]xlo[ \t]+xhi\b", re.MULTILINE)
STEP = re.compile(rb"timestep = (\d{1,18})\b")
# a section begins with a line of words, at times with a style behind a #; Python finds the end of
# the line before it much faster than beginnings of lines
SECTION = re.compile(rb"\n[ \t]*([A-Z][A-Za-z ]*?)[ \t]*(?:#[ \t]*(\S+)[^\n]*)?\r?$", re.MULTILINE)
# orders of the columns; image flags, and of hybrid styles the columns of others, stand behind
PLAIN = ("id", "type", "diameter", "density", "x", "y", "z")
HYBRID = ("id", "type", "x", "y", "z", "diameter", "density")
STYLES = ("", "sphere", "granular", "hybrid")
FLAGS = ("ix", "iy", "iz")
# what atoms may be that are no spheres: their third column is a flag, not a diameter
NO_SPHERES = ("ellipsoids", "lines", "triangles", "bodies")
# YADE writes this first line, and radii in the column of diameters
OF_YADE = b"LIGGGHTS Description"


def fits(head: bytes) -> bool:
    """Whether a file starts as data files do."""
    return FIRST_LINE.match(head) is not None or (
        ATOMS.search(head) is not None and BOX.search(head) is not None
    )


def kind(path: Path) -> FileKind:
    """Grains that a simulation starts from, or an error: columns have no names."""
    return "start"


def of_liggghts(head: bytes) -> bool:
    """Whether the first line, which is free, or the version in a restart names LIGGGHTS."""
    return b"LIGGGHTS" in head.partition(b"\n")[0][:1000].upper()


def snapshots(path: Path) -> list[Snapshot]:
    """The only snapshot of a file, with the step that the first line of LAMMPS names."""
    step = STEP.search(first_bytes(path).partition(b"\n")[0])
    return [Snapshot(path, step=None if step is None else int(step[1]))]


def read(snapshot: Snapshot, options: ReadOptions) -> Dump:
    """
    The Atoms section; the box has no boundary flags, so nothing is periodic unless the user says.

    The columns have names by the order of the atom style, or numbers if the user numbers them.

    Raises
    ------
    ReadError
        If the atoms are no spheres, or a line is not as it should be.
    """
    path, data = snapshot.path, text_of(snapshot)
    # a header of one line is at most a comment
    sections = list(SECTION.finditer(data, max(data.find(b"\n"), 0)))
    place = next((place for place, one in enumerate(sections) if one[1] == b"Atoms"), None)
    if place is None:
        raise ReadError(f"{path}: expected a section Atoms, found none")
    header = _header(data[: sections[0].start()].decode("utf-8", "replace"))
    count, cell = "".join(header.get("atoms", [])), _cell(path, header)
    if not re.fullmatch(r"\d{1,15}", count):
        raise ReadError(f"{path}: expected a line 'N atoms' in the header, found none")
    begin = sections[place].end()
    end = sections[place + 1].start() + 1 if place + 1 < len(sections) else len(data)
    rows = data[begin:end]
    rows = re.sub(rb"[ \t]*#[^\n]*", b"", rows) if b"#" in rows else rows
    names = numbers_as_names(len(rows.lstrip().partition(b"\n")[0].split()) or len(PLAIN))
    own = {f"{name}" for name in options.columns.values()}
    is_numbered = bool(own) and own <= {*names}
    id = f"{options.columns.get('id', 1)}"
    layout = Layout(tuple(names), line=data.count(b"\n", 0, begin) + 1, whole=(id,))
    columns = read_rows(snapshot, rows, layout, count=int(count), what="atoms")
    if not is_numbered:
        style = (sections[place][2] or b"").decode("utf-8", "replace")
        _refuse_others(path, style, header, data)
        names = _names(path, style, columns, cell)
        columns = dict(zip(names, columns.values(), strict=True))
    return Dump(names, columns, cell)


def _header(text: str) -> dict[str, list[str]]:
    """The words before each keyword such as ``atoms`` or ``xlo xhi``; the first line is free."""
    found = {}
    for line in text.splitlines()[1:]:
        words = line.partition("#")[0].split()
        count = next((place for place, word in enumerate(words) if word[0].isalpha()), len(words))
        found[" ".join(words[count:])] = words[:count]
    return found


def _cell(path: Path, header: dict[str, list[str]]) -> Cell | None:
    """The box, from its lower and upper bounds and its tilt, or from three vectors."""
    keys = ["xlo xhi", "ylo yhi", "zlo zhi"]
    try:
        if "avec" in header:
            columns = [*zip(*(header[key] for key in ("avec", "bvec", "cvec")), strict=True)]
            columns.append(tuple(header["abc origin"]))
        else:
            columns = [*zip(*(header[key] for key in keys), strict=True)]
            columns += [tuple(header["xy xz yz"])] if "xy xz yz" in header else []
        bounds = np.array(columns, dtype=np.float64).T
    except (KeyError, ValueError):
        bounds = np.zeros((0, 0))
    if bounds.shape not in ((3, 2), (3, 3), (3, 4)):
        found = ", ".join(filter(None, header)) or "none"
        raise ReadError(
            f"{path}: expected the box in the header: two numbers before each of "
            f"{', '.join(keys)}, found {found}"
        )
    return box_cell(path, bounds, (False, False, False), is_around=False)


def _refuse_others(path: Path, style: str, header: dict[str, list[str]], data: bytes) -> None:
    """ReadError for atoms that are no spheres, and for radii among diameters."""
    if style not in STYLES:
        raise ReadError(
            f"{path}: expected 'Atoms # sphere' (atom_style sphere), found 'Atoms # {style}': "
            f"write the grains with dump custom ... id type x y z radius"
        )
    for kind in NO_SPHERES:
        if header.get(kind, ["0"]) != ["0"]:
            raise ReadError(f"{path}: expected spheres, found '{header[kind][0]} {kind}'")
    if data.startswith(OF_YADE):
        raise ReadError(
            f"{path}: YADE writes radii in the column of diameters of such files, so LIGGGHTS "
            f"takes grains for half as large as they are: say which they are to be, by "
            f'`columns="id=1,type=2,radius=3,x=5,y=6,z=7"` or by diameter=3'
        )


def _names(path: Path, style: str, columns: Columns, cell: Cell | None) -> list[str]:
    """
    The names of the columns, of atom_style sphere or of a hybrid with it.

    A file that does not name its style has the order of a hybrid if it has more columns than the
    seven of atom_style sphere and the three image flags. ReadError if diameters or densities are
    not above zero then, types are not whole, or centres are outside the box.
    """
    values = list(columns.values())
    more = len(values) - len(PLAIN)
    has_flags = more >= 3 and all(np.all(one == np.rint(one)) for one in values[-3:])
    flags, more = (FLAGS, more - 3) if has_flags else ((), more)
    order = HYBRID if style == "hybrid" or (more > 0 and not style) else PLAIN
    is_wide = more >= 0 if order is HYBRID else more == 0
    if not is_wide or not (style or _fits(dict(zip(order, values, strict=False)), cell)):
        raise ReadError(
            f"{path}: expected the columns {' '.join(PLAIN)} of atom_style sphere (or, in a hybrid "
            f"style, {' '.join(HYBRID)} and others), found {len(columns)} columns below 'Atoms' "
            f"that cannot be these: name them by their numbers, for instance "
            f'`columns="id=1,type=2,diameter=3,x=5,y=6,z=7"`'
        )
    return [*order, *["mol", *list(columns)[len(PLAIN) + 1 :]][:more], *flags]


@np.errstate(invalid="ignore")
def _fits(column: Columns, cell: Cell | None) -> bool:
    """Whether the columns can be what their names say."""
    is_positive = np.all(column["diameter"] > 0) and np.all(column["density"] > 0)
    if cell is None or not is_positive or np.any(column["type"] != np.rint(column["type"])):
        return False
    fraction = cell.fractional(np.column_stack([column[axis] for axis in "xyz"]))
    # a grain may reach out of the box, and a periodic one lie there
    return bool(np.all((fraction > -0.5) & (fraction < 1.5)))
