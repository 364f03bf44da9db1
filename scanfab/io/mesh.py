"""
One mesh from any file of VTK: points, lines between them, and the arrays of both.

VTK's own readers do the work, in the worker process of `fence`, because a damaged header may crash
them. They raise no errors. What is wrong with a file stands in VTK's output window, which is a
string here, and any text in it is an error. `vtk_checks` looks for faults that do not even stand
there.
"""

from __future__ import annotations

import re
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.fence import fenced
from scanfab.io.files import check_memory, file_inside, first_bytes, plain
from scanfab.io.hdf import is_hdf, read_hdf_file
from scanfab.io.vtk_checks import check_text, check_xml, damaged, is_ascii

Arrays = dict[str, npt.NDArray[Any]]

# files that hold a mesh; and files that list the pieces of one frame
MESHES = {"polydata", "unstructuredgrid", "unstructured_grid", "rectilineargrid", "xdmf"}
MESHES |= {"rectilinear_grid", "multiblockdataset", "partitioneddatasetcollection"}
PIECES = ("PPolyData", "PUnstructuredGrid")
VERTEX, POLY_VERTEX, LINE, POLY_LINE = 1, 2, 3, 4
# bit of vtkGhostType: the point belongs to another piece
DUPLICATE = 1
# what VTK says of keys that describe arrays: its own files have such with a NaN, which it refuses
HARMLESS = re.compile("InformationKey|Could not locate key")


# an array of a file without points; in a FIELD its line is NAME COMPONENTS 0 TYPE
EMPTY_ARRAY = re.compile(r"^(?:SCALARS (\S+)|VECTORS (\S+)|(\S+) (\d+) 0 [a-z])", re.MULTILINE)


class Mesh(NamedTuple):
    """The content of a VTK file."""

    points: FloatArray
    """Shape (N, 3); of a box with coordinates along its axes, its two corners."""
    point_arrays: Arrays
    """N rows each."""
    lines: IntArray
    """The points at both ends of each line, shape (M, 2)."""
    line_arrays: Arrays
    """M rows each."""
    has_faces: bool
    """Whether there are triangles, boxes and the like."""
    field_arrays: Arrays
    """Of the file as a whole, with any number of rows."""


def form_of(path: Path) -> str | None:
    """``PolyData``, ``UNSTRUCTURED_GRID``, ``Xdmf``, ...: what the header says; None if no VTK."""
    head = first_bytes(path)
    if is_hdf(head):
        form = read_hdf_file(path, with_data=False).attributes.get("VTKHDF", {}).get("Type")
        return form if isinstance(form, str) else None
    if head.startswith(b"# vtk DataFile"):
        match = re.search(rb"^\s*DATASET\s+(\w+)", head, re.MULTILINE)
        return match[1].decode() if match else None
    match = re.search(rb"<VTKFile[^>]*\btype=[\"'](\w+)", head)
    if match:
        return match[1].decode()
    return "Xdmf" if re.search(rb"<Xdmf\b", head) else None


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
    return _joined(path, [_read_one(path), *map(_read_one, parts)])


def _read_one(path: Path) -> Mesh:
    form = form_of(path)
    if form is None:
        raise ReadError(f"{path}: expected a VTK file, found something else")
    if form in PIECES:
        pieces = listed(path, "Piece", "Source")
        if any(form_of(piece) in PIECES for piece in pieces):
            raise ReadError(f"{path}: one of its pieces lists pieces itself")
        return _joined(path, [_read_one(piece) for piece in pieces])
    if not holds_mesh(form):
        raise ReadError(f"{path}: a {form} holds neither grains nor contacts")
    _check_other_files(path, form)
    head = first_bytes(path)
    if head.startswith(b"# vtk") and re.search(rb"^POINTS\s+0\s", head, re.MULTILINE):
        # VTK loses all arrays of such a file, but their names matter
        found = EMPTY_ARRAY.findall(first_bytes(path, 1 << 16).decode("utf-8", "replace"))
        arrays = {
            scalar or vector or name: np.zeros((0, 3) if vector or count == "3" else 0)
            for scalar, vector, name, count in found
        }
        return Mesh(np.zeros((0, 3)), arrays, np.zeros((0, 2), np.int64), {}, False, {})
    mesh = fenced(mesh_in_worker, path)
    if is_ascii(head) and not plain(path).read_bytes()[-1:].isspace():
        warnings.warn(
            f"{path}: the last line has no end: its last number may be cut off",
            ScanfabWarning,
            stacklevel=2,
        )
    return mesh


def _check_other_files(path: Path, form: str) -> None:
    """ReadError if an XDMF file names a file outside of its folder."""
    if form != "Xdmf":
        return
    for item in elements(path).iter():
        if item.get("Format", "").upper() in ("HDF", "BINARY"):
            file_inside(path, (item.text or "").strip().partition(":")[0])
        if "include" in item.tag.lower():
            raise ReadError(f"{path}: XDMF that includes other files is not read")


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


