"""
One mesh from any file of VTK: points, lines between them, and the arrays of both.

VTK's own readers do the work, in the worker process of `fence`, because a damaged header may crash
them. They raise no errors, but write into VTK's output window: any text there is an error. Two
faults are not told even there. VTK fills the arrays of a legacy file that was cut off with zeros:
so an array is appended to the file, and must be found behind all others. VTK drops the values of an
XML array that are more than its piece counts: so they are counted before VTK reads the file.
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
from scanfab.io.fence import fenced
from scanfab.io.files import check_memory, file_inside, first_bytes, plain
from scanfab.io.hdf import is_hdf, read_hdf_file

# files that hold a mesh; and files that list the pieces of one frame
MESHES = {"polydata", "unstructuredgrid", "unstructured_grid", "rectilineargrid", "xdmf"}
MESHES |= {"rectilinear_grid", "multiblockdataset", "partitioneddatasetcollection"}
PIECES = ("PPolyData", "PUnstructuredGrid")
# VTK's numbers for kinds of cells
VERTEX, POLY_VERTEX, LINE, POLY_LINE = 1, 2, 3, 4
# bit of vtkGhostType: the point belongs to another piece
DUPLICATE = 1
# VTK itself writes a NaN into keys that describe arrays, and cannot read it
HARMLESS = re.compile("InformationKey|Could not locate key")
FORM = re.compile(
    rb"\A# vtk DataFile.*?^\s*DATASET\s+(\w+)|<VTKFile[^>]*\btype=[\"'](\w+)|<(Xdmf)\b",
    re.MULTILINE | re.DOTALL,
)
TEXT = re.compile(rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*ASCII\s", re.IGNORECASE)
NO_POINTS = re.compile(rb"# vtk.*^POINTS\s+0\s", re.MULTILINE | re.DOTALL)
# the sections of XML whose arrays all have a row for each point, or for each cell
COUNTED = ("Points", "PointData", "CellData")
BASE64 = re.compile(r"[A-Za-z0-9+/=]*")
# what is appended to a legacy file: an array without values
END = "scanfab_end"
APPENDED = f"FIELD scanfab 1\n{END} 1 0 int\n".encode()


class Mesh(NamedTuple):
    """The content of a VTK file."""

    points: FloatArray
    """Shape (N, 3); of a box with coordinates along its axes, its two corners."""
    point_arrays: Columns
    """N rows each."""
    lines: IntArray
    """The points at both ends of each line, shape (M, 2)."""
    line_arrays: Columns
    """M rows each."""
    has_faces: bool
    """Whether there are triangles, boxes and the like."""
    field_arrays: Columns
    """Of the file as a whole, with any number of rows."""


NO_LINES: IntArray = np.zeros((0, 2), np.int64)


def form_of(path: Path) -> str | None:
    """``PolyData``, ``UNSTRUCTURED_GRID``, ``Xdmf``, ...: what the header says; None if no VTK."""
    head = first_bytes(path)
    if is_hdf(head):
        form = read_hdf_file(path, with_data=False).attributes.get("VTKHDF", {}).get("Type")
        return form if isinstance(form, str) else None
    match = FORM.search(head)
    return match[match.lastindex or 0].decode() if match else None


def holds_mesh(form: str | None) -> bool:
    """Whether a file of this form holds points and cells, or lists pieces that do."""
    return form is not None and (form.lower() in MESHES or form in PIECES)


def read_mesh(path: Path, parts: Sequence[Path] = ()) -> Mesh:
    """
    Read a VTK file, or the pieces that it lists.

    Parameters
    ----------
    path : Path
        The file.
    parts : sequence of Path, optional
        Files with more of the same mesh; their points come behind those of `path`.

    Raises
    ------
    ReadError
        If a file is damaged, incomplete, or no mesh.
    """
    return _joined(path, [_read_one(one) for one in (path, *parts)])


def _read_one(path: Path) -> Mesh:
    form, head = form_of(path), first_bytes(path)
    if form is None or not holds_mesh(form):
        found = form or "something else"
        raise ReadError(f"{path}: expected a VTK file with points, found {found}")
    if form in PIECES:
        pieces = listed(path, "Piece", "Source")
        if any(form_of(piece) in PIECES for piece in pieces):
            raise ReadError(f"{path}: one of its pieces lists pieces itself")
        return _joined(path, [_read_one(piece) for piece in pieces])
    if NO_POINTS.match(head):
        # VTK takes it for an error
        return Mesh(np.zeros((0, 3)), {}, NO_LINES, {}, False, {})
    if form == "Xdmf":
        _check_xdmf(path)
    mesh = fenced(mesh_in_worker, path)
    if TEXT.match(head) and not plain(path).read_bytes()[-1:].isspace():
        warn(f"{path}: the last line has no end: its last number may be cut off")
    return mesh


def _check_xdmf(path: Path) -> None:
    """ReadError if an XDMF file names a file outside of its folder."""
    for item in elements(path).iter():
        if "include" in item.tag.lower():
            raise ReadError(f"{path}: XDMF that includes other files is not read")
        if item.get("Format", "").upper() in ("HDF", "BINARY"):
            file_inside(path, (item.text or "").strip().partition(":")[0])


def elements(path: Path) -> ElementTree.Element:
    """The elements of an XML file that names other files."""
    check_memory(path, 4.0 * plain(path).stat().st_size)
    try:
        return ElementTree.fromstring(plain(path).read_bytes())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ReadError(f"{path}: cannot be read as a list of VTK files: {error}") from None


def listed(path: Path, tag: str, key: str) -> list[Path]:
    """
    The files that an XML file names, such as ``<Piece Source="...">``, in its order.

    Raises
    ------
    ReadError
        If one is not below the folder of the file, or not there.
    """
    names = [one.attrib[key] for one in elements(path).iter(tag) if key in one.attrib]
    return [file_inside(path, name) for name in names]


def joined_arrays(parts: Sequence[Columns]) -> Columns:
    """The arrays that all parts have, with as many components, one behind the other."""
    found: Columns = {}
    for name in parts[0]:
        own = [one[name] for one in parts if name in one]
        if len(own) == len(parts) and len({one.shape[1:] for one in own}) == 1:
            found[name] = np.concatenate(own)
    return found


def _joined(path: Path, parts: Sequence[Mesh]) -> Mesh:
    """Parts one behind the other; empty ones have lost their arrays, and count for nothing."""
    filled = [one for one in parts if len(one.points)] or list(parts[:1])
    if not filled:
        raise ReadError(f"{path}: expected a piece, found none")
    starts = np.cumsum([0, *(len(one.points) for one in filled)])
    return filled[0]._replace(
        points=np.concatenate([one.points for one in filled]),
        point_arrays=joined_arrays([one.point_arrays for one in filled]),
        lines=np.concatenate([one.lines + at for one, at in zip(filled, starts, strict=False)]),
        line_arrays=joined_arrays([one.line_arrays for one in filled]),
        has_faces=any(one.has_faces for one in filled),
    )


# from here on, in the worker process: errors are ValueErrors, and the fence names the file


def mesh_in_worker(path: str) -> Mesh:
    """The mesh of one file; of several blocks all that have points."""
    data = _read_by_vtk(path)
    if not data.IsA("vtkCompositeDataSet"):
        return _mesh_of(data)
    blocks, iterator = [], data.NewIterator()
    while not iterator.IsDoneWithTraversal():
        blocks.append(_mesh_of(iterator.GetCurrentDataObject()))
        iterator.GoToNextItem()
    return _joined(Path(path), blocks)


def faces_in_worker(path: str) -> tuple[FloatArray, list[IntArray]]:
    """The points of PolyData, and the triangles into which VTK cuts its polygons and strips."""
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    data, triangles = _read_by_vtk(path), vtkTriangleFilter()
    points = _mesh_of(data).points
    triangles.SetInputData(data)
    triangles.Update()
    _, named = _cells(triangles.GetOutput().GetPolys(), len(points))
    return points, [named.reshape(-1, 3)]


def damaged(reason: str) -> ValueError:
    """The error for a file that does not hold what its headers say."""
    return ValueError(f"the file is damaged or incomplete: {reason}")


def _read_by_vtk(path: str) -> Any:
    """What VTK reads of a file; ValueError if it has written anything into its output window."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    content = Path(path).read_bytes()
    reader = _reader(path, content)
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    told = [one for one in window.GetOutput().split("\n\n\n") if one and not HARMLESS.search(one)]
    if told or data is None:
        reason = re.sub(r"^.*(\n.*\((0x[0-9a-f]+|nullptr)\):)?", "", told[0] if told else "no data")
        raise damaged(" ".join(reason.split()))
    if content.startswith(b"# vtk"):
        places = (data.GetFieldData(), data.GetPointData(), data.GetCellData())
        last = next((one for one in places if one.HasArray(END)), None)
        # behind the number of rows stands at least the header of an array
        if last is None or (last is not places[0] and last.GetNumberOfArrays() == 1):
            raise damaged("it has fewer or more values than its headers say")
        last.RemoveArray(END)
    return data


