"""
YADE: simulations saved by ``O.save`` as XML, and the cell files of VTK files of spheres.

From a saved simulation, spheres, contacts and the cell are read. VTK files of spheres hold no cell;
YADE writes it to a separate file. ``VTKRecorder`` numbers spheres and cells by the step.
``VTKExporter`` numbers a cell by the count of *interactions* files written so far, so that a cell
file may be overwritten or have the number of another frame. These cells are used only if there is
exactly one for each file of spheres, in the same order.
"""

from __future__ import annotations

import glob
import re
import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ReadError, note, warn
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import Stamp, bare_name, first_bytes, plain, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of
from scanfab.io.mesh import read_mesh
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import WallForces

STEP = re.compile(rb"<iter>\s*(\d{1,18})\s*</iter>")
TIME = re.compile(rb"<time>\s*(\d+\.?\d*(?:e[-+]?\d+)?)\s*</time>")
# the elements that are read for a sphere, and the defaults of missing ones
SPHERE = {"id": None, "groupMask": None, "clumpId": "-1", "shape/px/radius": None}
SPHERE |= {f"state/px/se3/position/{axis}": None for axis in "xyz"}
# the elements that are read for a contact; the first is the step at which it became real
CONTACT = ("iterMadeReal", "id1", "id2")
VECTORS = ("cellDist", "normalForce", "shearForce", "contactPoint")
# names of files of spheres by VTKExporter and VTKRecorder, and of files of cells
EXPORTED = re.compile(r"(.*)-spheres-(\d+)\.vtk")
RECORDED = re.compile(r"(.*)spheres\.(\d+)\.vtu")
CELL_FILE = re.compile(r".*-periCell-\d+\.vtk|.*pericell\.\d+\.vtu")
# number of corners in a cell file, the corner at the origin, and those at the ends of the vectors
CORNERS, ORIGIN, ENDS = 8, 4, (7, 5, 0)
# tolerance as a fraction of the cell: YADE wraps spheres into it, but writes six digits
ROUNDING = 1e-4
PERIODIC = (True, True, True)


class SavedScene(GrainsOnly):
    """Reads files of ``O.save``."""

    name = "yade's O.save"

    def recognises(self, path: Path) -> bool:
        """Any saved simulation, XML or binary."""
        head = first_bytes(path)
        return b"<boost_serialization" in head or b"serialization::archive" in head[:64]

    def kind(self, path: Path) -> FileKind:
        """Grains; ReadError for a binary file."""
        if b"<boost_serialization" not in first_bytes(path):
            advice = "load it there, and save it as XML: O.save('name.xml.bz2')"
            raise ReadError(f"{path}: only the same build of YADE can read its binary: {advice}")
        return "grains"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot, with its step and time."""
        head = first_bytes(path)
        step, time = STEP.search(head), TIME.search(head)
        return [Snapshot(path, step and int(step[1]), time and float(time[1]))]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """
        The spheres with ids and masks, the cell, and the real interactions as contacts.

        Raises
        ------
        ReadError
            If the elements of the file are not as YADE writes them.
        """
        path = snapshot.path
        ids: list[float] = []
        spheres: list[list[float]] = []
        contacts: list[list[float]] = []
        # a class is named at its first occurrence only, and later given by number
        shapes: dict[str, str] = {}
        try:
            with open(plain(path), "rb") as stream:
                parsed: Any = ElementTree.iterparse(stream)
                for _, element in parsed:
                    # contacts are nested in bodies; other px elements (references) are left out
                    if element.tag != "px":
                        continue
                    if element.find("iterMadeReal") is not None:
                        row = [_number(element, name) for name in CONTACT]
                        for vector in (next(element.iter(name), None) for name in VECTORS):
                            row += [np.nan if vector is None else _number(vector, a) for a in "xyz"]
                        contacts.append(row)
                    elif element.find("id") is not None and element.find("state") is not None:
                        ids.append(_number(element, "id"))
                        if _shape(element, shapes) == "Sphere":
                            spheres.append([_number(element, *item) for item in SPHERE.items()])
                    else:
                        continue
                    # free the element, so that the whole file is never in memory
                    element.clear()
            scene = parsed.root
            # the vectors of the cell are the columns of hSize
            sides = [[_number(scene, f".//hSize/m{row}{k}") for row in range(3)] for k in range(3)]
        except (ElementTree.ParseError, LookupError, ValueError, OverflowError) as error:
            reason = f"cannot be read as a simulation that YADE saved (O.save): {error}"
            raise ReadError(f"{path}: {reason}") from None
        is_periodic = scene.findtext(".//isPeriodic") == "1"
        cell = cell_of(path, sides, PERIODIC, np.zeros(3)) if is_periodic else None
        table = np.array(spheres).reshape(-1, 7)
        columns = dict(zip(("id", "mask", "clumpId", "radius"), table.T, strict=False))
        if np.all(columns["clumpId"] < 0):
            del columns["clumpId"]
        grains = grain_table(path, {**columns, "position": table[:, 4:]}, cell, options)
        return _with_contacts(path, grains, np.array(contacts).reshape(-1, 15), np.array(ids))


def _shape(body: ElementTree.Element, shapes: dict[str, str]) -> str | None:
    """The class of a body's shape; `shapes` collects the names of classes by number."""
    shape = body.find("shape/px")
    attributes = {} if shape is None else shape.attrib
    number = attributes.get("class_id") or attributes.get("class_id_reference") or ""
    if "class_name" in attributes:
        shapes[number] = attributes["class_name"].rpartition("::")[2]
    return shapes.get(number)


