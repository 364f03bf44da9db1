"""ParaView files: one a frame and kind, and one collection (.pvd) a kind that knows the times."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.scan.blocks import Blocks
from scanfab.scan.segments import Segments
from scanfab.viz.scene import ContactLines, Grains

SOLID, DROPPED, KEPT = 0, 1, 2
# cells of a shell, around the axis and from pole to pole
AZIMUTHS, POLAR = 36, 18


def grain_mesh(grains: Grains) -> Any:
    """Points with what is known of each particle."""
    import pyvista

    mesh = pyvista.PolyData(grains.position) if len(grains.position) else pyvista.PolyData()
    _add(
        mesh.point_data,
        {
            "radius": grains.radius,
            "id": grains.id,
            "contacts": grains.contacts,
            "rattler": grains.rattler.astype(np.uint8),
            "boundary": grains.boundary.astype(np.uint8),
            "in_window": grains.in_window.astype(np.uint8),
        },
    )
    if grains.body is not None:
        _add(mesh.point_data, {"body": grains.body})
    return mesh


def contact_mesh(contacts: ContactLines) -> Any:
    """A line from centre to centre for each contact."""
    mesh = _lines(contacts.ends)
    data: dict[str, npt.ArrayLike] = {
        "normal": contacts.normal,
        "boundary": contacts.boundary.astype(np.uint8),
        "in_window": contacts.in_window.astype(np.uint8),
    }
    if contacts.force is not None:
        data["force"] = contacts.force
    _add(mesh.cell_data, data)
    return mesh


def line_mesh(segments: Segments, cutoff: float) -> Any:
    """
    Scan lines in pieces: ``state`` is 0 in solids, 1 in dropped and 2 in kept void segments.
    """
    mesh = _lines(segments.ends)
    length = segments.length
    kept = segments.void & (length >= cutoff)
    _add(
        mesh.cell_data,
        {
            "length": length,
            "void": segments.void.astype(np.uint8),
            "kept": kept.astype(np.uint8),
            "state": np.where(segments.void, np.where(kept, KEPT, DROPPED), SOLID),
            "line": segments.line,
        },
    )
    return mesh


def window_mesh(center: FloatArray, window: Convex, nsub: int = 4) -> Any:
    """The surface of the RV, of discs its outline; ``nsub`` says how fine that of a sphere is."""
    import pyvista

    if window.is_flat:
        return _closed_line(center + window.outline)
    if window.is_sphere:
        return pyvista.Icosphere(radius=window.reach, center=tuple(center), nsub=nsub)
    outline = window.outline
    return pyvista.PolyData.from_regular_faces(center + outline, _triangles(outline))


def distribution_mesh(
    directions: FloatArray,
    mean_length: FloatArray,
    weight: FloatArray,
    space: Space = SPACE,
) -> Any:
    """
    ℓ(n) as a closed surface about the origin, at ℓ in each direction n; of discs as a closed line.

    Parameters
    ----------
    directions : ndarray, shape (P, 3)
        Unit vectors all over the sphere.
    mean_length : ndarray, shape (P,)
        ℓ(n), dump's length unit.
    weight : ndarray, shape (P,)
        Quadrature weights of the directions, sum 1.
    space : Space, optional
        The plane in which the directions lie, one after the other, if they do.
    """
    import pyvista

    places = mean_length[:, None] * directions
    mesh = (
        _closed_line(places)
        if space.is_plane
        else pyvista.PolyData.from_regular_faces(places, _triangles(directions))
    )
    mean = float(weight @ mean_length)
    _add(
        mesh.point_data,
        {
            "mean_length": mean_length,
            "weight": weight,
            "direction": directions,
            "deviation": mean_length / mean - 1.0,
        },
    )
    return mesh


def ellipsoid_mesh(
    tensors: Mapping[str, FloatArray], center: FloatArray, size: float, space: Space = SPACE
) -> Any:
    """
    Fabric tensors as ellipsoids side by side along x; isotropy gives spheres of radius ``size``.

    The half axes are 3 size times the principal values, of discs 2 size times those of an ellipse;
    ``kind`` numbers the tensors.
    """
    import pyvista

    parts = []
    for kind, matrix in enumerate(tensors.values()):
        ball = pyvista.Icosphere(radius=1.0, nsub=3)
        along = np.eye(3)[min(space.along)]
        place = center + 2.5 * size * (kind - 0.5 * (len(tensors) - 1)) * along
        ball.points = np.asarray(ball.points) @ (space.dimension * size * matrix) + place
        ball.point_data["kind"] = np.full(ball.n_points, kind)
        parts.append(ball)
    mesh = pyvista.merge(parts, merge_points=False) if parts else pyvista.PolyData()
    return mesh if isinstance(mesh, pyvista.PolyData) else mesh.extract_surface()


def tensor_points(tensors: Mapping[str, FloatArray], center: FloatArray) -> Any:
    """One point in the middle of the sample, 9-component arrays: for the Tensor Glyph filter."""
    import pyvista

    mesh = pyvista.PolyData(center[None])
    _add(mesh.point_data, {name: matrix.reshape(1, 9) for name, matrix in tensors.items()})
    return mesh


def block_mesh(blocks: Blocks, values: Mapping[str, npt.ArrayLike]) -> Any:
    """The blocks of a map as hexahedra; a shell is many, each with the shell's values."""
    import pyvista

    if not blocks.radius:
        steps = [np.linspace(0.0, 1.0, count + 1) for count in blocks.parts]
        at = blocks.corner + np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1) @ blocks.edges
        block = np.arange(len(blocks))
    else:
        azimuth, polar, radius = np.meshgrid(
            np.linspace(0.0, 2.0 * np.pi, AZIMUTHS + 1),
            np.linspace(0.0, np.pi, POLAR + 1),
            blocks.bounds,
            indexing="ij",
        )
        unit = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
        at = blocks.middles[0] + radius[..., None] * np.stack(unit, axis=-1)
        block = np.repeat(np.arange(blocks.shells), AZIMUTHS * POLAR)
    mesh = pyvista.StructuredGrid(*np.moveaxis(at, -1, 0)).cast_to_unstructured_grid()
    _add(mesh.cell_data, {name: np.asarray(one)[block] for name, one in values.items()})
    return mesh


