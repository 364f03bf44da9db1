"""
The content of VTK files, by whichever library reads them.

meshio reads unstructured grids and XDMF, pyvista the rest; both print and exit where a library
should raise, which ends here.
"""

from __future__ import annotations

import contextlib
import io
import re
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.base.vtk_log import quiet_vtk
from scanfab.io.files import bare_name, check_memory, first_bytes, plain
from scanfab.io.parse.vtk_flaws import FlawError
from scanfab.io.parse.vtk_legacy import check_legacy
from scanfab.io.parse.vtk_xml import check_xml

__all__ = ["Mesh", "form_of", "read_bounds", "read_faces", "read_mesh"]


VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE = 1, 2, 3

# frames are read in threads, but both libraries print to streams of the process
_ONE_AT_A_TIME = threading.RLock()


class Mesh(NamedTuple):
    """What a VTK file holds, whichever library has read it."""

    points: FloatArray
    """Shape (N, 3)."""
    point_arrays: dict[str, npt.NDArray[Any]]
    """N rows each."""
    lines: IntArray
    """Points of each line, shape (M, 2)."""
    line_arrays: dict[str, npt.NDArray[Any]]
    """M rows each."""
    has_faces: bool
    """Triangles, boxes and the like."""


def form_of(path: Path) -> str | None:
    """``PolyData``, ``UNSTRUCTURED_GRID``, ``Xdmf``, ...: what the header says; None if no VTK."""
    head = first_bytes(path)
    if head.startswith(b"# vtk DataFile"):
        match = re.search(rb"^\s*DATASET\s+(\w+)", head, re.MULTILINE)
        return match[1].decode() if match else None
    match = re.search(rb"<VTKFile[^>]*\btype=[\"'](\w+)", head)
    if match:
        return match[1].decode()
    return "Xdmf" if re.search(rb"<Xdmf\b", head) else None


def read_mesh(path: Path) -> Mesh:
    """
    Read a VTK file.

    Raises
    ------
    ReadError
        If neither library can, with what they say.
    """
    with _ONE_AT_A_TIME:
        return _read_mesh(path)


def _read_mesh(path: Path) -> Mesh:
    form = form_of(path)
    if form is None:
        raise ReadError(f"{path}: expected a VTK file, found something else")
    file = plain(path)
    _refuse_flaws(path)
    reasons = []
    if form in ("UnstructuredGrid", "UNSTRUCTURED_GRID", "Xdmf"):
        try:
            return _checked(_from_meshio(file, form))
        except _MeshError as error:
            reasons.append(f"meshio: {error}")
    if form != "Xdmf":
        if _is_empty_legacy(file):
            return Mesh(np.zeros((0, 3)), {}, np.zeros((0, 2), np.int64), {}, False)
        try:
            return _checked(_from_pyvista(path, file))
        except _MeshError as error:
            reasons.append(f"VTK: {error}")
    raise ReadError(f"{path}: cannot be read as VTK ({form}): {'; '.join(reasons)}")


def _refuse_flaws(path: Path) -> None:
    """ReadError for what VTK would read beyond the end of, or take all memory for."""
    file = plain(path)
    # the libraries have it twice: as it is, and as arrays
    check_memory(path, 3.0 * file.stat().st_size)
    check = check_legacy if first_bytes(file).startswith(b"# vtk") else check_xml
    try:
        check_memory(path, 3.0 * check(file.read_bytes()))
    except FlawError as flaw:
        raise ReadError(f"{path}: the file is damaged or incomplete: {flaw}") from None


class _MeshError(Exception):
    pass


class _MeshioError(_MeshError):
    pass


class _VtkError(_MeshError):
    pass


def _is_empty_legacy(file: Path) -> bool:
    """VTK reports an error for no points, although that is a frame without grains."""
    return re.search(rb"^POINTS\s+0\s", first_bytes(file), re.MULTILINE) is not None


def _checked(mesh: Mesh) -> Mesh:
    """The mesh, if its arrays and lines fit to its points; arrays of one column lose it."""
    lines = mesh.lines
    if lines.size and not 0 <= lines.min() <= lines.max() < len(mesh.points):
        raise _MeshError("lines name points that do not exist")
    for arrays, rows in ((mesh.point_arrays, len(mesh.points)), (mesh.line_arrays, len(lines))):
        for name, values in arrays.items():
            if len(values) != rows:
                raise _MeshError(f"{name} has {len(values)} of {rows} rows")
            if values.shape == (rows, 1):
                arrays[name] = values[:, 0]
    return mesh


