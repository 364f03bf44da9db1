"""
Read any file of VTK as a mesh: points, lines between them, and the arrays of both.

VTK's own readers do the work, in the worker process of `fence`, because a damaged header may crash
them. They raise no errors, but write into VTK's output window; any text there counts as an error.
VTK does not report two faults at all. It fills the arrays of a truncated legacy file with zeros;
therefore an extra array is appended to the content, and must be found last. And it drops surplus
values of an XML array; therefore the values are counted before VTK reads the file.
"""

from __future__ import annotations

import base64
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError, warn
from scanfab.base.typing import AnyArray, Columns, FloatArray, IntArray
from scanfab.io.binary_files import is_hdf, read_hdf_file
from scanfab.io.fence import fenced
from scanfab.io.files import file_inside, first_bytes, plain

# kinds of files that hold a mesh, and of files that list the pieces of one mesh
MESHES = {"polydata", "unstructuredgrid", "unstructured_grid", "rectilineargrid", "xdmf"}
MESHES |= {"rectilinear_grid", "multiblockdataset", "partitioneddatasetcollection"}
PIECES = ("PPolyData", "PUnstructuredGrid")
# VTK's numbers of cell types
VERTEX, POLY_VERTEX, LINE, POLY_LINE = 1, 2, 3, 4
# bit of vtkGhostType for a point that belongs to another piece
DUPLICATE = 1
# messages without harm: VTK writes a NaN into keys that describe arrays, and cannot read it back
HARMLESS = re.compile("InformationKey|Could not locate key")
FORM = re.compile(
    rb"\A# vtk DataFile.*?^\s*DATASET\s+(\w+)|<VTKFile[^>]*\btype=[\"'](\w+)|<(Xdmf)\b",
    re.MULTILINE | re.DOTALL,
)
TEXT = re.compile(rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*ASCII\s", re.IGNORECASE)
NO_POINTS = re.compile(rb"# vtk.*^POINTS\s+0\s", re.MULTILINE | re.DOTALL)
# sections of XML whose arrays have a row for each point or each cell
COUNTED = ("Points", "PointData", "CellData")
BASE64 = re.compile(r"[A-Za-z0-9+/=]*")
# an array without values, which is appended to the content of a legacy file
END = "scanfab_end"
APPENDED = f"FIELD scanfab 1\n{END} 1 0 int\n".encode()


class Mesh(NamedTuple):
    """The content of a VTK file."""

    points: FloatArray
    """Shape (N, 3); for a rectilinear grid its two corners."""
    point_arrays: Columns
    """Arrays of the points, N rows each."""
    lines: IntArray
    """Rows of the points at both ends of each line, shape (M, 2)."""
    line_arrays: Columns
    """Arrays of the lines, M rows each."""
    has_faces: bool
    """Whether the mesh has triangles, boxes or other cells besides points and lines."""
    field_arrays: Columns
    """Arrays of the file as a whole, with any number of rows."""


NO_LINES: IntArray = np.zeros((0, 2), np.int64)


def form_of(path: Path) -> str | None:
    """The kind in the header, such as ``PolyData`` or ``Xdmf``; None if it is not a VTK file."""
    head = first_bytes(path)
    if is_hdf(head):
        form = read_hdf_file(path, with_data=False).attributes.get("VTKHDF", {}).get("Type")
        return form if isinstance(form, str) else None
    match = FORM.search(head)
    return match[match.lastindex or 0].decode() if match else None


def holds_mesh(form: str | None) -> bool:
    """Whether a file of this kind holds points and cells, or lists pieces that do."""
    return form is not None and (form.lower() in MESHES or form in PIECES)


def read_mesh(path: Path) -> Mesh:
    """
    Read a VTK file, or the pieces that it lists.

    Raises
    ------
    ReadError
        If a file is damaged, incomplete, or does not hold a mesh.
    """
    form, head = form_of(path), first_bytes(path)
    if form is None or not holds_mesh(form):
        found = form or "something else"
        raise ReadError(f"{path}: expected a VTK file with points, found {found}")
    if form in PIECES:
        pieces = listed(path, "Piece", "Source")
        if any(form_of(piece) in PIECES for piece in pieces):
            raise ReadError(f"{path}: one of its pieces lists pieces itself")
        return _joined(path, [read_mesh(piece) for piece in pieces])
    if NO_POINTS.match(head):
        # VTK reports an empty file as an error
        return Mesh(np.zeros((0, 3)), {}, NO_LINES, {}, False, {})
    for item in elements(path).iter() if form == "Xdmf" else ():
        if "include" in item.tag.lower():
            raise ReadError(f"{path}: XDMF that includes other files is not read")
        if item.get("Format", "").upper() in ("HDF", "BINARY"):
            # ReadError if this file is outside the folder
            file_inside(path, (item.text or "").strip().partition(":")[0])
    mesh = fenced(mesh_in_worker, path)
    if TEXT.match(head) and not plain(path).read_bytes()[-1:].isspace():
        warn(f"{path}: the last line has no end: its last number may be cut off")
    return mesh


def elements(path: Path) -> ElementTree.Element:
    """The root element of an XML file that lists other files."""
    try:
        return ElementTree.fromstring(plain(path).read_bytes())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ReadError(f"{path}: cannot be read as a list of VTK files: {error}") from None


def listed(path: Path, tag: str, key: str) -> list[Path]:
    """
    The files that an XML file lists, for instance ``<Piece Source="...">``, in the same order.

    Raises
    ------
    ReadError
        If a listed file is outside the folder of the list, or does not exist.
    """
    names = [element.attrib[key] for element in elements(path).iter(tag) if key in element.attrib]
    return [file_inside(path, name) for name in names]


def joined_arrays(parts: Sequence[Columns]) -> Columns:
    """Concatenate the arrays that all parts have, with equal numbers of components."""
    joined: Columns = {}
    for name in parts[0]:
        same_name = [part[name] for part in parts if name in part]
        if len(same_name) == len(parts) and len({values.shape[1:] for values in same_name}) == 1:
            joined[name] = np.concatenate(same_name)
    return joined


def _joined(path: Path, parts: Sequence[Mesh]) -> Mesh:
    """Concatenate the parts of a mesh; empty parts are left out, as VTK drops their arrays."""
    filled = [part for part in parts if len(part.points)] or list(parts[:1])
    if not filled:
        raise ReadError(f"{path}: expected a piece, found none")
    starts = np.cumsum([0, *(len(part.points) for part in filled)])
    return filled[0]._replace(
        points=np.concatenate([part.points for part in filled]),
        point_arrays=joined_arrays([part.point_arrays for part in filled]),
        lines=np.concatenate([part.lines + at for part, at in zip(filled, starts, strict=False)]),
        line_arrays=joined_arrays([part.line_arrays for part in filled]),
        has_faces=any(part.has_faces for part in filled),
    )


# the functions below run in the worker process: they raise ValueError, and the fence adds the path


def mesh_in_worker(path: str) -> Mesh:
    """The mesh of one file; blocks of a file are joined."""
    data = _read_by_vtk(path)
    if not data.IsA("vtkCompositeDataSet"):
        return _mesh_of(data)
    blocks, iterator = [], data.NewIterator()
    while not iterator.IsDoneWithTraversal():
        blocks.append(_mesh_of(iterator.GetCurrentDataObject()))
        iterator.GoToNextItem()
    return _joined(Path(path), blocks)


def faces_in_worker(path: str) -> tuple[FloatArray, list[IntArray]]:
    """The points of a PolyData file, and its faces, which VTK cuts into triangles."""
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    data, triangles = _read_by_vtk(path), vtkTriangleFilter()
    points = _mesh_of(data).points
    triangles.SetInputData(data)
    triangles.Update()
    _, named = _cells(triangles.GetOutput().GetPolys(), len(points))
    return points, [named.reshape(-1, 3)]


def damaged(reason: str) -> ValueError:
    """The error for a file whose content does not match its headers."""
    return ValueError(f"the file is damaged or incomplete: {reason}")


def _read_by_vtk(path: str) -> Any:
    """VTK's data set of a file; ValueError if VTK wrote an error into its output window."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    content = Path(path).read_bytes()
    reader = _reader(path, content)
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    texts = window.GetOutput().split("\n\n\n")
    said = [text for text in texts if text and not HARMLESS.search(text)]
    if said or data is None:
        reason = re.sub(r"^.*(\n.*\((0x[0-9a-f]+|nullptr)\):)?", "", said[0] if said else "no data")
        raise damaged(" ".join(reason.split()))
    if content.startswith(b"# vtk"):
        places = (data.GetFieldData(), data.GetPointData(), data.GetCellData())
        last = next((place for place in places if place.HasArray(END)), None)
        # POINT_DATA and CELL_DATA need an array of their own: if there is only ours, it was cut off
        if last is None or (last is not places[0] and last.GetNumberOfArrays() == 1):
            raise damaged("it has fewer or more values than its headers say")
        last.RemoveArray(END)
    return data


def _reader(path: str, content: bytes) -> Any:
    """VTK's reader of a file; a legacy file is read from memory, with an array appended."""
    reader: Any
    if content.startswith(b"# vtk"):
        from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader

        reader = vtkGenericDataObjectReader()
        for kind in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "Fields"):
            getattr(reader, f"ReadAll{kind}On")()
        # for text only: if binary values are missing, VTK would read the empty lines in their place
        content += b"\n\n" * bool(TEXT.match(content)) + APPENDED
        reader.ReadFromInputStringOn()
        reader.SetBinaryInputString(content, len(content))
        return reader
    if is_hdf(content):
        from vtkmodules.vtkIOHDF import vtkHDFReader

        reader = vtkHDFReader()
    elif b"<Xdmf" in content[:4096]:
        from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

        reader = vtkXdmfReader()
    else:
        from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

        _check_counts(content)
        reader = vtkXMLGenericDataObjectReader()
    reader.SetFileName(path)
    return reader