def _reader(path: str, content: bytes) -> Any:
    """VTK's reader of a file; that of a legacy file reads the content with an array behind it."""
    reader: Any
    if content.startswith(b"# vtk"):
        from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader

        reader = vtkGenericDataObjectReader()
        for kind in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "Fields"):
            getattr(reader, f"ReadAll{kind}On")()
        # bytes that were cut off would swallow empty lines
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
        # behind the elements may stand bytes
        root = ElementTree.fromstring(content if end < 0 else content[:end] + b"</VTKFile>")
        for piece in root.iter("Piece"):
            counts = {name[8:]: int(word) for name, word in piece.items() if name[:8] == "NumberOf"}
            points, every = counts.get("Points", 0), sum(counts.values())
            rows = {**counts, "Points": points, "PointData": points, "CellData": every - points}
            for section, array in ((one.tag, array) for one in piece for array in one):
                name = array.get("Name", section)
                # of the arrays that describe cells, one has a row for each point of each cell
                is_counted = section in COUNTED or name in ("offsets", "types")
                if section not in rows or not is_counted or array.get("type") == "String":
                    continue
                expected = rows[section] * int(array.get("NumberOfComponents") or 1)
                stored = _stored(content, array, root, end)
                if section == "CellData" and stored > expected:
                    # VTK would give the values to other lines than theirs
                    told = f"{name} has {stored} values for {expected} contacts: VTKRecorder"
                    advice = 'use VTKExporter or `contacts="geometric"`'
                    raise ValueError(f"{told} loses those across a periodic cell: {advice}")
                if stored != expected:
                    raise ValueError(f"{name} has {stored} of {expected} values")
    except (ElementTree.ParseError, ValueError, LookupError, TypeError) as error:
        raise damaged(str(error)) from None


