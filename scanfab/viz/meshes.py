"""Meshes of a frame and of its results, for ParaView and for the 3D view."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista
from scipy.spatial import ConvexHull
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

from scanfab.base.convex import Convex
from scanfab.base.files import whole_file
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points, mean_length_function
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import Window
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.measurement import Measurement
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads, sample_segments
from scanfab.table.row import Row, number_of
from scanfab.table.table import Table
from scanfab.viz.scene import Grains, grains_of, inside

SOLID, DROPPED, KEPT = 0, 1, 2
# Cells of a shell around the axis, and from pole to pole.
AZIMUTHS, POLAR = 36, 18
# Scan lines of each variant.
LINES = 120

Fields = Mapping[str, Any]
Meshes = Iterator[tuple[str, Any, Fields]]
"""The kind of a mesh, the mesh, and its field data."""


def frame_meshes(result: FrameResult) -> Meshes:
    """The grains, contacts and RVs of a frame, and what each variant's scan says."""
    # the name of a file tells its RV only if there are several RVs
    rvs = [rv for measured in result.measurements for rv in measured.plan.rvs[:1]]
    windows = {_name("window", rv.fraction): rv.window for rv in rvs if rv.window is not None}
    # the largest RV holds the others
    window = [None, *windows.values()][-1]
    fields = _fields(result.rows)
    yield "grains", grain_mesh(grains_of(result.sample, window)), fields
    yield "contacts", contact_mesh(result.sample, window), fields
    for name, one in windows.items():
        yield name, window_mesh(one.center, one.shape), fields
    if result.measurements:
        # ellipsoids of all variants have one size
        extents = np.ptp(result.sample.packing.position, axis=0)
        reach = window.radius if window else 0.5 * float(extents.max())
        for row in result.rows:
            yield from _variant_meshes(result, row, 0.3 * reach)


def _variant_meshes(result: FrameResult, row: Row, size: float) -> Meshes:
    rv, fields = number_of(row, "rv"), _fields([row])
    measured, name = result.measured(row.variant, rv), _name(row.variant, rv)
    center, space = measured.solids.origin, measured.plan.space
    yield f"lines-{name}", line_mesh(measured, row.variant), fields
    mean_length = mean_length_function(measured.sums.axes, *measured.kept(row.variant), space)
    if mean_length is not None and row.alpha_vs is not None:
        yield f"distribution-{name}", distribution_mesh(mean_length, space), fields
    every = {kind: Table([row]).tensor(kind)[0] for kind in ("gvs", "gc")}
    tensors = {kind: matrix for kind, matrix in every.items() if np.isfinite(matrix).all()}
    if tensors:
        yield f"ellipsoids-{name}", ellipsoid_mesh(tensors, center, size, space), fields
        # one point, whose arrays of nine components are for the filter Tensor Glyph
        point = pyvista.PolyData(center[None])
        point.point_data.update({k: one.reshape(1, 9) for k, one in tensors.items()})
        yield f"tensors-{name}", point, fields


def map_meshes(result: FrameResult) -> Meshes:
    """The blocks of each variant of a map as cells with all columns."""
    if result.blocks is None:
        return
    for variant in dict.fromkeys(row.variant for row in result.rows):
        values = _fields([row for row in result.rows if row.variant == variant])
        # texts are the same in all blocks, so they are fields of the mesh
        texts = [name for name, own in values.items() if isinstance(own, list)]
        fields = {name: values.pop(name)[:1] for name in texts}
        yield f"map-{variant}", block_mesh(result.blocks[variant in "cd"], values), fields


def grain_mesh(grains: Grains) -> Any:
    """A point for each particle, with its radius, id and other data."""
    mesh = pyvista.PolyData(grains.position) if len(grains.position) else pyvista.PolyData()
    kept = {k: v for k, v in vars(grains).items() if k not in ("position", "to_place")}
    return _with(mesh, mesh.point_data, **kept)