def _check_counts(content: bytes) -> None:
    """ValueError if an array of an XML file has fewer or more values than its piece counts."""
    end = content.find(b"<AppendedData")
    try:
        # raw bytes may follow the elements
        root = ElementTree.fromstring(content if end < 0 else content[:end] + b"</VTKFile>")
        for piece in root.iter("Piece"):
            counts = {name[8:]: int(word) for name, word in piece.items() if name[:8] == "NumberOf"}
            points, count = counts.get("Points", 0), sum(counts.values())
            rows = {**counts, "Points": points, "PointData": points, "CellData": count - points}
            for section, array in ((child.tag, array) for child in piece for array in child):
                name = array.get("Name", section)
                # not connectivity, which has a row for each point of each cell
                is_counted = section in COUNTED or name in ("offsets", "types")
                if section not in rows or not is_counted or array.get("type") == "String":
                    continue
                expected = rows[section] * int(array.get("NumberOfComponents") or 1)
                stored = _stored(content, array, root, end)
                if section == "CellData" and stored > expected:
                    # VTK would assign the values to the wrong lines
                    problem = f"{name} has {stored} values for {expected} contacts: VTKRecorder"
                    advice = 'use VTKExporter or `contacts="geometric"`'
                    raise ValueError(f"{problem} loses those across a periodic cell: {advice}")
                if stored != expected:
                    raise ValueError(f"{name} has {stored} of {expected} values")
    except (ElementTree.ParseError, ValueError, LookupError, TypeError) as error:
        raise damaged(str(error)) from None


