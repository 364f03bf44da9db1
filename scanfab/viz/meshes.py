"""Meshes of a frame and of its results, for ParaView and for the 3D view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista
from scipy.spatial import ConvexHull

from scanfab.base.convex import Convex
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import Segments
from scanfab.viz.scene import Grains, inside

SOLID, DROPPED, KEPT = 0, 1, 2
# Cells of a shell around the axis, and from pole to pole.
AZIMUTHS, POLAR = 36, 18


def grain_mesh(grains: Grains) -> Any:
    """A point for each particle, with its radius, id and other data."""
    mesh = pyvista.PolyData(grains.position) if len(grains.position) else pyvista.PolyData()
    names = ["radius", "id", "contacts", "rattler", "boundary", "in_window"]
    names += ["body"] * (grains.body is not None)
    return _with(mesh, mesh.point_data, **{name: getattr(grains, name) for name in names})


def contact_mesh(sample: Sample, window: Window | None) -> Any:
    """
    A line from centre to centre for each contact, through periodic faces too.

    ``boundary`` marks contacts of a boundary particle, ``in_window`` contact points in the RV.
    """
    packing, contacts = sample.packing, sample.contacts
    first, second = packing.position[contacts.pairs].transpose(1, 0, 2)
    if packing.cell is not None:
        second = second + contacts.image @ packing.cell.vectors
    mesh = _lines(np.stack([first, second], axis=1))
    return _with(
        mesh,
        mesh.cell_data,
        normal=contacts.normal,
        boundary=~sample.contacts_without(sample.boundary),
        in_window=inside(contacts.point, sample, window),
        force=() if contacts.force is None else contacts.force,
    )


def line_mesh(segments: Segments, cutoff: float) -> Any:
    """
    Scan lines in pieces: ``state`` is 0 in solids, 1 in dropped and 2 in kept void segments.
    """
    mesh = _lines(segments.ends)
    void, kept = segments.void, segments.void & (segments.length >= cutoff)
    return _with(
        mesh,
        mesh.cell_data,
        length=segments.length,
        void=void,
        kept=kept,
        state=np.where(void, np.where(kept, KEPT, DROPPED), SOLID),
        line=segments.line,
    )


def window_mesh(center: FloatArray, window: Convex, nsub: int = 4) -> Any:
    """The surface of the RV, or its outline for discs; ``nsub`` refines that of a sphere."""
    if window.is_sphere and not window.is_flat:
        return pyvista.Icosphere(radius=window.reach, center=tuple(center), nsub=nsub)
    return _surface(center + window.outline, window.outline, window.is_flat)


def distribution_mesh(
    directions: FloatArray, mean_length: FloatArray, weight: FloatArray, space: Space = SPACE
) -> Any:
    """
    ℓ(n) as a closed surface about the origin, at ℓ in each direction n; a closed line for discs.

    Parameters
    ----------
    directions : ndarray, shape (P, 3)
        Unit vectors all over the sphere.
    mean_length : ndarray, shape (P,)
        ℓ(n), dump's length unit.
    weight : ndarray, shape (P,)
        Quadrature weights of the directions, sum 1.
    space : Space, optional
        The plane of the directions, if they lie in one; there they go around in order.
    """
    mesh = _surface(mean_length[:, None] * directions, directions, space.is_plane)
    return _with(
        mesh,
        mesh.point_data,
        mean_length=mean_length,
        weight=weight,
        direction=directions,
        deviation=mean_length / float(weight @ mean_length) - 1.0,
    )


def ellipsoid_mesh(
    tensors: Mapping[str, FloatArray], center: FloatArray, size: float, space: Space = SPACE
) -> Any:
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


def tensor_points(tensors: Mapping[str, FloatArray], center: FloatArray) -> Any:
    """One point in the middle of the sample, 9-component arrays: for the Tensor Glyph filter."""
    mesh = pyvista.PolyData(center[None])
    return _with(mesh, mesh.point_data, **{k: one.reshape(1, 9) for k, one in tensors.items()})


def block_mesh(blocks: Blocks, values: Mapping[str, npt.ArrayLike]) -> Any:
    """The blocks of a map as hexahedra; a shell has many, each with the values of the shell."""
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
    return _with(mesh, mesh.cell_data, **{k: np.asarray(one)[block] for k, one in values.items()})


def _with(mesh: Any, data: Any, **arrays: npt.ArrayLike) -> Any:
    """Add arrays to the point or cell data of a mesh, but for empty ones, which pyvista refuses."""
    for name, values in arrays.items():
        if np.size(values):
            data[name] = np.ascontiguousarray(values)
    return mesh


def _lines(ends: FloatArray) -> Any:
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
