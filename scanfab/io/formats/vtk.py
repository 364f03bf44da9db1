"""VTK files: grains as points with a radius, contacts as lines; and files that list others."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from scanfab.base.arrays import MOST, doubles
from scanfab.base.errors import ReadError, ScanfabNote
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, has_radius, whole_numbers
from scanfab.io.contacts import join_ids, join_positions, proved_force
from scanfab.io.files import bare_name, file_inside, plain
from scanfab.io.formats.yade_cells import cell_beside, cell_file, is_cell_file
from scanfab.io.mesh import Mesh, elements, form_of, holds_mesh, listed, read_mesh
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.writers.vtp import (
    is_packing,
    moment_of,
    packing_of,
    says_all,
)
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList

# boxes along the axes are no grains; other kinds of VTK files are indexes, or images
BOXES = ("RectilinearGrid", "RECTILINEAR_GRID")
# files that list those of one frame: grains, contacts, boxes
BLOCKS = ("vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection")


class VtkReader:
    """Reader plugin for VTK files of any origin."""

    name = "vtk"
    description = "any VTK point cloud with a radius; contacts as lines; lists of files (.pvd .vtm)"
    extensions: tuple[str, ...] = (".vtk", ".vtp", ".vtu", ".pvtp", ".pvtu", ".vtm", ".pvd")
    extensions += (".vtkhdf", ".xdmf", ".xmf")
    generic = True
    lists_contacts = True
    # whether an id that no grain has is a wall's, see join_ids
    walls: bool | Literal["unknown"] = "unknown"
    # whether the format says on which grain of a contact its force acts
    says_sign = False

    def recognises(self, path: Path) -> bool:
        """By the first line of legacy VTK, or the root element of the XML formats."""
        return form_of(path) is not None

    def kind(self, path: Path) -> FileKind:
        """Lines are contacts, points without any other cells are grains."""
        form = form_of(path)
        if form == "Collection" or form in BLOCKS:
            return "index"
        if not holds_mesh(form) or form in BOXES:
            return "other"
        if is_cell_file(path):
            return "cell"
        mesh = read_mesh(path)
        if mesh.has_faces:
            return "other"
        if len(mesh.points) == 0:
            # an empty frame; VTK may have dropped its arrays
            return "grains" if b"radi" in plain(path).read_bytes().lower() else "other"
        if has_radius(list(mesh.point_arrays)):
            return "grains"
        return "contacts" if len(mesh.lines) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, and hardly more than its name says which step it is; those that a ``.pvd`` lists."""
        if form_of(path) == "Collection":
            return self._listed(path)
        step, time = moment_of(path)
        return [Snapshot(path, step, time, stepless=step is None and says_all(path))]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Points and their arrays, with the box of LIGGGHTS or the cell of YADE beside them."""
        if form_of(snapshot.path) in BLOCKS:
            return self._read_blocks(snapshot, options)
        mesh = read_mesh(snapshot.path, snapshot.parts)
        columns = {**mesh.point_arrays, "position": mesh.points}
        if is_packing(mesh):
            _refuse_parts(snapshot, "a packing that scanfab wrote")
            cell, contacts = packing_of(snapshot.path, mesh)
            return grain_table(snapshot.path, columns, cell, options)._replace(contacts=contacts)
        if len(mesh.points) == 0:
            columns["radius"] = np.zeros(0)
        cell = _read_box(snapshot.path)
        if cell is None and options.cell is None:
            cell = cell_beside(snapshot.path, mesh.points)
        grains = grain_table(snapshot.path, columns, cell, options)
        if len(mesh.lines) == 0:
            return grains
        # lines between the grains' own points
        force, force_n = self.force_on_second(mesh), self.normal_force(mesh)
        contacts = ContactList(mesh.lines, force=force, force_n=force_n)
        return grains._replace(contacts=self._proved(snapshot.path, grains, contacts, mesh))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Lines; by the arrays id1 and id2 where grains have ids, else by their ends."""
        path, mesh = snapshot.path, read_mesh(snapshot.path)
        force, force_n = self.force_on_second(mesh), self.normal_force(mesh)
        ids = [mesh.line_arrays.get(name) for name in ("id1", "id2")]
        named = [whole_numbers(path, values) for values in ids if values is not None]
        if grains.id is not None and len(named) == 2:
            pairs = np.column_stack(named)
            joined = join_ids(path, grains, pairs, force, walls=self.walls, force_n=force_n)
        else:
            joined = join_positions(path, grains, mesh.points[mesh.lines], force, force_n)
        assert joined.contacts is not None
        contacts = self._proved(path, grains, joined.contacts, mesh)
        return joined._replace(contacts=contacts)

    def _proved(
        self, path: Path, grains: GrainTable, contacts: ContactList, mesh: Mesh
    ) -> ContactList:
        """The contacts with a force whose sign the format says, or the forces themselves."""
        if self.says_sign:
            return contacts
        names = [one for one in mesh.line_arrays if "force" in one.lower() and one != "force"]
        if names:
            warnings.warn(
                f"left out of the contacts: {', '.join(names)}: a force is taken from an array "
                f"`force` with three components",
                ScanfabNote,
                stacklevel=2,
            )
        if contacts.force is None:
            return contacts
        rows, force = np.asarray(contacts.pairs), np.asarray(contacts.force, np.float64)
        return contacts._replace(force=proved_force(path, grains, rows, force))

    def carries(self, path: Path) -> Carries:
        """LIGGGHTS writes a box beside its files; VTK itself has no cell."""
        if says_all(path):
            return "cell"
        return "nothing" if _read_box(path) is None else "box"

    def beside(self, path: Path) -> list[Path]:
        """The box of LIGGGHTS and the cell of YADE."""
        found = (_box_file(path), cell_file(path))
        return [file for file in found if file is not None]

    def _read_blocks(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The grains of the one file of a ``.vtm`` that has some, with the contacts of another."""
        _refuse_parts(snapshot, "a list of files itself")
        found: dict[FileKind, list[Path]] = {"grains": [], "contacts": []}
        for path in listed(snapshot.path, "DataSet", "file"):
            if form_of(path) not in (*BLOCKS, "Collection"):
                found.setdefault(self.kind(path), []).append(path)
        if len(found["grains"]) != 1 or len(found["contacts"]) > 1:
            raise ReadError(
                f"{snapshot.path}: expected one file of grains and at most one of contacts, found "
                f"{len(found['grains'])} and {len(found['contacts'])}: name one as the source"
            )
        table = self.read_grains(Snapshot(found["grains"][0]), options)
        for path in found["contacts"]:
            joined = self.read_contacts(Snapshot(path), options, table)
            table = table._replace(contacts=joined.contacts, wall_contacts=joined.wall_contacts)
        return table

    def _listed(self, index: Path) -> list[Snapshot]:
        """The frames of a ``.pvd``, in its order: the parts of one time are one frame."""
        kinds: dict[tuple[str, ...], FileKind] = {}
        frames: dict[float | None, dict[tuple[str, ...], Path]] = {}
        for path, time, part in _entries(index):
            # files of one name hold the same; some are boxes and contacts
            family = (re.sub(r"\d+", "*", path.name), *part)
            if kinds.get(family, "other") == "other":
                kinds[family] = self.kind(path)
            if kinds[family] not in ("grains", "points"):
                continue
            other = frames.setdefault(time, {}).setdefault(part, path)
            if other is not path:
                moment = "no timestep" if time is None else f"the timestep {time:g}"
                raise ReadError(
                    f"{index}: {other.name} and {path.name} have {moment} and the same part and "
                    f"group: expected another time, or another part of one frame"
                )
        unlike = {kind: name for (name, *_), kind in kinds.items() if kind in ("grains", "points")}
        if len(unlike) > 1:
            raise ReadError(
                f"{index}: {unlike['points']} are points without a radius beside the grains in "
                f"{unlike['grains']}: take them out of the list, or name the files as the source"
            )
        return [_frame(list(parts.values()), time) for time, parts in frames.items()]

    def force_on_second(self, mesh: Mesh) -> FloatArray | None:
        """Force, shape (M, 3): on the second grain, unless the format does not say on which."""
        return vectors(mesh, "force")

    def normal_force(self, mesh: Mesh) -> FloatArray | None:
        """The normal part: shape (M,), compression positive, or (M, 3), on the second grain."""
        return None


def vectors(mesh: Mesh, name: str) -> FloatArray | None:
    """An array of the lines that holds a vector for each, shape (M, 3); None without it."""
    values = mesh.line_arrays.get(name)
    if values is None or values.shape != (len(mesh.lines), 3) or values.dtype.kind not in "iuf":
        return None
    return doubles(values)


def _entries(index: Path) -> list[tuple[Path, float | None, tuple[str, ...]]]:
    """The files of a ``.pvd``, their times, and which group and part of a frame each is."""
    try:
        return [
            (
                file_inside(index, entry.attrib["file"]),
                float(entry.attrib["timestep"]) if "timestep" in entry.attrib else None,
                (entry.get("group", ""), entry.get("part", "0")),
            )
            for entry in elements(index).iter("DataSet")
        ]
    except (LookupError, ValueError) as error:
        raise ReadError(f"{index}: cannot be read as a list of VTK files: {error}") from None


def _frame(files: Sequence[Path], time: float | None) -> Snapshot:
    """Its step is the last number of the names that all parts have in common."""
    numbers = zip(*(re.findall(r"\d+", Path(bare_name(file)).stem) for file in files), strict=False)
    same = [int(one[0]) for one in numbers if len(set(one)) == 1]
    return Snapshot(files[0], same[-1] if same else None, time, parts=tuple(files[1:]))


def _refuse_parts(snapshot: Snapshot, what: str) -> None:
    """ReadError if a file that says all of a frame is one of several of its parts."""
    if snapshot.parts:
        names = ", ".join(part.name for part in snapshot.parts)
        raise ReadError(
            f"{snapshot.path}: is {what}, and cannot be joined with {names} of the same timestep: "
            f"name one as the source"
        )


def _box_file(path: Path) -> Path | None:
    match = re.fullmatch(r"(.*?)(\d+)\.\w+", bare_name(path))
    if match is None:
        return None
    for suffix in (".vtk", ".vtr", ".vtk.gz", ".vtr.gz"):
        beside = path.with_name(f"{match[1]}boundingBox_{match[2]}{suffix}")
        if beside.is_file():
            return beside
    return None


def _read_box(path: Path) -> Cell | None:
    """The box that LIGGGHTS writes beside a VTK dump; it does not say what is periodic."""
    file = _box_file(path)
    corners = np.zeros((0, 3)) if file is None else read_mesh(file).points
    if len(corners) == 0:
        return None
    low, edges = corners.min(axis=0), np.ptp(corners, axis=0)
    if not np.all((edges > 0) & (np.abs(corners).max(axis=0) < MOST)):
        return None
    return Cell(edges, (False, False, False), low)
