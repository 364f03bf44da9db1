"""
VTK files: grains as points with a radius, contacts as lines; and lists of VTK files.

scanfab writes PolyData (``.vtp``). Data without a usual name (cell, images) get names of scanfab.
"""

from __future__ import annotations

import glob
import re
from contextlib import suppress
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError, note
from scanfab.base.typing import AnyArray, FloatArray
from scanfab.io.columns import grain_table, has_radius, whole_numbers
from scanfab.io.contacts import join_ids, join_positions, proved_force
from scanfab.io.families import numbers_in
from scanfab.io.files import Stamp, bare_name, file_inside, first_bytes, plain, stamp_of
from scanfab.io.formats.shared import GrainsOnly, cell_of, numbers
from scanfab.io.mesh import Mesh, elements, form_of, holds_mesh, listed, read_mesh
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
    reader_named,
)
from scanfab.io.writer import Left, are_numbers, as_arrays, contacts_of, split, stated_cell
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

# step and time: scanfab writes them as a comment in the first line, so that the frames of a series
# are found without reading whole files; TIME also matches the text of other programs
STEP = re.compile(rb"scanfab_step=(-?\d{1,30})[\s<]")
TIME = re.compile(
    rb'TimeValue(?:=|"[^>]*format="ascii"[^>]*>\s*)([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)[\s<]'
)
# bytes at the start of a file that hold the field arrays
HEAD = 1 << 14
# names of field arrays: KNOWN says whether contacts are known, FIELDS hold the frame
KNOWN = "scanfab_contacts"
FIELDS = {name: f"scanfab_{name}" for name in ("step", "cell", "origin", "periodic")}
FIELDS["time"] = "TimeValue"
# rectilinear grids are boxes, not grains
BOXES = ("RectilinearGrid", "RECTILINEAR_GRID")
# kinds of files that list the files of one frame: grains, contacts, boxes
LISTS = {".vtm": ("DataSet", "file")} | dict.fromkeys((".pvtp", ".pvtu"), ("Piece", "Source"))
BLOCKS = ("vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection")
# names of dumps and boxes of LIGGGHTS
DUMP, BOX = re.compile(r"(.*?)(\d+)\.\w+"), "boundingBox_"
BOX_ENDS = (".vtk", ".vtr", ".vtk.gz", ".vtr.gz")
# names of files of spheres by YADE's VTKExporter and VTKRecorder, and of files of cells
EXPORTED = re.compile(r"(.*)-spheres-(\d+)\.vtk")
RECORDED = re.compile(r"(.*)spheres\.(\d+)\.vtu")
CELL_FILE = re.compile(r".*-periCell-\d+\.vtk|.*pericell\.\d+\.vtu")
# number of corners in a cell file, the corner at the origin, and those at the ends of the vectors
CORNERS, ORIGIN, ENDS = 8, 4, (7, 5, 0)
# tolerance as a fraction of the cell: YADE wraps spheres into it, but writes six digits
ROUNDING = 1e-4


