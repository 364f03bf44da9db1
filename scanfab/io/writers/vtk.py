"""
Packings as VTK's PolyData (``.vtp``) and as ON-DEM's VTKHDF, draft 0.1.

Spheres are points. In PolyData contacts are lines between them; ON-DEM has a table of them. What
its draft has no name for (the cell, images, the whole force) has a name of ours.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from scanfab.base.typing import AnyArray, Columns
from scanfab.io.files import first_bytes
from scanfab.io.writer import Left, as_arrays, cell_of, contacts_of
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing

if TYPE_CHECKING:
    from scanfab.io.mesh import Mesh

# step and time, as a comment in the first line, so that a series is listed without reading its
# files; or as other programs write them, as text
STEP = re.compile(rb"scanfab_step=(-?\d{1,30})[\s<]")
TIME = re.compile(
    rb'TimeValue(?:=|"[^>]*format="ascii"[^>]*>\s*)([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)[\s<]'
)
# the elements of the arrays of the file as a whole are in its first bytes
HEAD = 1 << 14
# the array of the file as a whole that says whether contacts are known, and the others
KNOWN = "scanfab_contacts"
FIELDS = {name: f"scanfab_{name}" for name in ("step", "cell", "origin", "periodic")}
FIELDS["time"] = "TimeValue"

# the groups of ON-DEM, and the attributes of its scene by the names of writer.Arrays
SCENE, BODIES, INTERACTIONS = "ONDEM/Scene", "ONDEM/Bodies/sphere", "ONDEM/Interactions"
SCENE_NAMES = {"step": "iteration", "time": "time", "cell": "cell"}
SCENE_NAMES |= {"origin": "cell_origin", "periodic": "cell_periodic"}
# stands for / in the names of columns, which would make a group
STROKE = "\u2215"


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

        arrays, contacts = as_arrays(packing), packing.contacts
        frame = arrays.frame
        fields = {FIELDS[name]: np.ravel(values)[None] for name, values in frame.items()}
        fields[KNOWN] = np.array([int(contacts is not None)])
        data, points, lines = vtkPolyData(), vtkPoints(), vtkCellArray()
        points.SetData(_array("Points", packing.position))
        data.SetPoints(points)
        if contacts is not None and len(contacts):
            lines.SetData(2, _array("", contacts.pairs.ravel()))
            data.SetLines(lines)
        for place, columns in (
            (data.GetPointData(), arrays.grains | arrays.own),
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
        # a full disk is an OSError if VTK writes into memory first
        writer.WriteToOutputStringOn()
        writer.Write()
        said = " ".join(f"{FIELDS[one]}={frame[one]!r}" for one in ("step", "time") if one in frame)
        text: Any = writer.GetOutputString()
        content = text if isinstance(text, bytes) else text.encode()
        path.write_bytes(f"<!-- {said} -->\n".encode() + content)
        return Left(no_step=False, notes=tuple(arrays.notes))


def _array(name: str, values: AnyArray) -> Any:
    """An array of VTK, whose writer puts names between quotes as they are."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkStringArray

    if values.dtype.kind == "U":
        array = vtkStringArray()
        array.SetNumberOfComponents(int(np.prod(values.shape[1:])))
        for word in values.ravel().tolist():
            array.InsertNextValue(word)
    else:
        numbers = values.astype(np.uint8) if values.dtype.kind == "b" else values
        table = numbers.reshape(len(values), int(np.prod(values.shape[1:])))
        array = numpy_to_vtk(np.ascontiguousarray(table), deep=True)  # type: ignore[no-untyped-call]
    array.SetName(escape(name, {'"': "&quot;"}))
    return array


def moment_of(path: Path) -> tuple[int | None, float | None]:
    """Step and time, if they stand in the first bytes of a file."""
    head = first_bytes(path, HEAD)
    step, time = STEP.search(head), TIME.search(head)
    return step and int(step[1]), time and float(time[1])


def says_all(path: Path) -> bool:
    """Whether scanfab wrote the file, so that there is no cell or step but those in it."""
    return KNOWN.encode() in first_bytes(path, HEAD)


def packing_of(path: Path, mesh: Mesh) -> tuple[Cell | None, ContactList | None] | None:
    """The cell and the contacts of a file that scanfab wrote; None for other files."""
    fields = mesh.field_arrays
    if KNOWN not in fields:
        return None
    cell = {name: fields[own] for name, own in FIELDS.items() if own in fields}
    contacts = contacts_of(mesh.lines, mesh.line_arrays) if np.any(fields[KNOWN]) else None
    return cell_of(path, cell), contacts


def write_on_dem(packing: Packing, path: Path) -> Left:
    """Write one frame; it holds everything."""
    import h5py

    arrays, count = as_arrays(packing), len(packing)
    columns = {**arrays.grains, **arrays.own}
    columns["body_id"] = columns.pop("id")
    # VTK reads no texts at points
    texts = {name: values for name, values in columns.items() if values.dtype.kind == "U"}
    # in memory first: on a full disk HDF5 ends the process
    with h5py.File(path, "w", driver="core", backing_store=False, track_order=True) as file:
        file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.1-draft")
        file.attrs["source_code"] = "scanfab"
        # PolyData with a vertex at each point, so that ParaView shows them
        group = file.create_group("VTKHDF", track_order=True)
        group.attrs.update(Type=np.bytes_("PolyData"), Version=np.array([2, 0]))
        group["NumberOfPoints"] = np.array([count])
        group["Points"] = packing.position
        for cells in ("Vertices", "Lines", "Polygons", "Strips"):
            filled = count if cells == "Vertices" else 0
            group[f"{cells}/NumberOfCells"] = np.array([filled])
            group[f"{cells}/NumberOfConnectivityIds"] = np.array([filled])
            group[f"{cells}/Connectivity"] = np.arange(filled)
            group[f"{cells}/Offsets"] = np.arange(filled + 1)
        points = group.create_group("PointData", track_order=True)
        _write(points, {name: one for name, one in columns.items() if name not in texts})
        if texts:
            _write(file.create_group(BODIES), {"body_id": packing.id, **texts})
        scene = file.create_group(SCENE)
        scene.attrs["scanfab"] = 1
        for name, value in arrays.frame.items():
            scene.attrs[SCENE_NAMES[name]] = np.int8(value) if name == "periodic" else value
        if (contacts := packing.contacts) is not None:
            group = file.create_group(INTERACTIONS)
            group.attrs["count"] = len(contacts)
            # as the draft has them, and the whole force, which no rounding has touched
            table = {**arrays.contacts, "virtual": np.zeros(len(contacts), np.int8)}
            table |= {"normal": contacts.normal, "contact_point": contacts.point}
            table.pop("force_n", None)
            if contacts.force_n is not None:
                table["normal_force"] = contacts.force_n
            if contacts.force is not None and contacts.force_n is not None:
                normal_part = contacts.force_n[:, None] * contacts.normal
                table["shear_force"] = contacts.force - normal_part
            _write(group, table)
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)
    return Left(no_step=False, notes=tuple(arrays.notes))


def _write(group: Any, columns: Columns) -> None:
    import h5py

    for name, values in columns.items():
        plain = name.replace("/", STROKE)
        if values.dtype.kind == "U":
            group.create_dataset(plain, data=values.astype(object), dtype=h5py.string_dtype())
        else:
            group[plain] = values.astype(np.uint8) if values.dtype.kind == "b" else values