def _stored(content: bytes, array: ElementTree.Element, root: ElementTree.Element, end: int) -> int:
    """The number of values in an array: its words, or the size stored before its bytes."""
    text = " ".join([array.text or "", *(child.tail or "" for child in array)]).strip()
    if array.get("format") == "ascii":
        return len(text.split())
    width = 8 if root.get("header_type") == "UInt64" else 4
    head = text[: 4 * width].encode()
    if array.get("format") == "appended":
        start = content.index(b"_", end) + 1 + int(array.attrib["offset"])
        head = content[start : start + 4 * width]
    elif not BASE64.fullmatch(text):
        # VTK skips letters that are not base64, which shifts the values behind them
        raise ValueError("an array is not valid base64")
    if array.get("format") != "appended" or b"raw" not in content[end : end + 100]:
        digits = head.split(b"=")[0]
        head = base64.b64decode(digits + b"=" * (-len(digits) % 4))
    kind = f"{'>' if root.get('byte_order') == 'BigEndian' else '<'}u{width}"
    size, full, last = np.frombuffer(head.ljust(3 * width, b"\0"), kind, 3).tolist()
    if root.get("compressor"):
        # all compressed blocks are full, except perhaps the last one
        size = size * full - (full - last if size and last else 0)
    return int(size) // np.dtype(array.attrib["type"].lower()).itemsize