def _number(element: ElementTree.Element, name: str, default: str | None = None) -> float:
    text = element.findtext(name, default)
    if text is None:
        raise ValueError(f"<{element.tag}> has no <{name.rpartition('/')[2]}>")
    return float(text)


def _with_contacts(
    path: Path, grains: GrainTable, table: FloatArray, bodies: FloatArray
) -> GrainTable:
    """The grains with their contacts, and with the forces of walls on grains."""
    # leave out pairs that are only near each other: their step is negative
    table = table[table[:, 0] >= 0]
    pairs = whole_numbers(path, table[:, 1:3].ravel()).reshape(-1, 2)
    unknown = ~np.isin(pairs, bodies)
    if unknown.any():
        raise ReadError(f"{path}: a contact names the body {pairs[unknown][0]}, which is not there")
    # leave out contacts of walls with walls
    ours = np.any(rows_of_ids(grains, pairs) >= 0, axis=1)
    pairs, rows = pairs[ours], rows_of_ids(grains, pairs[ours])
    shift, normal, shear, point = np.split(table[ours, 3:], 4, axis=1)
    force = None if np.isnan(normal + shear).any() else normal + shear
    is_periodic = grains.cell is not None and grains.cell.is_periodic
    image = whole_numbers(path, shift.ravel()).reshape(-1, 3) if is_periodic else None
    joined = join_ids(path, grains, pairs, force, walls=True, image=image)
    at, walls = np.any(rows < 0, axis=1), None
    if at.any() and force is not None and not np.isnan(point).any():
        # YADE's forces act on the second body; make them act on the grain
        forces = np.where(rows[at, 1:] >= 0, 1.0, -1.0) * force[at]
        walls = WallForces(rows[at].max(axis=1), point[at], forces)
    return grains._replace(
        contacts=joined.contacts, wall_contacts=joined.wall_contacts, wall_forces=walls
    )


def is_cell_file(path: Path) -> bool:
    """Whether a file has a name of YADE's cell files."""
    return CELL_FILE.fullmatch(bare_name(path)) is not None


def cell_beside(path: Path, position: FloatArray) -> Cell | None:
    """
    Read the cell of a file of spheres from its cell file; None if there is none.

    Parameters
    ----------
    path : Path
        A file of spheres by ``VTKExporter`` or ``VTKRecorder``.
    position : ndarray, shape (N, 3)
        The centres in this file, dump's length unit.

    Raises
    ------
    ReadError
        If spheres are outside the cell, which is then the cell of another frame.
    """
    file = cell_file(path)
    if file is None:
        exported = EXPORTED.fullmatch(bare_name(path))
        if exported and _numbered(path.parent, f"{exported[1]}-periCell-", stamp_of(path.parent)):
            lack = 'skipped, as not each file of spheres has one: name cells by `cell="FILE.csv"`'
            warn(f"{path.parent / exported[1]}-periCell-*: {lack}")
        return None
    if is_cell_file(file):
        corners = read_mesh(file).points
        if len(corners) != CORNERS:
            raise ReadError(f"{file}: expected {CORNERS} corners of a cell, found {len(corners)}")
        edges = corners[list(ENDS)] - corners[ORIGIN]
        cell = cell_of(file, edges, PERIODIC, corners[ORIGIN])
    else:
        cell = SavedScene().read_grains(Snapshot(file), ReadOptions()).cell
    if cell is None:
        return None
    fractions = cell.fractional(position)
    outside = np.any((fractions < -ROUNDING) | (fractions > 1.0 + ROUNDING), axis=1)
    if outside.any():
        problem = f"{np.count_nonzero(outside)} grains lie outside the cell of {file}"
        advice = 'name the right one with `cell=(LX, LY, LZ)` or `cell="FILE.csv"`'
        raise ReadError(f"{path}: {problem}: {advice}")
    pattern = re.sub(r"\d+", "*", file.name)
    note(f"the cell is read from {file.parent / pattern}, beside the grains")
    return cell


def cell_file(path: Path) -> Path | None:
    """The file with the cell of a file of spheres; None if there is none, or if it is unsure."""
    folder, name, stamp = path.parent, bare_name(path), stamp_of(path.parent)
    if exported := EXPORTED.fullmatch(name):
        # VTKExporter numbers files by a count, not by the step
        spheres = _numbered(folder, f"{exported[1]}-spheres-", stamp)
        cells = _numbered(folder, f"{exported[1]}-periCell-", stamp)
        # a cell exported after the interactions of its frame has a number that is higher by 1
        pairs = dict(zip(sorted(spheres), sorted(cells), strict=False))
        if len(spheres) != len(cells) or any(pairs[k] - k not in (0, 1) for k in pairs):
            return None
        return cells.get(pairs.get(int(exported[2]), -1))
    recorded = RECORDED.fullmatch(name)
    if recorded is None:
        return None
    start, step = recorded[1], int(recorded[2])
    # otherwise a saved simulation of this step, with the step in its name
    saved = [
        file
        for file in folder.glob(f"{glob.escape(start)}*{step}.xml*")
        if SavedScene().snapshots(file)[0].step == step
    ]
    cells = _numbered(folder, f"{start}pericell.", stamp)
    return cells.get(step, saved[0] if len(saved) == 1 else None)


# cached, so that a folder is listed once for all its files, until its content changes
@lru_cache(maxsize=8)
def _numbered(folder: Path, start: str, stamp: Stamp) -> dict[int, Path]:
    """The VTK files whose names are ``start`` and a number, by this number."""
    files = {}
    for file in sorted(folder.glob(f"{glob.escape(start)}*")):
        if match := re.fullmatch(r"(\d+)\.vt[ku]", bare_name(file).removeprefix(start)):
            files[int(match[1])] = file
    return files