def _from_meshio(file: Path, form: str) -> Mesh:
    import meshio

    reader = {"UNSTRUCTURED_GRID": meshio.vtk, "UnstructuredGrid": meshio.vtu}.get(
        form, meshio.xdmf
    )
    silence = io.StringIO()
    try:
        with contextlib.redirect_stdout(silence), contextlib.redirect_stderr(silence):
            return _from_meshio_mesh(reader.read(str(file)))
    # meshio raises whatever its parsing meets, and exits for what it does not know
    except (Exception, SystemExit) as error:
        raise _MeshioError(_first_line(error)) from None


@np.errstate(invalid="ignore")  # ids that are no numbers name no points either
def _from_meshio_mesh(mesh: Any) -> Mesh:
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    arrays = {name: np.asarray(values) for name, values in mesh.point_data.items()}
    vertices = [place for place, block in enumerate(mesh.cells) if block.type == "vertex"]
    if len(vertices) == len(mesh.cells) == 1 and len(mesh.cells[0].data) == len(points):
        # one vertex cell for each point: arrays of the cells are arrays of the grains
        own = mesh.cells[0].data[:, 0]
        if np.array_equal(own, np.arange(len(points))):
            arrays.update({name: np.asarray(v[0]) for name, v in mesh.cell_data.items()})
    lines = [place for place, block in enumerate(mesh.cells) if block.type == "line"]
    pairs = [np.asarray(mesh.cells[place].data, np.int64) for place in lines]
    line_arrays = {
        name: np.concatenate([np.asarray(values[place]) for place in lines])
        for name, values in mesh.cell_data.items()
        if lines
    }
    return Mesh(
        points,
        arrays,
        np.concatenate(pairs) if pairs else np.zeros((0, 2), np.int64),
        line_arrays,
        has_faces=len(vertices) + len(lines) < len(mesh.cells),
    )


def _from_pyvista(path: Path, file: Path) -> Mesh:
    import pyvista

    suffix = Path(bare_name(path)).suffix.lower()
    if first_bytes(path).startswith(b"# vtk"):
        suffix = ".vtk"
    elif suffix not in (".vtp", ".vtu"):
        suffix = ".vtp" if form_of(path) == "PolyData" else ".vtu"
    with quiet_vtk(), pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
        try:
            reader = pyvista.get_reader(str(file), force_ext=suffix).reader
            reader.Update()
            output = reader.GetOutput()
            _refuse_misfits(output)
            mesh = _from_wrapped(pyvista.wrap(output))
        except _VtkError:
            raise
        except Exception as error:  # VTK's Python layer raises many kinds
            raise _VtkError(_first_line(error)) from None
    if caught.error_events:
        raise _VtkError(caught.error_events[0].alert)
    return mesh