def contact_mesh(sample: Sample, window: Window | None) -> Any:
    """
    A line from centre to centre for each contact, through periodic faces too.

    ``boundary`` marks contacts of a boundary particle, ``in_window`` contact points in the RV.
    """
    packing, contacts = sample.packing, sample.contacts
    first, second = packing.position[contacts.pairs].transpose(1, 0, 2)
    if packing.cell is not None:
        second = second + contacts.image @ packing.cell.vectors
    mesh = lines_mesh(np.stack([first, second], axis=1))
    return _with(
        mesh,
        mesh.cell_data,
        normal=contacts.normal,
        boundary=~sample.contacts_without(sample.boundary),
        in_window=inside(contacts.point, sample, window),
        force=contacts.force,
    )


def line_mesh(measured: Measurement, variant: str) -> Any:
    """
    A few scan lines along the loading axis and across it, in pieces.

    ``state`` is 0 in solids, 1 in dropped and 2 in kept void segments.
    """
    position, radius, window = measured.spheres_of(VARIANTS[variant])
    space = measured.plan.space
    triad = line_triads(np.array([measured.plan.settings.axis]), space)[0]
    # along the axis, and along the first direction across it
    across = line_triads(triad[:1], space)[0] if space.is_plane else np.roll(triad, -1, axis=0)
    found = sample_segments(position, radius, np.stack([triad, across]), LINES, window, space)
    found = replace(found, ends=found.ends + measured.solids.origin)
    mesh = lines_mesh(found.ends)
    kept = found.void & (found.length >= measured.plan.cutoff)
    return _with(
        mesh,
        mesh.cell_data,
        length=found.length,
        void=found.void,
        kept=kept,
        state=np.where(found.void, np.where(kept, KEPT, DROPPED), SOLID),
        line=found.line,
    )


def window_mesh(center: FloatArray, window: Convex, nsub: int = 4) -> Any:
    """The surface of the RV, or its outline for discs; ``nsub`` refines that of a sphere."""
    if window.is_sphere and not window.is_flat:
        return pyvista.Icosphere(radius=window.reach, center=tuple(center), nsub=nsub)
    return _surface(center + window.outline, window.outline, window.is_flat)


def distribution_mesh(mean_length: Any, space: Space) -> Any:
    """
    ℓ(n) as a closed surface about the origin, at ℓ in each direction n; a closed line for discs.

    ``mean_length`` gives ℓ, dump's length unit, for unit vectors of shape (P, 3). ``weight`` are
    the quadrature weights of the directions, sum 1.
    """
    directions, weight = direction_points(space)
    length = mean_length(directions)
    mesh = _surface(length[:, None] * directions, directions, space.is_plane)
    return _with(
        mesh,
        mesh.point_data,
        mean_length=length,
        weight=weight,
        direction=directions,
        deviation=length / float(weight @ length) - 1.0,
    )


def ellipsoid_mesh(tensors: Fields, center: FloatArray, size: float, space: Space) -> Any:
    """
    Fabric tensors as ellipsoids side by side along x; isotropy gives spheres of radius ``size``.

    The half axes are 3 size times the principal values, for discs 2 size times. ``kind`` numbers
    the tensors.
    """
    parts = []
    for kind, matrix in enumerate(tensors.values()):
        ball = pyvista.Icosphere(radius=1.0, nsub=3)
        along = np.eye(3)[min(space.along)]
        place = center + 2.5 * size * (kind - 0.5 * (len(tensors) - 1)) * along
        ball.points = np.asarray(ball.points) @ (space.dimension * size * matrix) + place
        ball.point_data["kind"] = np.full(ball.n_points, kind)
        parts.append(ball)
    return pyvista.merge(parts, merge_points=False)