class VtkReader(GrainsOnly):
    """Reader plugin for VTK files of any origin."""

    name = "vtk"
    description = "any VTK point cloud with a radius; contacts as lines; lists of files (.pvd .vtm)"
    extensions: tuple[str, ...] = (".vtk", ".vtp", ".vtu", ".pvtp", ".pvtu", ".vtm", ".pvd")
    extensions += (".vtkhdf", ".xdmf", ".xmf")
    generic = True
    # whether an id that no grain has means a wall, see join_ids
    walls: bool | Literal["unknown"] = "unknown"
    # names of the arrays with the force of a contact, its normal and its tangential part
    force_arrays = ("force", "", "")
    # +1: forces act on the second grain, -1: on the first, None: the format does not say
    sign: float | None = None

    def recognises(self, path: Path) -> bool:
        """Recognised by legacy VTK's first line, the root element of XML, or the type in VTKHDF."""
        return form_of(path) is not None

    def kind(self, path: Path) -> FileKind:
        """Lines are contacts; points without other cells are grains."""
        form = form_of(path)
        if form == "Collection" or form in BLOCKS:
            return "index"
        if not holds_mesh(form) or form in BOXES:
            return "other"
        if is_cell_file(path):
            return "cell"
        mesh = read_mesh(path)
        # pieces of scan lines, which compute --vtk writes, say whether they are void
        if mesh.has_faces or "void" in mesh.line_arrays:
            return "other"
        if len(mesh.points) == 0:
            # an empty frame, whose arrays VTK may have dropped: look for the word in the file
            return "grains" if b"radi" in plain(path).read_bytes().lower() else "other"
        if has_radius(mesh.point_arrays):
            return "grains"
        return "contacts" if len(mesh.lines) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The frames that a ``.pvd`` lists; any other file is a single frame."""
        if form_of(path) == "Collection":
            return self._listed(path)
        head = first_bytes(path, HEAD)
        step, time = STEP.search(head), TIME.search(head)
        moment = step and int(step[1]), time and float(time[1])
        return [Snapshot(path, *moment, stepless=step is None and says_all(path))]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The points and their arrays, with the companion box of LIGGGHTS or cell of YADE."""
        path = snapshot.path
        if form_of(path) in BLOCKS:
            return self._read_blocks(path, options)
        mesh = read_mesh(path)
        columns = {**mesh.point_arrays, "position": mesh.points}
        if KNOWN in (fields := mesh.field_arrays):
            # scanfab wrote the file, with cell and contacts
            stated = {name: fields[array] for name, array in FIELDS.items() if array in fields}
            own = contacts_of(mesh.lines, mesh.line_arrays) if np.any(fields[KNOWN]) else None
            grains = grain_table(path, columns, stated_cell(path, stated), options)
            return grains._replace(contacts=own)
        if len(mesh.points) == 0:
            columns["radius"] = np.zeros(0)
        cell = _cell_beside(path, mesh.points, options)
        grains = grain_table(path, columns, cell, options)
        if len(mesh.lines) == 0:
            return grains
        # lines between the points of the grains are contacts
        force, force_n = self.forces(mesh)
        contacts = ContactList(mesh.lines, force=force, force_n=force_n)
        return grains._replace(contacts=self._proved(path, grains, contacts, mesh))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """The lines as contacts, joined by the arrays id1 and id2, or else by their ends."""
        path, mesh = snapshot.path, read_mesh(snapshot.path)
        force, force_n = self.forces(mesh)
        if grains.id is not None and {"id1", "id2"} <= mesh.line_arrays.keys():
            ids = [whole_numbers(path, mesh.line_arrays[name]) for name in ("id1", "id2")]
            pairs = np.column_stack(ids)
            joined = join_ids(path, grains, pairs, force, walls=self.walls, force_n=force_n)
        else:
            joined = join_positions(path, grains, mesh.points[mesh.lines], force, force_n)
        return joined._replace(contacts=self._proved(path, grains, joined.contacts, mesh))

    def forces(self, mesh: Mesh) -> tuple[FloatArray | None, FloatArray | None]:
        """
        The force of each line, and the normal part of the force.

        Both have shape (M, 3) and act on the second grain, or on an unknown one if the format does
        not say. The normal part may also have shape (M,), positive in compression.
        """
        whole, normal, tangential = (_vectors(mesh, name) for name in self.force_arrays)
        if whole is None and normal is not None and tangential is not None:
            whole = normal + tangential
        sign = self.sign or 1.0
        return None if whole is None else sign * whole, None if normal is None else sign * normal

    def _proved(
        self, path: Path, grains: GrainTable, contacts: ContactList | None, mesh: Mesh
    ) -> ContactList | None:
        """The contacts; if the format does not define the sign of forces, the forces decide it."""
        if contacts is None or self.sign is not None:
            return contacts
        names = [name for name in mesh.line_arrays if "force" in name.lower() and name != "force"]
        if names:
            note(f"contact arrays that are not read: {', '.join(names)}: only a vector `force` is")
        if contacts.force is None:
            return contacts
        force = np.asarray(contacts.force, np.float64)
        return contacts._replace(
            force=proved_force(path, grains, np.asarray(contacts.pairs), force)
        )

    def carries(self, path: Path) -> Carries:
        """Files of scanfab have a cell, LIGGGHTS writes a box file; VTK has no cell."""
        if says_all(path):
            return "cell"
        return "nothing" if cell_file(path) is None else "box"

    def beside(self, path: Path) -> list[Path]:
        """The files that a file lists, and the box of LIGGGHTS or the cell of YADE, if any."""
        files = [file] if (file := cell_file(path)) is not None else []
        if (tags := LISTS.get(path.suffix.lower())) is not None:
            with suppress(ReadError):
                files += listed(path, *tags)
        return files

    def _read_blocks(self, index: Path, options: ReadOptions) -> GrainTable:
        """The grains of a ``.vtm``: one of its files holds grains, and one may hold contacts."""
        files: dict[FileKind, list[Path]] = {"grains": [], "contacts": []}
        for path in listed(index, "DataSet", "file"):
            if form_of(path) not in (*BLOCKS, "Collection"):
                files.setdefault(self.kind(path), []).append(path)
        if len(files["grains"]) != 1 or len(files["contacts"]) > 1:
            counts = " and ".join(f"{len(files[kind])} of {kind}" for kind in files)
            raise ReadError(f"{index}: expected one file of grains, one of contacts: {counts}")
        table = self.read_grains(Snapshot(files["grains"][0]), options)
        for path in files["contacts"]:
            joined = self.read_contacts(Snapshot(path), options, table)
            table = table._replace(contacts=joined.contacts, wall_contacts=joined.wall_contacts)
        return table

    def _listed(self, index: Path) -> list[Snapshot]:
        """The frames of a ``.pvd``, in its order: the files of grains among those it lists."""
        kinds: dict[tuple[str, str], FileKind] = {}
        frames: dict[str | None, Path] = {}
        for entry in elements(index).iter("DataSet"):
            path, word = file_inside(index, entry.get("file", "")), entry.get("timestep")
            # files whose names differ only in numbers are of one kind; boxes, contacts are left out
            family = re.sub(r"\d+", "*", path.name), entry.get("part", "0")
            if kinds.get(family, "other") == "other":
                kinds[family] = self.kind(path)
            if kinds[family] in ("grains", "points") and frames.setdefault(word, path) != path:
                both = f"{frames[word].name} and {path.name}"
                raise ReadError(f"{index}: lists {both} for one time: name the files of one series")
        names = {kind: name for (name, _), kind in kinds.items()}
        if {"grains", "points"} <= names.keys():
            points = f"points without a radius ({names['points']}) beside {names['grains']}"
            raise ReadError(f"{index}: lists {points}: take them out, or name the files")
        found = []
        for word, path in frames.items():
            time = None if word is None else numbers(f"{index}: timestep", word.encode(), 1)[0]
            found.append(Snapshot(path, (None, *numbers_in(path))[-1], time))
        return found


