"""YADE: text exports, ``SpherePack.save``, ``VTKExporter``, ``VTKRecorder`` and ``O.save``."""

from __future__ import annotations

import re
from pathlib import Path

from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table
from scanfab.io.files import first_bytes
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.formats.yade_save import is_binary_save, is_save, read_save, snapshot_of_save
from scanfab.io.mesh import Mesh
from scanfab.io.reader import Carries, FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.io.text import Layout, read_rows, text_of
from scanfab.packing.cell import Cell

# legacy VTK by VTKExporter: VTK itself writes no dot behind the version
EXPORTER_HEAD = b"# vtk DataFile Version 3.0.\n"
PERIODIC_HEAD = b"##PERIODIC::"
TEXT_HEADS = (b"#format ", PERIODIC_HEAD)
# an array that VTKRecorder's interactions have
RECORDED = b'Name="forceN"'
COMMENT = re.compile(rb"^[ \t]*#[^\n]*", re.MULTILINE)


class YadeReader(VtkReader):
    """Reader plugin for what YADE exports."""

    name = "yade"
    description = "YADE export.VTKExporter, VTKRecorder, export.text, export.textExt, O.save (XML)"
    extensions = (".vtk", ".vtu", ".vtp", ".txt", ".xml", ".yade")
    generic = False
    walls = True
    force_arrays = ("force", "normalForce", "shearForce")
    sign = 1.0

    def recognises(self, path: Path) -> bool:
        """YADE's own first lines, or the arrays of VTKRecorder's interactions."""
        head = first_bytes(path)
        is_own = head.startswith((EXPORTER_HEAD, *TEXT_HEADS))
        is_recorded = b"<VTKFile" in head and RECORDED in head
        return is_own or is_recorded or is_save(path) or is_binary_save(path)

    def kind(self, path: Path) -> FileKind:
        """A text export and a saved simulation hold grains."""
        if is_binary_save(path):
            raise ReadError(
                f"{path}: YADE's binary format can be read by the same build of YADE only: load it "
                f"there, and save it as XML: O.save('name.xml.bz2')"
            )
        if RECORDED in first_bytes(path):
            return "contacts"  # reading them may be refused: see `mesh`
        return "grains" if _is_text(path) or is_save(path) else super().kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One; a saved simulation says which step it is."""
        return [snapshot_of_save(path)] if is_save(path) else super().snapshots(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Text columns by the names of the first line; VTK arrays by their own."""
        if is_save(snapshot.path):
            return read_save(snapshot, options)
        if _is_text(snapshot.path):
            return _read_text(snapshot, options)
        return super().read_grains(snapshot, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Lines between centres; a wall's end is where no grain is."""
        if _is_text(snapshot.path) or is_save(snapshot.path):
            raise ReadError(f"{snapshot.path}: expected contacts, found grains")
        return super().read_contacts(snapshot, options, grains)

    def carries(self, path: Path) -> Carries:
        """A saved simulation and ``SpherePack.save`` say whether the sample is periodic."""
        says = first_bytes(path).startswith(PERIODIC_HEAD) or is_save(path)
        return "cell" if says else super().carries(path)

    def forces(self, mesh: Mesh) -> tuple[FloatArray | None, FloatArray | None]:
        """Those that act on the second body; VTKRecorder's normal force is a number."""
        force, normal = super().forces(mesh)
        recorded = mesh.line_arrays.get("forceN")
        is_recorded = normal is None and recorded is not None and recorded.ndim == 1
        return force, recorded if is_recorded else normal


def _is_text(path: Path) -> bool:
    return first_bytes(path).startswith(TEXT_HEADS)


def _read_text(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """Columns by the names in the first line, or in the second one for attributes."""
    path = snapshot.path
    rows = COMMENT.sub(b"", text_of(snapshot))
    width = len(rows.lstrip().split(b"\n", 1)[0].split())
    head, second = [*first_bytes(path, 1 << 14).decode("utf-8", "replace").splitlines(), ""][:2]
    cell, names = None, head.removeprefix("#format").strip().split("_")
    if head.startswith("##PERIODIC::"):
        names = ["x", "y", "z", "r", "clumpId"][: width or None]
        try:
            cell = Cell([float(word) for word in head.removeprefix("##PERIODIC::").split()])
        except (ValueError, PackingError):
            raise ReadError(f"{path}, line 1: expected three lengths, found {head!r}") from None
    elif names[-1] == "attrs":
        named = re.fullmatch(r"#\s*(x y z r( .*)?)", second)
        names = named[1].split() if named else names[:-1]
        names += [f"attr{number}" for number in range(1, width - len(names) + 1)]
    if width not in (0, len(names)):
        raise ReadError(f"{path}: the first line names {len(names)} columns, the rows have {width}")
    return grain_table(path, read_rows(snapshot, rows, Layout(tuple(names))), cell, options)
