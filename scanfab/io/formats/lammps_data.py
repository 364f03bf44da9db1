"""Data files of LAMMPS and LIGGGHTS (``write_data``, ``read_data``): the section of atoms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.lengths import MOST
from scanfab.base.typing import FloatArray
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.counted_rows import counted_rows, text_of
from scanfab.io.parse.lammps_box import box_vectors
from scanfab.io.parse.number_rows import exact_column
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell

FIRST_LINE = re.compile(rb"\A(?:\xef\xbb\xbf)?LAMMPS data file[^\n]*")
# the first line is a comment; these two must stand below it
ATOMS = re.compile(rb"^[ \t]*\d{1,15}[ \t]+atoms[ \t]*(?:#[^\n]*)?\r?$", re.MULTILINE)
BOX = re.compile(rb"^[^\n]*[ \t]xlo[ \t]+xhi\b", re.MULTILINE)
STEP = re.compile(rb"timestep = (\d{1,18})\b")
# orders of the columns; image flags, and of hybrid styles the columns of others, stand behind
PLAIN = ("id", "type", "diameter", "density", "x", "y", "z")
HYBRID = ("id", "type", "x", "y", "z", "diameter", "density")
FLAGS = ("ix", "iy", "iz")
MOST_COLUMNS = 40
# what atoms may be that are no spheres: their third column is a flag, not a diameter
NO_SPHERES = ("ellipsoids", "lines", "triangles", "bodies")
# YADE writes this first line, and radii in the column of diameters
OF_YADE = b"LIGGGHTS Description"

# a section is a line that starts with a word, behind the header; found with the end of the line
# before it, for which Python looks much faster than for the beginnings of lines
SECTION = re.compile(rb"\n[ \t]*([A-Z][A-Za-z ]*?)[ \t]*(?:#[ \t]*(\S+)[^\n]*)?\r?$", re.MULTILINE)


def is_data_file(head: bytes) -> bool:
    """Whether a file starts as data files do."""
    return FIRST_LINE.match(head) is not None or (
        # most files that are asked about are dumps, in which a search takes longer
        not head.startswith(b"ITEM:")
        and ATOMS.search(head) is not None
        and BOX.search(head) is not None
    )


def of_liggghts(head: bytes) -> bool:
    """Whether the first line, which is free, names LIGGGHTS."""
    return b"LIGGGHTS" in head.partition(b"\n")[0].upper()


def step_of_data(head: bytes) -> int | None:
    """The step that the first line names."""
    first = FIRST_LINE.match(head)
    step = None if first is None else STEP.search(first[0])
    return None if step is None else int(step[1])


def read_data_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    The Atoms section; the box has no boundary flags, so nothing is periodic unless the user says.

    Raises
    ------
    ReadError
        If the atoms are no spheres, or a line is not as it should be.
    """
    path, data = snapshot.path, text_of(snapshot)
    # a header of one line is at most a comment
    sections = list(SECTION.finditer(data, max(data.find(b"\n"), 0)))
    atoms = next((place for place, one in enumerate(sections) if one[1] == b"Atoms"), None)
    if atoms is None:
        raise ReadError(f"{path}: expected a section Atoms, found none")
    header = data[: sections[0].start() + 1].decode("utf-8", "replace").splitlines()
    begin = sections[atoms].end()
    end = sections[atoms + 1].start() + 1 if atoms + 1 < len(sections) else len(data)
    values = counted_rows(
        snapshot,
        data,
        begin,
        end,
        count=_counted(path, header),
        widths=(len(PLAIN), *range(4, MOST_COLUMNS)),
        names="atoms",
    )
    cell = _cell(path, header)
    if options.columns and all(f"{own}".isdecimal() for own in options.columns.values()):
        names = tuple(f"{place + 1}" for place in range(values.shape[1]))
    else:
        style = (sections[atoms][2] or b"").decode("utf-8", "replace")
        _refuse_others(path, style, header, data)
        names = _names(path, style, values, cell)
    columns = {name: values[:, place] for place, name in enumerate(names)}
    id = options.columns.get("id", "id")
    if id in columns:
        columns[id] = exact_column(values, data[begin:end], names.index(id))
    return grain_table(path, columns, cell, options)


def _counted(path: Path, header: list[str]) -> int:
    for line in header:
        words = line.split()
        if words[1:2] == ["atoms"] and re.fullmatch(r"\d{1,15}", words[0]):
            return int(words[0])
    raise ReadError(f"{path}: expected a line 'N atoms' in the header, found none")