def _joined(path: Path, parts: Sequence[Mesh]) -> Mesh:
    """Parts one behind the other, with the arrays that all parts which are not empty have."""
    filled = [one for one in parts if len(one.points)] or list(parts[:1])
    if not filled:
        raise ReadError(f"{path}: expected a piece, found none")
    if len(filled) == 1:
        return filled[0]
    starts = np.cumsum([0, *(len(one.points) for one in filled)])
    return Mesh(
        np.concatenate([one.points for one in filled]),
        _common([one.point_arrays for one in filled]),
        np.concatenate([one.lines + start for one, start in zip(filled, starts, strict=False)]),
        _common([one.line_arrays for one in filled]),
        any(one.has_faces for one in filled),
        filled[0].field_arrays,
    )


def _common(arrays: Sequence[Arrays]) -> Arrays:
    names = [name for name in arrays[0] if all(name in one for one in arrays)]
    return {
        name: np.concatenate([one[name] for one in arrays])
        for name in names
        if len({one[name].shape[1:] for one in arrays}) == 1
    }


def read_faces(path: Path) -> tuple[FloatArray, list[IntArray]]:
    """
    The points of a surface, (N, 3), and its faces, an array for each number of corners.

    Raises
    ------
    ReadError
        If it cannot be read, or is no PolyData.
    """
    if form_of(path) != "PolyData":
        raise ReadError(f"{path}: expected a surface (PolyData), found something else")
    return fenced(faces_in_worker, path)


# from here on, in the worker process: errors are ValueErrors, and the fence names the file


def mesh_in_worker(path: str) -> Mesh:
    """The mesh of one file; of several blocks all that have points."""
    data = _read_by_vtk(path)
    blocks = [data]
    if data.IsA("vtkCompositeDataSet"):
        iterator, blocks = data.NewIterator(), []
        while not iterator.IsDoneWithTraversal():
            blocks.append(iterator.GetCurrentDataObject())
            iterator.GoToNextItem()
    return _joined(Path(path), [_mesh_of(one) for one in blocks])


def faces_in_worker(path: str) -> tuple[FloatArray, list[IntArray]]:
    """The points and faces of PolyData; strips are cut into triangles."""
    data = _read_by_vtk(path)
    points = _mesh_of(data).points
    if data.GetNumberOfStrips():
        from vtkmodules.vtkFiltersCore import vtkTriangleFilter

        triangles = vtkTriangleFilter()
        triangles.SetInputData(data)
        triangles.Update()
        data = triangles.GetOutput()
    offsets, named = _cells(data.GetPolys(), len(points))
    corners = np.diff(offsets)
    return points, [
        named[offsets[:-1][corners == count][:, None] + np.arange(count)]
        for count in np.unique(corners[corners > 2])
    ]


def _read_by_vtk(path: str) -> Any:
    """What VTK reads of a file; ValueError if it has written anything into its output window."""
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    with open(path, "rb") as stream:
        head = stream.read(4096)
    names = check_text(Path(path).read_bytes()) if is_ascii(head) else set()
    reader = _reader_for(path, head)
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    told = [one for one in window.GetOutput().split("\n\n\n") if one and not HARMLESS.search(one)]
    if told or data is None:
        reason = re.sub(r"^.*(\n.*\((0x[0-9a-f]+|nullptr)\):)?", "", told[0] if told else "no data")
        raise damaged(" ".join(reason.split()))
    if names:
        parts = (data.GetPointData(), data.GetCellData(), data.GetFieldData())
        names -= {one for part in parts for one in _arrays(part, None)}
        if names:
            raise damaged(f"the array {min(names)} cannot be read")
    return data


def _reader_for(path: str, head: bytes) -> Any:
    """VTK's reader of a file that was looked at as far as VTK does not."""
    if is_hdf(head):
        from vtkmodules.vtkIOHDF import vtkHDFReader

        return vtkHDFReader()
    if b"<Xdmf" in head:
        from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

        return vtkXdmfReader()
    if head.startswith(b"# vtk"):
        from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader

        reader = vtkGenericDataObjectReader()
        for kind in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "TCoords"):
            getattr(reader, f"ReadAll{kind}On")()
        reader.ReadAllFieldsOn()
        return reader
    check_xml(Path(path).read_bytes())
    from vtkmodules.vtkIOXML import vtkXMLGenericDataObjectReader

    return vtkXMLGenericDataObjectReader()


def _numpy(array: Any) -> npt.NDArray[Any]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(array)  # type: ignore[no-untyped-call,no-any-return]