def _vectors(mesh: Mesh, name: str) -> FloatArray | None:
    """An array with a vector for each line, shape (M, 3); None if there is none."""
    values = mesh.line_arrays.get(name)
    if values is None or values.shape != (len(mesh.lines), 3) or values.dtype.kind not in "iuf":
        return None
    return doubles(values)


def is_cell_file(path: Path) -> bool:
    """Whether a file has a name of YADE's cell files."""
    return CELL_FILE.fullmatch(bare_name(path)) is not None


@np.errstate(over="ignore")
def _cell_beside(path: Path, position: FloatArray, options: ReadOptions) -> Cell | None:
    """
    The cell of a file of grains from its cell file; None if there is none.

    LIGGGHTS' box does not say what is periodic. ReadError if grains are outside YADE's cell, which
    is then the cell of another frame.
    """
    file = cell_file(path)
    if file is not None and BOX in file.name:
        corners = read_mesh(file).points
        if len(corners) == 0:
            return None
        return cell_of(path, np.ptp(corners, axis=0), (False, False, False), corners.min(axis=0))
    if file is None or options.cell is not None:
        return None
    if is_cell_file(file):
        corners = read_mesh(file).points
        if len(corners) != CORNERS:
            raise ReadError(f"{file}: expected {CORNERS} corners of a cell, found {len(corners)}")
        edges = corners[list(ENDS)] - corners[ORIGIN]
        cell = cell_of(file, edges, (True, True, True), corners[ORIGIN])
    else:
        cell = reader_named("yade").read_grains(Snapshot(file), ReadOptions()).cell
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
    """
    The file with the cell of a file of grains; None if there is none, or if it is unsure.

    LIGGGHTS writes a box for each dump. YADE's ``VTKRecorder`` numbers spheres and cells by the
    step; ``VTKExporter`` numbers a cell by the count of *interactions* files written so far, so
    that a cell file may be overwritten or have the number of another frame. These cells are used
    only if there is exactly one for each file of spheres, in the same order.
    """
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
    if recorded := RECORDED.fullmatch(name):
        start, step = recorded[1], int(recorded[2])
        # otherwise a saved simulation of this step, with the step in its name
        saved = [
            file
            for file in folder.glob(f"{glob.escape(start)}*{step}.xml*")
            if reader_named("yade").snapshots(file)[0].step == step
        ]
        cells = _numbered(folder, f"{start}pericell.", stamp)
        return cells.get(step, saved[0] if len(saved) == 1 else None)
    dump = DUMP.fullmatch(name)
    names = [f"{dump[1]}{BOX}{dump[2]}{end}" for end in BOX_ENDS] if dump else []
    return next((file for file in map(path.with_name, names) if file.is_file()), None)