def _stored(content: bytes, array: ElementTree.Element, root: ElementTree.Element, end: int) -> int:
    """How many values an array has: its words, or as the sizes before its bytes say."""
    text = " ".join([array.text or "", *(child.tail or "" for child in array)]).strip()
    if array.get("format") == "ascii":
        return len(text.split())
    width = 8 if root.get("header_type") == "UInt64" else 4
    head = text[: 4 * width].encode()
    if array.get("format") == "appended":
        start = content.index(b"_", end) + 1 + int(array.attrib["offset"])
        head = content[start : start + 4 * width]
    elif not BASE64.fullmatch(text):
        # VTK passes over all letters that are no base64, and so shifts the values behind them
        raise ValueError("an array is not as base64 writes it")
    if array.get("format") != "appended" or b"raw" not in content[end : end + 100]:
        digits = head.split(b"=")[0]
        head = base64.b64decode(digits + b"=" * (-len(digits) % 4))
    kind = f"{'>' if root.get('byte_order') == 'BigEndian' else '<'}u{width}"
    size, full, last = np.frombuffer(head.ljust(3 * width, b"\0"), kind, 3).tolist()
    if root.get("compressor"):
        # all blocks are full, but perhaps the last one
        size = size * full - (full - last if size and last else 0)
    return int(size) // np.dtype(array.attrib["type"].lower()).itemsize


