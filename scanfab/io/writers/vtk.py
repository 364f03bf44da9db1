"""
Write packings as VTK PolyData (``.vtp``) and as ON-DEM's VTKHDF, draft 0.1.

Spheres are points. Contacts are lines between them in PolyData, and a table in ON-DEM. Data without
a name in ON-DEM's draft (cell, images, total force) get names of scanfab.
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

# groups of ON-DEM, and the attributes of its scene for the names in writer.Arrays
SCENE, BODIES, INTERACTIONS = "ONDEM/Scene", "ONDEM/Bodies/sphere", "ONDEM/Interactions"
SCENE_NAMES = {"step": "iteration", "time": "time", "cell": "cell"}
SCENE_NAMES |= {"origin": "cell_origin", "periodic": "cell_periodic"}
# replaces / in names of columns, because / would create a group
STROKE = "\u2215"


class VtpWriter:
    """PolyData by VTK's own writer, with numbers in binary form."""

    name = "vtp"
    description = "VTK PolyData: spheres as points, contacts as lines, the cell as field data"
    extensions = (".vtp",)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; the file holds all data of the packing."""
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
        # VTK writes into memory and Python to the disk, so that a full disk raises OSError
        writer.WriteToOutputStringOn()
        writer.Write()
        said = " ".join(f"{FIELDS[k]}={frame[k]!r}" for k in ("step", "time") if k in frame)
        text: Any = writer.GetOutputString()
        content = text if isinstance(text, bytes) else text.encode()
        path.write_bytes(f"<!-- {said} -->\n".encode() + content)
        return Left(no_step=False, notes=tuple(arrays.notes))


def _array(name: str, values: AnyArray) -> Any:
    """A VTK array; its name is escaped, as VTK's writer does not do it."""
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
    """Step and time, if the first bytes of a file have them."""
    head = first_bytes(path, HEAD)
    step, time = STEP.search(head), TIME.search(head)
    return step and int(step[1]), time and float(time[1])


def says_all(path: Path) -> bool:
    """Whether scanfab wrote the file; then it states the cell and the step completely."""
    return KNOWN.encode() in first_bytes(path, HEAD)


def packing_of(path: Path, mesh: Mesh) -> tuple[Cell | None, ContactList | None] | None:
    """The cell and the contacts of a file that scanfab wrote; None for other files."""
    fields = mesh.field_arrays
    if KNOWN not in fields:
        return None
    cell = {name: fields[array] for name, array in FIELDS.items() if array in fields}
    contacts = contacts_of(mesh.lines, mesh.line_arrays) if np.any(fields[KNOWN]) else None
    return cell_of(path, cell), contacts


def write_on_dem(packing: Packing, path: Path) -> Left:
    """Write one frame; the file holds all data of the packing."""
    import h5py

    arrays, count = as_arrays(packing), len(packing)
    columns = {**arrays.grains, **arrays.own}
    columns["body_id"] = columns.pop("id")
    # VTK cannot read texts as point data
    texts = {name: values for name, values in columns.items() if values.dtype.kind == "U"}
    # in memory first, because HDF5 ends the process if the disk is full
    with h5py.File(path, "w", driver="core", backing_store=False, track_order=True) as file:
        file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.1-draft")
        file.attrs["source_code"] = "scanfab"
        # PolyData with a vertex at each point, so that ParaView shows the points
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
        _write(points, {name: values for name, values in columns.items() if name not in texts})
        if texts:
            _write(file.create_group(BODIES), {"body_id": packing.id, **texts})
        scene = file.create_group(SCENE)
        scene.attrs["scanfab"] = 1
        for name, value in arrays.frame.items():
            scene.attrs[SCENE_NAMES[name]] = np.int8(value) if name == "periodic" else value
        if (contacts := packing.contacts) is not None:
            group = file.create_group(INTERACTIONS)
            group.attrs["count"] = len(contacts)
            # the parts of the force that the draft names, and the exact total force
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