# cached, so that a folder is listed once for all its files, until its content changes
@lru_cache(maxsize=8)
def _numbered(folder: Path, start: str, stamp: Stamp) -> dict[int, Path]:
    """The VTK files whose names are ``start`` and a number, by this number."""
    files = {}
    for file in sorted(folder.glob(f"{glob.escape(start)}*")):
        if match := re.fullmatch(r"(\d+)\.vt[ku]", bare_name(file).removeprefix(start)):
            files[int(match[1])] = file
    return files


class VtpWriter:
    """PolyData by VTK's own writer, with numbers in binary form."""

    name = "vtp"
    description = "VTK PolyData: spheres as points, contacts as lines, the cell as field data"
    extensions = (".vtp",)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; the file holds all data of the packing but columns of texts."""
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

        arrays, contacts = as_arrays(packing), packing.contacts
        frame, (own, left) = arrays.frame, split(arrays.own, are_numbers)
        fields = {FIELDS[name]: np.ravel(values)[None] for name, values in frame.items()}
        fields[KNOWN] = np.array([int(contacts is not None)])
        data, points, lines = vtkPolyData(), vtkPoints(), vtkCellArray()
        points.SetData(_array("Points", packing.position))
        data.SetPoints(points)
        if contacts is not None and len(contacts):
            lines.SetData(2, _array("", contacts.pairs.ravel()))
            data.SetLines(lines)
        for place, columns in (
            (data.GetPointData(), arrays.grains | own),
            (data.GetCellData(), arrays.contacts),
            (data.GetFieldData(), fields),
        ):
            for name, values in columns.items():
                place.AddArray(_array(name, values))
        writer = vtkXMLPolyDataWriter()
        writer.SetInputData(data)
        writer.SetHeaderTypeToUInt64()
        writer.SetCompressorTypeToNone()
        writer.EncodeAppendedDataOff()
        # VTK writes into memory and Python to the disk, so that a full disk raises OSError
        writer.WriteToOutputStringOn()
        writer.Write()
        said = " ".join(f"{FIELDS[k]}={frame[k]!r}" for k in ("step", "time") if k in frame)
        text: Any = writer.GetOutputString()
        content = text if isinstance(text, bytes) else text.encode()
        path.write_bytes(f"<!-- {said} -->\n".encode() + content)
        return Left(columns=left, no_step=False, notes=tuple(arrays.notes))


def _array(name: str, values: AnyArray) -> Any:
    """A VTK array; its name is escaped, as VTK's writer does not do it."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    table = values.reshape(len(values), int(np.prod(values.shape[1:])))
    table = table.astype(np.uint8) if values.dtype.kind == "b" else table
    array = numpy_to_vtk(np.ascontiguousarray(table), deep=True)  # type: ignore[no-untyped-call]
    array.SetName(escape(name))
    return array


def says_all(path: Path) -> bool:
    """Whether scanfab wrote the file; then it states the cell and the step completely."""
    return KNOWN.encode() in first_bytes(path, HEAD)
