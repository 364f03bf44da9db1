"""YADE: text exports, ``SpherePack.save``, ``VTKExporter``, ``VTKRecorder`` and ``O.save``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import FormsReader, GrainsOnly, cell_of, numbers
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.formats.yade_save import SavedScene
from scanfab.io.mesh import Mesh
from scanfab.io.reader import Carries, FileKind, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell

# first line of legacy VTK by VTKExporter; VTK itself writes no dot behind the version
EXPORTER_HEAD = b"# vtk DataFile Version 3.0.\n"
PERIODIC_HEAD = b"##PERIODIC::"
TEXT_HEADS = (b"#format ", PERIODIC_HEAD)
# the array that marks the interactions of VTKRecorder
RECORDED = b'Name="forceN"'
# a line of comment; the search is fast, as it begins with a literal
COMMENT = re.compile(rb"\n[ \t]*#[^\n]*")


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
    lists_contacts = True
    forms = (TextExport(), SavedScene(), YadeVtk())

    def recognises(self, path: Path) -> bool:
        """Recognised by YADE's own first lines, or by an array of VTKRecorder's interactions."""
        head = first_bytes(path)
        is_recorded = b"<VTKFile" in head and RECORDED in head
        is_vtk = is_recorded or head.startswith(EXPORTER_HEAD)
        return is_vtk or any(form.recognises(path) for form in self.forms[:-1])