def _numpy(array: Any) -> AnyArray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(array)  # type: ignore[no-untyped-call,no-any-return]


def _arrays(attributes: Any, rows: int | None) -> Columns:
    """The arrays of points, cells or the file that have a name; None: any number of rows."""
    found: Columns = {}
    for place in range(attributes.GetNumberOfArrays()):
        one = attributes.GetAbstractArray(place)
        name = one.GetName()
        if one.IsA("vtkStringArray"):
            values = np.array([one.GetValue(k) for k in range(one.GetNumberOfValues())], dtype=str)
        else:
            values = _numpy(one)
        if rows is not None and len(values) != rows:
            raise damaged(f"{name} has {len(values)} of {rows} rows")
        # VTK gives bytes if they are no UTF-8
        if name and isinstance(name, str):
            found[name] = values
    return found


def _cells(cells: Any, points: int) -> tuple[IntArray, IntArray]:
    """Where the points of each cell begin and the last end, and the points of all cells."""
    if not cells.IsValid():
        raise damaged("the offsets of the cells are wrong")
    offsets = _numpy(cells.GetOffsetsArray()).astype(np.int64)
    named = _numpy(cells.GetConnectivityArray()).astype(np.int64)
    if named.size and not 0 <= named.min() <= named.max() < points:
        raise damaged("a cell names a point that does not exist")
    return offsets, named


def _mesh_of(data: Any) -> Mesh:
    """The mesh of one of VTK's data sets."""
    count = data.GetNumberOfPoints() if data.IsA("vtkDataSet") else 0
    if data.IsA("vtkRectilinearGrid") and count:
        return Mesh(np.array(data.GetBounds()).reshape(3, 2).T, {}, NO_LINES, {}, False, {})
    if not data.IsA("vtkPointSet"):
        raise ValueError(f"a {data.GetClassName()} holds neither grains nor contacts")
    points = doubles(_numpy(data.GetPoints().GetData())) if count else np.zeros((0, 3))
    arrays = _arrays(data.GetPointData(), count)
    cell_arrays = _arrays(data.GetCellData(), data.GetNumberOfCells())
    if data.IsA("vtkPolyData"):
        # the arrays of cells begin with the rows of vertices
        cells, start = data.GetLines(), data.GetNumberOfVerts()
        types = np.full(data.GetNumberOfLines(), POLY_LINE)
        has_faces = data.GetNumberOfPolys() + data.GetNumberOfStrips() > 0
    else:
        cells, start, one_by_one = data.GetCells(), 0, data.GetCellTypesArray()
        # since VTK 9.6, cells that are all of one type have no such array
        types = np.array(data.GetCellTypes()) if one_by_one is None else _numpy(one_by_one)
        has_faces = not np.all(np.isin(types, (VERTEX, POLY_VERTEX, LINE, POLY_LINE)))
    offsets, named = _cells(cells, count)
    if len(types) == count and not has_faces and np.array_equal(named, np.arange(count)):
        # one vertex for each point: YADE's VTKRecorder writes some arrays of the points there
        arrays.update(cell_arrays)
    rows = np.flatnonzero(np.isin(types, (LINE, POLY_LINE)))
    if len(types) != len(offsets) - 1 or np.any(np.diff(offsets)[rows] < 2):
        raise damaged("types and points of the cells do not fit")
    lines = np.column_stack([named[offsets[rows]], named[offsets[rows + 1] - 1]])
    line_arrays = {name: values[start + rows] for name, values in cell_arrays.items()}
    own = (arrays.get("vtkGhostType", np.zeros(count, np.uint8)) & DUPLICATE) == 0
    if not own.all():
        if len(lines):
            raise ValueError("points of other pieces (vtkGhostType) and lines between points")
        points, arrays = points[own], {name: values[own] for name, values in arrays.items()}
    return Mesh(points, arrays, lines, line_arrays, has_faces, _arrays(data.GetFieldData(), None))