def block_mesh(blocks: Blocks, values: Mapping[str, npt.ArrayLike]) -> Any:
    """The blocks of a map as hexahedra; a shell has many, each with the values of the shell."""
    if not blocks.radius:
        steps = [np.linspace(0.0, 1.0, count + 1) for count in blocks.parts]
        at = blocks.corner + np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1) @ blocks.edges
        block = np.arange(len(blocks))
    else:
        # upwards, so that the corners of a hexahedron are in VTK's order
        turns = np.linspace(0.0, 2.0 * np.pi, AZIMUTHS + 1), np.linspace(np.pi, 0.0, POLAR + 1)
        azimuth, polar, radius = np.meshgrid(*turns, blocks.bounds, indexing="ij")
        unit = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
        at = blocks.middles[0] + radius[..., None] * np.stack(unit, axis=-1)
        block = np.repeat(np.arange(blocks.shells), AZIMUTHS * POLAR)
    mesh = pyvista.StructuredGrid(*np.moveaxis(at, -1, 0)).cast_to_unstructured_grid()
    return _with(mesh, mesh.cell_data, **{k: np.asarray(one)[block] for k, one in values.items()})


def _with(mesh: Any, data: Any, **arrays: npt.ArrayLike | None) -> Any:
    """Add arrays to the point or cell data of a mesh, but for empty ones, which pyvista refuses."""
    for name, values in arrays.items():
        if values is not None and np.size(values):
            data[name] = np.ascontiguousarray(values)
    return mesh


def lines_mesh(ends: FloatArray) -> Any:
    """A line for each pair of ends, shape (K, 2, 3)."""
    if len(ends) == 0:
        return pyvista.PolyData()
    return pyvista.line_segments_from_points(ends.reshape(-1, 3))


def _surface(points: FloatArray, directions: FloatArray, is_flat: bool) -> Any:
    """
    The closed surface through points that lie in these directions from a point inside.

    Its triangles are those of the hull of the directions, counter-clockwise seen from outside. In a
    plane it is a closed line, from each point to the next.
    """
    if is_flat:
        return pyvista.PolyData(points, lines=[len(points) + 1, *range(len(points)), 0])
    corners = ConvexHull(directions).simplices.astype(np.int64)
    a, b, c = directions[corners].transpose(1, 0, 2)
    inward = np.einsum("ti,ti->t", np.cross(b - a, c - a), a) < 0
    corners[inward] = corners[inward, ::-1]
    return pyvista.PolyData.from_regular_faces(points, corners)


def _name(kind: str, rv: float | None) -> str:
    return kind if rv is None else f"{kind}-rv{rv:g}"


def _fields(rows: list[Row]) -> dict[str, Any]:
    """The values of rows by column: numbers, NaN if a row has none, or texts; no tensors."""
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [getattr(row, name) for row in rows]
        if any(isinstance(value, str) for value in values):
            # VTK's texts are ASCII
            columns[name] = [str(v).encode("ascii", "backslashreplace").decode() for v in values]
        elif not any(isinstance(value, list) for value in values):
            columns[name] = np.array([np.nan if v is None else v for v in values], np.float64)
    return columns


def save_mesh(mesh: Any, stem: Path, fields: Fields) -> Path:
    """
    Write a mesh with field data, and give back the path: ``stem`` with a suffix for its kind.

    The file is complete or untouched. A field with the name of an array of the mesh is called
    ``row_NAME``: viewers ask by name.
    """
    taken = {*mesh.point_data, *mesh.cell_data}
    for name, values in fields.items():
        mesh.field_data[f"row_{name}" if name in taken else name] = values
    is_grid = isinstance(mesh, pyvista.UnstructuredGrid)
    writer = vtkXMLUnstructuredGridWriter() if is_grid else vtkXMLPolyDataWriter()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    # into memory first, as VTK crashes when it writes to a full disk
    writer.WriteToOutputStringOn()
    writer.Write()
    path = stem.with_name(f"{stem.name}.{'vtu' if is_grid else 'vtp'}")
    with whole_file(path) as part:
        part.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")
    return path
