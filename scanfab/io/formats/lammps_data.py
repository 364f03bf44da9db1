"""LAMMPS' data files (``write_data``) of ``atom_style sphere``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.lengths import MOST
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_memory, plain
from scanfab.io.formats.columns import grain_table
from scanfab.io.parse.lammps_box import box_vectors
from scanfab.io.parse.number_rows import exact_column, rows_of_numbers
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.io.unpacking import check_lines
from scanfab.packing.cell import Cell

__all__ = ["is_data_file", "read_data_grains", "step_of_data"]


FIRST_LINE = re.compile(rb"\A(?:\xef\xbb\xbf)?LAMMPS data file[^\n]*")
STEP = re.compile(rb"timestep = (\d{1,18})\b")
# its third column is the diameter; the image flags may be missing
SPHERE = ("id", "type", "diameter", "density", "x", "y", "z")
FLAGS = ("ix", "iy", "iz")
# a line that is not blank or a comment, as numpy has them
FILLED = re.compile(rb"^[ \t\r\f\v\x1c-\x1f\x85\xa0]*[^#\s\x1c-\x1f\x85\xa0]", re.MULTILINE)

# a section is a line that starts with a word, behind the header
SECTION = re.compile(rb"^[ \t]*([A-Z][A-Za-z ]*?)[ \t]*(?:#[ \t]*(\S+)[^\n]*)?\r?$", re.MULTILINE)


def is_data_file(head: bytes) -> bool:
    """Whether a file starts as LAMMPS' data files do."""
    return FIRST_LINE.match(head) is not None


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
        If the atoms are not of style sphere, or a line is not as it should be.
    """
    path = snapshot.path
    check_memory(path, 6.0 * plain(path).stat().st_size)
    check_lines(path, plain(path))
    data = plain(path).read_bytes()
    sections = list(SECTION.finditer(data, len(FIRST_LINE.match(data)[0])))  # type: ignore[index]
    atoms = next((place for place, one in enumerate(sections) if one[1] == b"Atoms"), None)
    if atoms is None:
        raise ReadError(f"{path}: expected a section Atoms, found none")
    style = (sections[atoms][2] or b"").decode("utf-8", "replace")
    if style != "sphere":
        found = f"'Atoms # {style}'" if style else "'Atoms' without a style"
        raise ReadError(
            f"{path}: expected 'Atoms # sphere' (atom_style sphere), found {found}: "
            f"write the grains with dump custom ... id type x y z radius"
        )
    header = data[: sections[0].start()].decode("utf-8", "replace").splitlines()
    begin = sections[atoms].end()
    end = sections[atoms + 1].start() if atoms + 1 < len(sections) else len(data)
    values = _values(path, data, begin, end, _count(path, header))
    names = (*SPHERE, *FLAGS)[: values.shape[1]]
    columns = {name: values[:, place] for place, name in enumerate(names)}
    columns["id"] = exact_column(values, data[begin:end], names.index("id"))
    return grain_table(path, columns, _cell(path, header), options)


def _count(path: Path, header: list[str]) -> int:
    for line in header:
        words = line.split()
        if words[1:2] == ["atoms"] and re.fullmatch(r"\d{1,15}", words[0]):
            return int(words[0])
    raise ReadError(f"{path}: expected a line 'N atoms' in the header, found none")


def _values(path: Path, data: bytes, begin: int, end: int, count: int) -> FloatArray:
    if FILLED.search(data[begin:end]) is None:
        if count:
            raise ReadError(f"{path}: the header counts {count} atoms, found none")
        return np.zeros((0, len(SPHERE)))
    values = rows_of_numbers(path, data, begin, end)
    if len(values) != count:
        raise ReadError(f"{path}: the header counts {count} atoms, found {len(values)}")
    if values.shape[1] not in (len(SPHERE), len(SPHERE) + len(FLAGS)):
        raise ReadError(
            f"{path}: expected {len(SPHERE)} or {len(SPHERE) + len(FLAGS)} columns of atoms "
            f"({' '.join(SPHERE)}), found {values.shape[1]}"
        )
    return values


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