def _numpy(array: Any) -> AnyArray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(array)  # type: ignore[no-untyped-call,no-any-return]


def _arrays(attributes: Any, rows: int | None) -> Columns:
    """The named arrays of points, cells or the file; they must have ``rows`` rows unless None."""
    arrays: Columns = {}
    for place in range(attributes.GetNumberOfArrays()):
        if (array := attributes.GetArray(place)) is None:
            continue  # texts
        name, values = array.GetName(), _numpy(array)
        if rows is not None and len(values) != rows:
            raise damaged(f"{name} has {len(values)} of {rows} rows")
        # the name is bytes if it is not valid UTF-8
        if name and isinstance(name, str):
            arrays[name] = values
    return arrays


def _cells(cells: Any, points: int) -> tuple[IntArray, IntArray]:
    """The offsets of the cells (one more than cells), and the points of all cells."""
    if not cells.IsValid():
        raise damaged("the offsets of the cells are wrong")
    offsets = _numpy(cells.GetOffsetsArray()).astype(np.int64)
    named = _numpy(cells.GetConnectivityArray()).astype(np.int64)
    if named.size and not 0 <= named.min() <= named.max() < points:
        raise damaged("a cell names a point that does not exist")
    return offsets, named


def _mesh_of(data: Any) -> Mesh:
    """The mesh of a data set of VTK."""
    count = data.GetNumberOfPoints() if data.IsA("vtkDataSet") else 0
    if data.IsA("vtkRectilinearGrid") and count:
        return Mesh(np.array(data.GetBounds()).reshape(3, 2).T, {}, NO_LINES, {}, False, {})
    if not data.IsA("vtkPointSet"):
        raise ValueError(f"a {data.GetClassName()} holds neither grains nor contacts")
    points = doubles(_numpy(data.GetPoints().GetData())) if count else np.zeros((0, 3))
    arrays = _arrays(data.GetPointData(), count)
    cell_arrays = _arrays(data.GetCellData(), data.GetNumberOfCells())
    if data.IsA("vtkPolyData"):
        # arrays of cells begin with the rows of the vertices
        cells, start = data.GetLines(), data.GetNumberOfVerts()
        types = np.full(data.GetNumberOfLines(), POLY_LINE)
        has_faces = data.GetNumberOfPolys() + data.GetNumberOfStrips() > 0
    else:
        cells, start, one_by_one = data.GetCells(), 0, data.GetCellTypesArray()
        # since VTK 9.6 this array does not exist if all cells have one type
        types = np.array(data.GetCellTypes()) if one_by_one is None else _numpy(one_by_one)
        has_faces = not np.all(np.isin(types, (VERTEX, POLY_VERTEX, LINE, POLY_LINE)))
    offsets, named = _cells(cells, count)
    if len(types) == count and not has_faces and np.array_equal(named, np.arange(count)):
        # one vertex for each point: YADE's VTKRecorder stores some point arrays with the vertices
        arrays.update(cell_arrays)
    rows = np.flatnonzero(np.isin(types, (LINE, POLY_LINE)))
    if len(types) != len(offsets) - 1 or np.any(np.diff(offsets)[rows] < 2):
        raise damaged("the types and the points of the cells do not match")
    lines = np.column_stack([named[offsets[rows]], named[offsets[rows + 1] - 1]])
    line_arrays = {name: values[start + rows] for name, values in cell_arrays.items()}
    is_own = (arrays.get("vtkGhostType", np.zeros(count, np.uint8)) & DUPLICATE) == 0
    if not is_own.all():
        if len(lines):
            raise ValueError("a file with ghost points (vtkGhostType) and lines cannot be read")
        points, arrays = points[is_own], {name: values[is_own] for name, values in arrays.items()}
    return Mesh(points, arrays, lines, line_arrays, has_faces, _arrays(data.GetFieldData(), None))
