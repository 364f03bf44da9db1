"""Packings as VTK's PolyData (``.vtp``): spheres as points, contacts as lines between them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from scanfab.io.files import first_bytes
from scanfab.io.writer import Left
from scanfab.io.written import (
    cell_of,
    contact_arrays,
    contacts_of,
    frame_arrays,
    own_columns,
    standard_columns,
)
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

if TYPE_CHECKING:
    from scanfab.io.mesh import Mesh

# step and time stand in the first line, so that a series is listed without reading its files
NUMBER = rb"(?P<time>[-+]?\d[\d.]{0,30}(?:[eE][-+]?\d{1,3})?)"
MARK = re.compile(rb"\A<!-- scanfab step=(?P<step>-?\d{1,18})? time=" + NUMBER + rb"? -->")
TIME = re.compile(rb'(?P<step>)Name="TimeValue"[^>]*format="ascii"[^>]*>\s*' + NUMBER + rb"\s*<")
# the array of the file as a whole that says whether contacts are known, and the others
KNOWN = "scanfab_contacts"
FIELDS = {name: f"scanfab_{name}" for name in ("step", "cell", "origin", "periodic")}
FIELDS["time"] = "TimeValue"


class VtpWriter:
    """PolyData by VTK's own writer, with all numbers as bytes."""

    name = "vtp"
    description = "VTK PolyData: spheres as points, contacts as lines, the cell as field data"
    extensions = (".vtp",)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; it holds everything."""
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

        own, notes = own_columns(packing)
        frame, contacts, cells = frame_arrays(packing), packing.contacts, contact_arrays(packing)
        fields = {FIELDS[name]: np.ravel(values)[None] for name, values in frame.items()}
        fields[KNOWN] = np.array([int(contacts is not None)])
        columns = {**standard_columns(packing), "radius": packing.radius, **own}
        data, points, lines = vtkPolyData(), vtkPoints(), vtkCellArray()
        points.SetData(_array("Points", packing.position))
        data.SetPoints(points)
        if contacts is not None and len(contacts):
            lines.SetData(2, _array("", contacts.pairs.ravel()))
            data.SetLines(lines)
            cells |= zip(("id1", "id2"), packing.id[contacts.pairs].T, strict=True)
        for place, arrays in (
            (data.GetPointData(), columns),
            (data.GetCellData(), cells),
            (data.GetFieldData(), fields),
        ):
            for name, values in arrays.items():
                place.AddArray(_array(name, values))
        writer = vtkXMLPolyDataWriter()
        writer.SetInputData(data)
        writer.SetHeaderTypeToUInt64()
        writer.SetCompressorTypeToNone()
        writer.EncodeAppendedDataOff()
        # a full disk is an OSError if VTK writes into memory first
        writer.WriteToOutputStringOn()
        writer.Write()
        text = writer.GetOutputString()
        step, time = ("" if one is None else repr(one) for one in (packing.step, packing.time))
        mark = f"<!-- scanfab step={step} time={time} -->\n".encode()
        path.write_bytes(mark + (text if isinstance(text, bytes) else text.encode()))
        return Left(no_step=False, notes=tuple(notes))


def _array(name: str, values: npt.NDArray[Any]) -> Any:
    """An array of VTK, whose writer puts names between quotes as they are."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkStringArray

    if values.dtype.kind == "U":
        array = vtkStringArray()
        array.SetNumberOfComponents(int(np.prod(values.shape[1:])))
        array.SetNumberOfValues(values.size)
        for place, word in enumerate(values.ravel().tolist()):
            array.SetValue(place, word)
    else:
        numbers = values.astype(np.uint8) if values.dtype.kind == "b" else values
        table = numbers.reshape(len(values), int(np.prod(values.shape[1:])))
        array = numpy_to_vtk(np.ascontiguousarray(table), deep=True)  # type: ignore[no-untyped-call]
    array.SetName(escape(name, {'"': "&quot;"}))
    return array


def moment_of(path: Path) -> tuple[int | None, float | None]:
    """Step and time of a file that scanfab wrote; the time of others, if it stands as text."""
    head = first_bytes(path, 1 << 14)
    match = MARK.match(head) or TIME.search(head)
    step, time = (None, None) if match is None else match.group("step", "time")
    return int(step) if step else None, float(time) if time else None


def says_all(path: Path) -> bool:
    """Whether scanfab wrote the file, so that there is no cell or step but those in it."""
    return MARK.match(first_bytes(path)) is not None


def is_packing(mesh: Mesh) -> bool:
    """Whether a file says all that there is to say, contacts and cell as well."""
    return KNOWN in mesh.field_arrays


def packing_cell(path: Path, mesh: Mesh) -> Cell | None:
    """The cell of a packing."""
    fields = mesh.field_arrays
    return cell_of(path, {name: fields[own] for name, own in FIELDS.items() if own in fields})


def packing_contacts(path: Path, mesh: Mesh) -> ContactList | None:
    """The contacts of a packing; None if they were not known."""
    if not np.any(mesh.field_arrays[KNOWN]):
        return None
    return contacts_of(path, mesh.lines, mesh.line_arrays)