def _arrays(attributes: Any, rows: int | None) -> Arrays:
    """The arrays of points, cells or the file that have a name; None: any number of rows."""
    found: Arrays = {}
    for place in range(attributes.GetNumberOfArrays()):
        one = attributes.GetAbstractArray(place)
        name = one.GetName()
        # VTK gives bytes if they are no UTF-8
        name = name.decode("utf-8", "replace") if isinstance(name, bytes) else name
        if one.IsA("vtkStringArray"):
            values = np.array([one.GetValue(k) for k in range(one.GetNumberOfValues())], dtype=str)
        else:
            values = _numpy(one)
        if rows is not None and len(values) != rows:
            raise damaged(f"{name} has {len(values)} of {rows} rows")
        if name:
            found[name] = values
    return found


def _cells(cells: Any, points: int) -> tuple[IntArray, IntArray]:
    """Where the points of each cell begin and the last end, and the points of all cells."""
    offsets = _numpy(cells.GetOffsetsArray()).astype(np.int64)
    named = _numpy(cells.GetConnectivityArray()).astype(np.int64)
    if len(offsets) == 0:
        offsets = np.zeros(1, np.int64)
    if offsets[0] != 0 or np.any(np.diff(offsets) < 0) or offsets[-1] != len(named):
        raise damaged("the offsets of the cells are wrong")
    if named.size and not 0 <= named.min() <= named.max() < points:
        raise damaged("a cell names a point that does not exist")
    return offsets, named


def _mesh_of(data: Any) -> Mesh:
    """The mesh of one of VTK's data sets."""
    none: IntArray = np.zeros((0, 2), np.int64)
    if data.IsA("vtkRectilinearGrid"):
        if not data.GetNumberOfPoints():
            raise damaged("expected coordinates along three axes")
        corners = np.array(data.GetBounds()).reshape(3, 2).T
        return Mesh(corners, {}, none, {}, False, {})
    if not data.IsA("vtkPointSet"):
        raise ValueError(f"a {data.GetClassName()} holds neither grains nor contacts")
    count = data.GetNumberOfPoints()
    points = np.zeros((0, 3))
    if count:
        # a float may be a NaN that signals when it is cast
        with np.errstate(invalid="ignore"):
            points = doubles(_numpy(data.GetPoints().GetData()))
    arrays = _arrays(data.GetPointData(), count)
    cell_arrays = _arrays(data.GetCellData(), data.GetNumberOfCells())
    if data.IsA("vtkPolyData"):
        for others in (data.GetVerts(), data.GetPolys(), data.GetStrips()):
            _cells(others, count)
        offsets, named = _cells(data.GetLines(), count)
        chosen = np.arange(len(offsets) - 1)
        # the rows of cell arrays are those of vertices, lines and faces, in this order
        rows = data.GetNumberOfVerts() + chosen
        has_faces = data.GetNumberOfPolys() + data.GetNumberOfStrips() > 0
    else:
        offsets, named = _cells(data.GetCells(), count)
        chosen, has_faces = _lines_of_grid(data, offsets)
        rows = chosen
        if len(offsets) - 1 == count and not has_faces and np.array_equal(named, np.arange(count)):
            # one cell for each point, whose arrays are those of the points
            arrays.update(cell_arrays)
    first, last = offsets[:-1][chosen], offsets[1:][chosen] - 1
    if np.any(last < first):
        raise damaged("a line has no points")
    lines = np.column_stack([named[first], named[last]])
    line_arrays = {name: values[rows] for name, values in cell_arrays.items()}
    field_arrays = _arrays(data.GetFieldData(), None)
    return _own(Mesh(points, arrays, lines, line_arrays, has_faces, field_arrays))


def _lines_of_grid(data: Any, offsets: IntArray) -> tuple[IntArray, bool]:
    """Which cells of a grid are lines, and whether others than lines and points are among them."""
    array, sizes = data.GetCellTypesArray(), np.diff(offsets)
    # since VTK 9.6, cells that are all of one type have no such array
    types = np.array(data.GetCellTypes()) if array is None else _numpy(array)
    if len(types) != len(sizes):
        raise damaged(f"{len(types)} types for {len(sizes)} cells")
    is_line = (types == LINE) | ((types == POLY_LINE) & (sizes == 2))
    if np.any(sizes[is_line] != 2):
        raise damaged("types and points of the cells do not fit")
    is_point = (types == VERTEX) | (types == POLY_VERTEX)
    return np.flatnonzero(is_line), bool(np.any(~is_point & ~is_line))


def _own(mesh: Mesh) -> Mesh:
    """The mesh without the points that belong to other pieces (vtkGhostType)."""
    ghosts = mesh.point_arrays.get("vtkGhostType")
    if ghosts is None or ghosts.dtype.kind not in "iu" or ghosts.ndim != 1:
        return mesh
    own = (ghosts.astype(np.int64) & DUPLICATE) == 0
    if own.all():
        return mesh
    if len(mesh.lines):
        raise ValueError("points of other pieces (vtkGhostType) and lines between points")
    arrays = {name: values[own] for name, values in mesh.point_arrays.items()}
    return mesh._replace(points=mesh.points[own], point_arrays=arrays)
