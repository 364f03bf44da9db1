"""
VTK files: grains as points with a radius, contacts as lines between centres.

meshio reads unstructured grids and XDMF, pyvista the rest; both print and exit where a library
should raise, which ends here.
"""

from __future__ import annotations

import contextlib
import io
import re
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.cell import Cell
from scanfab.errors import ReadError
from scanfab.packing import ContactList
from scanfab.readers.base import FileKind, GrainTable, JoinedContacts, ReadOptions, Snapshot
from scanfab.readers.columns import MOST, grain_table, has_radius, whole_numbers
from scanfab.readers.files import bare_name, first_bytes, plain
from scanfab.readers.join import join_ids, join_positions
from scanfab.readers.legacy import flaw_of
from scanfab.readers.markup import flaw_of_xml

__all__ = ["Mesh", "VtkReader", "read_mesh"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE = 1, 2, 3
# other kinds of VTK files are grids and indexes of files
HOLDING_POINTS = ("PolyData", "POLYDATA", "UnstructuredGrid", "UNSTRUCTURED_GRID", "Xdmf")


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


class VtkReader:
    """Reader plugin for VTK files of any origin."""

    name = "vtk"
    description = "any VTK point cloud with a radius; contacts as lines (also .pvd series)"
    extensions: tuple[str, ...] = (".vtk", ".vtp", ".vtu", ".pvd", ".xdmf", ".xmf")
    generic = True
    # whether one end of a contact may be a wall, which is not in the grain file
    walls = True

    def recognises(self, path: Path) -> bool:
        """By the first line of legacy VTK, or the root element of the XML formats."""
        return _form(path) is not None

    def kind(self, path: Path) -> FileKind:
        """Lines are contacts, points without any other cells are grains."""
        form = _form(path)
        if form == "Collection":
            return "index"
        if form not in HOLDING_POINTS:
            return "other"
        mesh = read_mesh(path)
        if mesh.has_faces:
            return "other"
        if len(mesh.points) == 0:
            # an empty frame; VTK may have dropped its arrays
            return "grains" if b"radi" in plain(path).read_bytes().lower() else "other"
        if has_radius(list(mesh.point_arrays)):
            return "grains"
        return "contacts" if len(mesh.lines) else "points"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, and only its name may say which step it is; those that a ``.pvd`` lists."""
        return self._listed(path) if _form(path) == "Collection" else [Snapshot(path)]

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Points and their arrays, with the box of LIGGGHTS' file beside it."""
        mesh = read_mesh(snapshot.path)
        columns = {**mesh.point_arrays, "position": mesh.points}
        if len(mesh.points) == 0:
            columns["radius"] = np.zeros(0)
        grains = grain_table(snapshot.path, columns, _box_beside(snapshot.path), options)
        if len(mesh.lines) == 0:
            return grains
        # lines between the grains' own points
        return grains._replace(contacts=ContactList(mesh.lines, force=self.force_on_second(mesh)))

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Lines; by the arrays id1 and id2 where grains have ids, else by their ends."""
        mesh = read_mesh(snapshot.path)
        force = self.force_on_second(mesh)
        ids = [mesh.line_arrays.get(name) for name in ("id1", "id2")]
        named = [whole_numbers(snapshot.path, values) for values in ids if values is not None]
        if grains.id is not None and len(named) == 2:
            pairs = np.column_stack(named)
            return join_ids(snapshot.path, grains, pairs, force, walls=self.walls)
        return join_positions(snapshot.path, grains, mesh.points[mesh.lines], force)

    def _listed(self, index: Path) -> list[Snapshot]:
        """The grain files of a ``.pvd``, in its order."""
        try:
            root = ElementTree.parse(plain(index)).getroot()
            entries = [
                (index.parent / entry.attrib["file"], float(entry.attrib["timestep"]))
                for entry in root.iter("DataSet")
            ]
        except (ElementTree.ParseError, KeyError, ValueError) as error:
            raise ReadError(f"{index}: cannot be read as a list of VTK files: {error}") from None
        kinds: dict[str, FileKind] = {}
        found = []
        for path, time in entries:
            # parts of one name hold the same; some are boxes and contacts
            family = re.sub(r"\d+", "*", path.name)
            kinds.setdefault(family, "other")
            if kinds[family] == "other":
                kinds[family] = self.kind(path)
            if kinds[family] in ("grains", "points"):
                found.append(Snapshot(path, step=_last_number(path), time=time))
        return found

    def force_on_second(self, mesh: Mesh) -> FloatArray | None:
        """Force on the second grain, shape (M, 3); None: which one it acts on is not known."""
        return None


def _last_number(path: Path) -> int | None:
    numbers = re.findall(r"\d+", Path(bare_name(path)).stem)
    return int(numbers[-1]) if numbers else None


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
    form = _form(path)
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
    flaw = flaw_of(file) if first_bytes(file).startswith(b"# vtk") else flaw_of_xml(file)
    if flaw is not None:
        raise ReadError(f"{path}: the file is damaged or incomplete: {flaw}")


class _MeshError(Exception):
    pass


class _MeshioError(_MeshError):
    pass


class _VtkError(_MeshError):
    pass


def _form(path: Path) -> str | None:
    """``PolyData``, ``UNSTRUCTURED_GRID``, ``Xdmf``, ...: what the header says; None if no VTK."""
    head = first_bytes(path)
    if head.startswith(b"# vtk DataFile"):
        match = re.search(rb"^\s*DATASET\s+(\w+)", head, re.MULTILINE)
        return match[1].decode() if match else None
    match = re.search(rb"<VTKFile[^>]*\btype=[\"'](\w+)", head)
    if match:
        return match[1].decode()
    return "Xdmf" if re.search(rb"<Xdmf\b", head) else None


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
        suffix = ".vtp" if _form(path) == "PolyData" else ".vtu"
    with _quiet_vtk(), pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
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


@contextlib.contextmanager
def _quiet_vtk() -> Iterator[None]:
    """VTK's own log off: its errors are raised instead."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)


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
    lines = np.asarray(mesh.cells_dict.get(VTK_LINE, np.zeros((0, 2))), dtype=np.int64)
    cells = {name: np.asarray(mesh.cell_data[name]) for name in mesh.cell_data}
    return Mesh(
        np.asarray(mesh.points, dtype=np.float64),
        {name: np.asarray(mesh.point_data[name]) for name in mesh.point_data},
        lines,
        {name: values[chosen] for name, values in cells.items()},
        has_faces=bool(np.any(~np.isin(types, (VTK_VERTEX, VTK_POLY_VERTEX, VTK_LINE)))),
    )


def _pairs(flat: IntArray) -> IntArray:
    """VTK's flat list of lines (2, a, b, 2, c, d, ...) as pairs; longer lines by their ends."""
    if flat.size % 3 == 0 and np.all(flat[::3] == 2):
        return flat.reshape(-1, 3)[:, 1:].astype(np.int64)
    pairs, place = [], 0
    while place < flat.size:
        pairs.append((flat[place + 1], flat[place + flat[place]]))
        place += flat[place] + 1
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _box_beside(path: Path) -> Cell | None:
    """The box that LIGGGHTS writes beside a VTK dump; it does not say what is periodic."""
    match = re.fullmatch(r"(.*?)(\d+)\.\w+", bare_name(path))
    if match is None:
        return None
    for suffix in (".vtk", ".vtr", ".vtk.gz", ".vtr.gz"):
        beside = path.with_name(f"{match[1]}boundingBox_{match[2]}{suffix}")
        if beside.is_file():
            return _read_box(beside)
    return None


def _read_box(path: Path) -> Cell | None:
    import pyvista

    _refuse_flaws(path)
    suffix = ".vtk" if first_bytes(path).startswith(b"# vtk") else ".vtr"
    with (
        _ONE_AT_A_TIME,
        _quiet_vtk(),
        pyvista.VtkErrorCatcher(send_to_logging=False) as caught,
    ):
        try:
            reader = pyvista.get_reader(str(plain(path)), force_ext=suffix).reader
            reader.Update()
            bounds = np.array(reader.GetOutput().GetBounds()).reshape(3, 2)
        except Exception as error:  # as above
            raise ReadError(f"{path}: cannot be read: {_first_line(error)}") from None
    edges = bounds[:, 1] - bounds[:, 0]
    if caught.error_events or not np.all((edges > 0) & (np.abs(bounds).max(axis=1) < MOST)):
        return None
    return Cell(edges, (False, False, False), bounds[:, 0])