@np.errstate(invalid="ignore")  # as in the other library's meshes
def _from_wrapped(mesh: Any) -> Mesh:
    import pyvista

    if isinstance(mesh, pyvista.PolyData):
        return _from_polydata(mesh)
    if isinstance(mesh, pyvista.UnstructuredGrid):
        return _from_grid(mesh)
    raise _VtkError(f"a {type(mesh).__name__} holds neither grains nor contacts")


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _refuse_misfits(output: Any) -> None:
    """
    _VtkError if arrays or cells do not fit to the points.

    VTK reads them nevertheless, and walks off their end when they are used.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    for name in ("Verts", "Lines", "Strips", "Polys", "Cells"):
        cells = getattr(output, f"Get{name}", lambda: None)()
        if cells is None:
            continue
        if not cells.IsValid():
            raise _VtkError(f"the offsets of {name} are wrong")
        ids = np.asarray(vtk_to_numpy(cells.GetConnectivityArray()))
        if ids.size and not 0 <= ids.min() <= ids.max() < output.GetNumberOfPoints():
            raise _VtkError(f"{name} name points that do not exist")
    for part, count in (
        (output.GetPointData(), output.GetNumberOfPoints()),
        (output.GetCellData(), output.GetNumberOfCells()),
    ):
        arrays = (part.GetAbstractArray(place) for place in range(part.GetNumberOfArrays()))
        if any(array.GetNumberOfTuples() != count for array in arrays):
            raise _VtkError("an array has more or less rows than there are points or cells")


def _from_polydata(mesh: Any) -> Mesh:
    # cell arrays come in the order vertices, lines, faces
    lines = _pairs(np.asarray(mesh.lines))
    first = mesh.n_verts
    cells = {name: np.asarray(mesh.cell_data[name]) for name in mesh.cell_data}
    return Mesh(
        np.asarray(mesh.points, dtype=np.float64),
        {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data},
        lines,
        {name: values[first : first + len(lines)] for name, values in cells.items()},
        has_faces=mesh.n_cells > mesh.n_verts + mesh.n_lines,
    )


def _from_grid(mesh: Any) -> Mesh:
    types = np.asarray(mesh.celltypes)
    chosen = np.flatnonzero(types == VTK_LINE)
    cells = {name: np.asarray(mesh.cell_data[name]) for name in mesh.cell_data}
    return Mesh(
        np.asarray(mesh.points, dtype=np.float64),
        {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data},
        _lines_among(chosen, mesh.GetCells()),
        {name: values[chosen] for name, values in cells.items()},
        has_faces=bool(np.any(~np.isin(types, (VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE)))),
    )


def _lines_among(chosen: IntArray, cells: Any) -> IntArray:
    """The two points of each chosen cell."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    # not by cells_dict, which trusts the types: a line of three points, or a box of two, crashes it
    offsets = vtk_to_numpy(cells.GetOffsetsArray())
    points = vtk_to_numpy(cells.GetConnectivityArray())
    if len(chosen) and (chosen[-1] >= len(offsets) - 1 or np.any(np.diff(offsets)[chosen] != 2)):
        raise _VtkError("types and points of the cells do not fit")
    begin = np.asarray(offsets)[chosen].astype(np.int64)
    return np.column_stack([points[begin], points[begin + 1]]).astype(np.int64)


def _pairs(flat: IntArray) -> IntArray:
    """VTK's flat list of lines (2, a, b, 2, c, d, ...) as pairs; longer lines by their ends."""
    if flat.size % 3 == 0 and np.all(flat[::3] == 2):
        return flat.reshape(-1, 3)[:, 1:].astype(np.int64)
    pairs, place = [], 0
    while place < flat.size:
        pairs.append((flat[place + 1], flat[place + flat[place]]))
        place += flat[place] + 1
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def read_bounds(path: Path) -> FloatArray | None:
    """
    Lower and upper bound of a grid along x, y and z, shape (3, 2); None if VTK complains.

    Raises
    ------
    ReadError
        If it cannot be read at all.
    """
    import pyvista

    _refuse_flaws(path)
    suffix = ".vtk" if first_bytes(path).startswith(b"# vtk") else ".vtr"
    with (
        _ONE_AT_A_TIME,
        quiet_vtk(),
        pyvista.VtkErrorCatcher(send_to_logging=False) as caught,
    ):
        try:
            reader = pyvista.get_reader(str(plain(path)), force_ext=suffix).reader
            reader.Update()
            bounds = np.array(reader.GetOutput().GetBounds()).reshape(3, 2)
        except Exception as error:  # as above
            raise ReadError(f"{path}: cannot be read: {_first_line(error)}") from None
    return None if caught.error_events else bounds


def read_faces(path: Path) -> tuple[FloatArray, list[IntArray]]:
    """
    The points of a surface, (N, 3), and its triangles.

    Raises
    ------
    ReadError
        If it cannot be read, or is no PolyData.
    """
    if form_of(path) != "PolyData":
        raise ReadError(f"{path}: expected a surface (PolyData), found something else")
    import pyvista

    _refuse_flaws(path)
    with (
        _ONE_AT_A_TIME,
        quiet_vtk(),
        pyvista.VtkErrorCatcher(send_to_logging=False) as caught,
    ):
        try:
            reader = pyvista.get_reader(str(plain(path)), force_ext=".vtp").reader
            reader.Update()
            output = reader.GetOutput()
            _refuse_misfits(output)
            # strips and polygons as triangles; vertices and lines left out
            mesh: Any = pyvista.wrap(output).triangulate(pass_verts=False, pass_lines=False)
            faces = np.asarray(mesh.faces, np.int64).reshape(-1, 4)[:, 1:]
            points = np.asarray(mesh.points, np.float64)
        except Exception as error:  # as above
            raise ReadError(f"{path}: cannot be read: {_first_line(error)}") from None
    if caught.error_events:
        raise ReadError(f"{path}: cannot be read: {caught.error_events[0].alert}")
    return points, [faces]
