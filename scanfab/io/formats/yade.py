"""YADE: text exports, ``SpherePack.save``, ``VTKExporter``, ``VTKRecorder`` and ``O.save``."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import first_bytes, plain
from scanfab.io.formats.shared import FormsReader, GrainsOnly, cell_of, numbers
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.mesh import Mesh
from scanfab.io.reader import Carries, FileKind, GrainTable, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import WallForces

# first line of legacy VTK by VTKExporter; VTK itself writes no dot behind the version
EXPORTER_HEAD = b"# vtk DataFile Version 3.0.\n"
PERIODIC_HEAD = b"##PERIODIC::"
TEXT_HEADS = (b"#format ", PERIODIC_HEAD)
# the array that marks the interactions of VTKRecorder
RECORDED = b'Name="forceN"'
# a line of comment; the search is fast, as it begins with a literal
COMMENT = re.compile(rb"\n[ \t]*#[^\n]*")
# step and time of a saved simulation
STEP = re.compile(rb"<iter>\s*(\d{1,18})\s*</iter>")
TIME = re.compile(rb"<time>\s*(\d+\.?\d*(?:e[-+]?\d+)?)\s*</time>")
# the elements that are read for a sphere, and the defaults of missing ones
SPHERE = {"id": None, "groupMask": None, "clumpId": "-1", "shape/px/radius": None}
SPHERE |= {f"state/px/se3/position/{axis}": None for axis in "xyz"}
# the elements that are read for a contact; the first is the step at which it became real
CONTACT = ("iterMadeReal", "id1", "id2")
VECTORS = ("cellDist", "normalForce", "shearForce", "contactPoint")


class TextExport(GrainsOnly):
    """Reads text exports and ``SpherePack.save``."""

    name = "yade's text"

    def recognises(self, path: Path) -> bool:
        """Recognised by the first line of the file."""
        return first_bytes(path).startswith(TEXT_HEADS)

    def carries(self, path: Path) -> Carries:
        """``SpherePack.save`` has a cell if the sample is periodic; exports have none."""
        return "cell" if first_bytes(path).startswith(PERIODIC_HEAD) else "nothing"

    def table(self, snapshot: Snapshot) -> tuple[Columns, Cell | None]:
        """The columns by the names in the first line; attributes are named in the second."""
        path = snapshot.path
        rows = COMMENT.sub(b"\n", b"\n" + text_of(snapshot))[1:]
        width = len(rows.lstrip().split(b"\n", 1)[0].split())
        head, second = [*first_bytes(path, 1 << 14).decode("utf-8", "replace").splitlines(), ""][:2]
        cell, names = None, head.removeprefix("#format").strip().split("_")
        if head.startswith("##PERIODIC::"):
            names = ["x", "y", "z", "r", "clumpId"][: width or None]
            lengths = numbers(f"{path}, line 1", head.removeprefix("##PERIODIC::").encode(), 3)
            cell = cell_of(path, lengths, (True, True, True), np.zeros(3))
        elif names[-1] == "attrs":
            named = re.fullmatch(r"#\s*(x y z r( .*)?)", second)
            names = named[1].split() if named else names[:-1]
            names += [f"attr{number}" for number in range(1, width - len(names) + 1)]
        if width not in (0, len(names)):
            raise ReadError(f"{path}: line 1 names {len(names)} columns, but the rows have {width}")
        return read_rows(snapshot, rows, Layout(tuple(names))), cell


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
        cell = cell_of(path, sides, (True, True, True), np.zeros(3)) if is_periodic else None
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


class YadeVtk(VtkReader):
    """Reads files of VTKExporter and VTKRecorder."""

    walls = True
    force_arrays = ("force", "normalForce", "shearForce")
    sign = 1.0

    def kind(self, path: Path) -> FileKind:
        """Interactions of VTKRecorder by an array, because reading them may raise an error."""
        return "contacts" if RECORDED in first_bytes(path) else super().kind(path)

    def forces(self, mesh: Mesh) -> tuple[FloatArray | None, FloatArray | None]:
        """The forces on the second body; the normal force of VTKRecorder has shape (M,)."""
        force, normal = super().forces(mesh)
        recorded = mesh.line_arrays.get("forceN")
        is_recorded = normal is None and recorded is not None and recorded.ndim == 1
        return force, recorded if is_recorded else normal


class YadeReader(FormsReader):
    """Reader plugin for the files of YADE."""

    name = "yade"
    description = "YADE export.VTKExporter, VTKRecorder, export.text, export.textExt, O.save (XML)"
    extensions = (".vtk", ".vtu", ".vtp", ".txt", ".xml", ".yade")
    forms = (TextExport(), SavedScene(), YadeVtk())

    def recognises(self, path: Path) -> bool:
        """Recognised by YADE's own first lines, or by an array of VTKRecorder's interactions."""
        head = first_bytes(path)
        is_recorded = b"<VTKFile" in head and RECORDED in head
        is_vtk = is_recorded or head.startswith(EXPORTER_HEAD)
        return is_vtk or any(form.recognises(path) for form in self.forms[:-1])
