"""
The periodic cell that YADE writes beside a VTK file of spheres, which has none itself.

``VTKRecorder`` numbers both by the step. ``VTKExporter`` numbers a cell by how many files of
*interactions* it has written, so that a cell may be overwritten, or bear the number of another
frame: it is taken only where there is one cell for each file of spheres, in their order.
"""

from __future__ import annotations

import glob
import re
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np

from scanfab.base.errors import PackingError, ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.files import COMPRESSED_SUFFIXES, Stamp, bare_name, stamp_of
from scanfab.io.formats.yade_save import is_save, read_save, snapshot_of_save
from scanfab.io.mesh import read_mesh
from scanfab.io.reader import ReadOptions
from scanfab.packing.cell import Cell

EXPORTED = re.compile(r"(.*)-spheres-(\d+)\.vtk")
RECORDED = re.compile(r"(.*)spheres\.(\d+)\.vtu")
CELL_FILE = re.compile(r".*-periCell-\d+\.vtk|.*pericell\.\d+\.vtu")
# corners of a cell in both kinds of file, and those at the ends of its vectors
CORNERS, ORIGIN, ENDS = 8, 4, (7, 5, 0)
# where XY XZ YZ stand in the vectors
TILT = ([1, 2, 2], [0, 0, 1])
# in cells: YADE wraps spheres into the cell, but writes six digits
ROUNDING = 1e-4


def is_cell_file(path: Path) -> bool:
    """Whether a file is named as YADE names those of a cell."""
    return CELL_FILE.fullmatch(bare_name(path)) is not None


def cell_beside(path: Path, position: FloatArray) -> Cell | None:
    """
    The cell of a file of spheres.

    Parameters
    ----------
    path : Path
        What ``VTKExporter`` or ``VTKRecorder`` has written.
    position : ndarray, shape (N, 3)
        The spheres' centres as they stand there, dump's length unit.

    Raises
    ------
    ReadError
        If spheres lie outside: then it is not their cell.
    """
    file = cell_file(path)
    cell = None if file is None else _read_cell(file)
    if file is None or cell is None:
        _tell_of_doubt(path)
        return None
    fractions = cell.fractional(position)
    outside = np.any((fractions < -ROUNDING) | (fractions > 1.0 + ROUNDING), axis=1)
    if outside.any():
        raise ReadError(
            f"{path}: {np.count_nonzero(outside)} grains lie outside the cell of {file}, into "
            f"which YADE wraps them: it is the cell of another state; name the right one with "
            f'`cell=(LX, LY, LZ)` or `cell="FILE.csv"`'
        )
    pattern = re.sub(r"\d+", "*", file.name)
    warnings.warn(
        f"the cell is read from {file.parent / pattern}, beside the grains",
        ScanfabNote,
        stacklevel=2,
    )
    return cell


def cell_file(path: Path) -> Path | None:
    """The file that has the cell of a file of spheres; None if there is none, or a doubt."""
    folder, name = path.parent, bare_name(path)
    stamp = stamp_of(folder)
    if exported := EXPORTED.fullmatch(name):
        # its number counts files; that of a saved state is a step
        return _exported_cells(folder, exported[1], stamp).get(int(exported[2]))
    recorded = RECORDED.fullmatch(name)
    if recorded is None:
        return None
    cell = path.with_name(f"{recorded[1]}pericell.{recorded[2]}.vtu")
    for ending in ("", *COMPRESSED_SUFFIXES):
        if (file := cell.with_name(cell.name + ending)).is_file():
            return file
    # or else a saved state of this step, whose name has the number of the step, too
    step = int(recorded[2])
    found = [
        file
        for file in _saves(folder, recorded[1], stamp)
        if step in map(int, re.findall(r"\d+", bare_name(file)))
        and is_save(file)
        and snapshot_of_save(file).step == step
    ]
    return found[0] if len(found) == 1 else None


# listed once for all files of a folder, as long as none comes or goes
@lru_cache(maxsize=8)
def _exported_cells(folder: Path, base: str, stamp: Stamp) -> dict[int, Path]:
    """The cells by the numbers of the spheres; none if there is a doubt which is whose."""
    spheres, cells = (_numbered(folder, f"{base}-{kind}-") for kind in ("spheres", "periCell"))
    # behind the interactions of its frame a cell has the next number, before them the same one
    pairs = list(zip(sorted(spheres), sorted(cells), strict=False))
    if len(spheres) != len(cells) or not all(two - one in (0, 1) for one, two in pairs):
        return {}
    return {one: cells[two] for one, two in pairs}


@lru_cache(maxsize=8)
def _saves(folder: Path, base: str, stamp: Stamp) -> list[Path]:
    """Files that may be saved states, as their names begin alike."""
    return sorted(folder.glob(f"{glob.escape(base)}*.xml*"))


def refuse_as_numbers(path: Path) -> ReadError:
    """
    The error for such a file in the place of one with the numbers of all frames.

    It has the cell of one frame: taken for all, it would be wrong without a word.
    """
    cell = _read_cell(path)
    assert cell is not None
    vectors = cell.vectors
    numbers = [*np.diag(vectors), *([] if not np.any(tilt := vectors[TILT]) else tilt)]
    cure = (
        "lay it beside its spheres, under YADE's own name"
        if np.any(np.triu(vectors, 1))
        else f"for this frame alone use `cell=({', '.join(f'{one:.9g}' for one in numbers)})`"
    )
    return ReadError(
        f"{path}: is the cell of one frame in a VTK file, expected a CSV file with those of all "
        f"(step, lx, ly, lz): {cure}"
    )


def _tell_of_doubt(path: Path) -> None:
    """Warn if there are cells that ``VTKExporter`` has written."""
    exported = EXPORTED.fullmatch(bare_name(path))
    if exported is None:
        return
    folder, base = path.parent, exported[1]
    spheres, cells = (_numbered(folder, f"{base}-{kind}-") for kind in ("spheres", "periCell"))
    if cells:
        warnings.warn(
            f"{folder / base}-periCell-*: {len(cells)} cells beside {len(spheres)} files of "
            f"spheres: YADE numbers the cells by the files of interactions, so it cannot be told "
            f'which cell belongs to which frame: name the cells with `cell="FILE.csv"`',
            ScanfabWarning,
            stacklevel=3,
        )


def _numbered(folder: Path, start: str) -> dict[int, Path]:
    """Files of one kind by their number."""
    name = re.compile(re.escape(start) + r"(\d+)\.vtk")
    files = sorted(folder.glob(f"{glob.escape(start)}*"))
    return {int(match[1]): file for file in files if (match := name.fullmatch(bare_name(file)))}


def _read_cell(file: Path) -> Cell | None:
    """The cell in a file of either kind; None if a saved state does not repeat."""
    if not is_cell_file(file):
        return read_save(snapshot_of_save(file), ReadOptions()).cell
    corners = read_mesh(file).points
    if len(corners) != CORNERS:
        raise ReadError(f"{file}: expected the {CORNERS} corners of a cell, found {len(corners)}")
    try:
        return Cell(corners[list(ENDS)] - corners[ORIGIN], origin=corners[ORIGIN])
    except PackingError as error:
        raise ReadError(f"{file}: {error}") from None