def save_mesh(mesh: Any, path: Path, fields: Mapping[str, Any]) -> None:
    """
    Write a mesh with field data; the file is complete or untouched.

    A field with the name of an array of the mesh is called ``row_NAME``: viewers ask by name.
    """
    taken = {*mesh.point_data, *mesh.cell_data}
    for name, values in fields.items():
        mesh.field_data[f"row_{name}" if name in taken else name] = values
    text = _xml(mesh)
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def _xml(mesh: Any) -> str:
    """The file's content: VTK writes it to memory, as its writer crashes on a full disk."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    kinds = {"PolyData": vtkXMLPolyDataWriter, "UnstructuredGrid": vtkXMLUnstructuredGridWriter}
    writer = kinds[type(mesh).__name__]()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    text: str = writer.GetOutputString()
    return text


class Folder:
    """
    A folder of such files of one series.

    Parameters
    ----------
    folder : Path
        Is made if it does not exist.
    go_on : bool, optional
        Keep the frames of an earlier run in the collections.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to.
    """

    def __init__(self, folder: Path, go_on: bool = False) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SettingsError(f"vtk: {folder} cannot be made: {error.strerror}") from None
        check_folder(folder / "grains.pvd")
        self.folder = folder
        self.go_on = go_on
        self._collections: dict[str, Collection] = {}
        # frames come from several threads, and VTK is not made for that
        self.lock = Lock()

    def save(
        self, kind: str, mesh: Any, number: int, time: float, fields: Mapping[str, Any]
    ) -> None:
        """The file of a kind and frame, and its place in the collection of the kind."""
        suffix = {"PolyData": "vtp", "UnstructuredGrid": "vtu"}[type(mesh).__name__]
        file = f"{kind}_{number:06d}.{suffix}"
        save_mesh(mesh, self.folder / file, fields)
        if kind not in self._collections:
            path = self.folder / f"{kind}.pvd"
            self._collections[kind] = Collection(path, self.go_on)
        self._collections[kind].add(file, time)


class Collection:
    """A ``.pvd``: the files of one kind with their times; whole after each frame."""

    ENTRY = re.compile(r'<DataSet timestep="([^"]*)" file="([^"]*)"/>')

    def __init__(self, path: Path, go_on: bool = False) -> None:
        """``go_on``: keep the entries of an earlier run."""
        self.path = path
        self.entries: dict[str, float] = {}
        if go_on and path.exists():
            for time, file in self.ENTRY.findall(path.read_text("utf-8")):
                self.entries[file] = float(time)

    def add(self, file: str, time: float) -> None:
        """One more file, in the folder of the collection."""
        self.entries[file] = time
        lines = [
            f'    <DataSet timestep="{time!r}" file="{file}"/>'
            for file, time in sorted(self.entries.items(), key=lambda entry: (entry[1], entry[0]))
        ]
        text = (
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            + "\n".join(lines)
            + "\n  </Collection>\n</VTKFile>\n"
        )
        with whole_file(self.path) as part:
            part.write_text(text, encoding="utf-8")


def _lines(ends: FloatArray) -> Any:
    """A line for each pair of ends, shape (K, 2, 3)."""
    import pyvista

    if len(ends) == 0:
        return pyvista.PolyData()
    return pyvista.line_segments_from_points(ends.reshape(-1, 3))


def _closed_line(points: FloatArray) -> Any:
    """From each point to the next, and from the last to the first."""
    import pyvista

    count = len(points)
    return pyvista.PolyData(points, lines=[count + 1, *range(count), 0])


def _add(data: Any, arrays: Mapping[str, npt.ArrayLike]) -> None:
    for name, values in arrays.items():
        if np.size(values):  # pyvista takes no empty arrays
            data[name] = np.ascontiguousarray(values)


def _triangles(directions: FloatArray) -> Any:
    """Triangles between points on a sphere, all seen counter-clockwise from outside."""
    from scipy.spatial import ConvexHull

    corners = ConvexHull(directions).simplices.astype(np.int64)
    a, b, c = directions[corners].transpose(1, 0, 2)
    inward = np.einsum("ti,ti->t", np.cross(b - a, c - a), a) < 0
    corners[inward] = corners[inward, ::-1]
    return corners