def _refuse_others(path: Path, style: str, header: list[str], data: bytes) -> None:
    """ReadError for atoms that are no spheres, and for radii among diameters."""
    if style not in ("", "sphere", "granular", "hybrid"):
        raise ReadError(
            f"{path}: expected 'Atoms # sphere' (atom_style sphere), found 'Atoms # {style}': "
            f"write the grains with dump custom ... id type x y z radius"
        )
    for line in header:
        words = line.split()
        if words[1:2] and words[1] in NO_SPHERES and words[0] != "0":
            raise ReadError(f"{path}: expected spheres, found {line.strip()[:80]!r}")
    if data.startswith(OF_YADE):
        raise ReadError(
            f"{path}: YADE writes radii in the column of diameters of such files, so LIGGGHTS "
            f"takes grains for half as large as they are: say which they are to be, by "
            f'`columns="id=1,type=2,radius=3,x=5,y=6,z=7"` or by diameter=3'
        )


def _names(path: Path, style: str, values: FloatArray, cell: Cell | None) -> tuple[str, ...]:
    """
    The names of the columns, of atom_style sphere or of a hybrid with it.

    A file that does not name its style has the order in which diameters and densities are above
    zero, types are whole, and the centres in the box; ReadError if both orders do, or none.
    """
    orders = {"hybrid": (HYBRID,), "": (PLAIN, HYBRID)}.get(style, (PLAIN,))
    width = values.shape[1]
    fitting = [
        order
        for order in orders
        if width >= len(order) and (len(orders) == 1 or _fits(order, values, cell))
    ]
    if orders == (PLAIN,) and width not in (len(PLAIN), len(PLAIN) + len(FLAGS)):
        fitting = []
    if len(values) == 0:
        fitting = fitting[:1]
    if len(fitting) != 1:
        found = f"'Atoms # {style}'" if style else "'Atoms' without a style"
        raise ReadError(
            f"{path}: expected the columns {' '.join(PLAIN)} of atom_style sphere (or, in a hybrid "
            f"style, {' '.join(HYBRID)}), found {found} with {width} columns, which "
            f"{'may be both' if fitting else 'are neither'}: name them by their numbers, for "
            f'instance `columns="id=1,type=2,diameter=3,x=5,y=6,z=7"`'
        )
    more = width - len(PLAIN)
    numbered = tuple(f"{place + 1}" for place in range(len(PLAIN), width))
    flags = FLAGS if more >= 3 and _are_flags(values[:, -3:]) else ()
    rest = numbered[: more - len(flags)]
    if fitting[0] is HYBRID and rest:
        rest = ("mol", *rest[1:])
    return (*fitting[0], *rest, *flags)


def _are_flags(values: FloatArray) -> bool:
    return bool(np.all(values == np.rint(values)))


@np.errstate(invalid="ignore")
def _fits(order: tuple[str, ...], values: FloatArray, cell: Cell | None) -> bool:
    column = {name: values[:, place] for place, name in enumerate(order)}
    if not (np.all(column["diameter"] > 0) and np.all(column["density"] > 0)):
        return False
    if not np.all(column["type"] == np.rint(column["type"])):
        return False
    if order is PLAIN and values.shape[1] not in (len(PLAIN), len(PLAIN) + len(FLAGS)):
        return False
    if cell is None:
        return order is PLAIN
    centre = np.column_stack([column[axis] for axis in "xyz"])
    # a grain may reach out of the box, and a periodic one lie there
    fraction = cell.fractional(centre)
    return bool(np.all((fraction > -0.5) & (fraction < 1.5)))


def _cell(path: Path, header: list[str]) -> Cell | None:
    """The box, from its low and high corner and its tilt, or from three vectors."""
    found: dict[str, list[float]] = {}
    for line in header[1:]:
        numbers = re.match(r"\s*([-+.\deE][-+.\deE\s]*)\s([a-z][a-z ]*)", line)
        if numbers is not None:
            try:
                found[numbers[2].strip()] = [float(word) for word in numbers[1].split()]
            except ValueError:
                raise ReadError(f"{path}: expected numbers in the header, found {line!r}") from None
    try:
        vectors, origin = _vectors(found)
        if not (np.all(np.abs(vectors) < MOST) and np.all(np.abs(origin) < MOST)):
            return None
        return Cell(vectors, (False, False, False), origin)
    except (KeyError, ValueError):
        raise ReadError(
            f"{path}: expected the box in the header: two numbers before each of xlo xhi, ylo yhi "
            f"and zlo zhi, found {', '.join(found) or 'none'}"
        ) from None
    except PackingError:
        return None


def _vectors(found: dict[str, list[float]]) -> tuple[FloatArray, FloatArray]:
    if "avec" in found:
        vectors = np.array([found["avec"], found["bvec"], found["cvec"]], dtype=np.float64)
        return vectors.reshape(3, 3), np.array(found["abc origin"], dtype=np.float64).reshape(3)
    bounds = np.array([found[f"{axis}lo {axis}hi"] for axis in "xyz"], dtype=np.float64).reshape(
        3, 2
    )
    tilt = np.array(found.get("xy xz yz", [0.0] * 3), dtype=np.float64).reshape(3)
    return box_vectors(bounds[:, 0], bounds[:, 1], tilt)
