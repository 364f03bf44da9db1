"""The RVs of a series: where settings put them in the first frame, and in deformed frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.shapes import (
    box,
    circle,
    cylinder,
    ellipse,
    ellipsoid,
    polyhedron,
    rectangle,
    sphere,
)
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.io.surface import read_surface
from scanfab.packing.plane import spelt_plane
from scanfab.packing.sample import Sample
from scanfab.packing.window import RV_MEANING, SurfaceBox, Window
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import strain_mode
from scanfab.pipeline.values import Vector

# of the smallest grain: what nobody means
SMALLEST = 1e-9


class RV(NamedTuple):
    """One of the RVs of a series."""

    fraction: float | None = None
    """Its size as a fraction of the sample's, where there are several to be told apart."""
    window: Window | None = None
    """None in a series without grains."""


def sizes_of(settings: Settings) -> tuple[RV, ...]:
    """The RVs of a series as far as the settings alone tell; none if no variant needs one."""
    if not settings.needs_window:
        return ()
    return tuple(RV(one if len(settings.rvs) > 1 else None) for one in settings.rvs)


def windows_of(sample: Sample, settings: Settings) -> list[Window]:
    """
    The RVs that settings put into the first frame that has grains, in ascending order.

    Raises
    ------
    SettingsError
        If it is far smaller than any grain, or its surface is that of no convex body.
    ReadError
        If the file of its surface cannot be read.
    """
    surfaces = SurfaceBox.of(sample.packing, sample.gathered)
    return [_window(sample, settings, one, surfaces) for one in settings.rvs]


def _window(sample: Sample, settings: Settings, fraction: float, surfaces: SurfaceBox) -> Window:
    space = sample.packing.space
    if space.is_plane:
        shape, center = _flat_shape(settings, 0.5 * surfaces.extents, fraction, space), None
    else:
        shape, center = _shape(settings, 0.5 * surfaces.extents, fraction)
    if settings.rv_center is not None:
        center = np.array(settings.rv_center, dtype=float)
    elif center is None:
        center = np.array(surfaces.center, dtype=float)
    if space.across is not None:
        center[space.across] = _in_plane(center[space.across], sample)
    smallest = float(sample.packing.radius[sample.grains].min())
    half = 0.5 * float((shape.high - shape.low)[list(space.along)].min())
    if half < SMALLEST * smallest:
        what = f"a radius of {half:g}" if shape.is_sphere else f"a {shape}"
        raise SettingsError(
            f"rv: {what} is nothing beside that of the smallest grain ({smallest:g}): choose a "
            f"larger `rv`, `rv_radius` or `rv_size`"
        )
    return Window(center, shape)


def _in_plane(place: float, sample: Sample) -> float:
    """The coordinate of the discs' plane, for an RV that lies beside it by rounding."""
    packing = sample.packing
    if abs(place - packing.place_across) > packing.radius.max():
        raise SettingsError(
            f"rv_center: lies outside {packing.space} of the discs: expected "
            f"{spelt_plane(packing.position, packing.space)}, found {place:g}"
        )
    return packing.place_across


def _flat_shape(settings: Settings, half: FloatArray, fraction: float, plane: Space) -> Convex:
    """The shape in a plane; the sphere is its circle."""
    part = fraction * half[sorted(plane.along)]
    if settings.rv_shape == "sphere":
        radius = settings.rv_radius
        return circle(float(part.min()) if radius is None else radius, plane)
    if settings.rv_shape == "box":
        return rectangle(settings.rv_size or 2.0 * part, plane)
    return ellipse(settings.rv_size or part, plane)


def _shape(
    settings: Settings, half: FloatArray, fraction: float
) -> tuple[Convex, FloatArray | None]:
    """
    The shape, and its centre if a file says where it is.

    ``half`` are the sample's half extents, of which the sizes are the fraction where none are
    given.
    """
    sizes, part = settings.rv_size, fraction * half
    if settings.rv_shape == "sphere":
        radius = settings.rv_radius
        return sphere(float(part.min()) if radius is None else radius), None
    if settings.rv_shape == "box":
        return box(sizes or 2.0 * part), None
    if settings.rv_shape == "ellipsoid":
        return ellipsoid(sizes or part), None
    if settings.rv_shape == "cylinder":
        axis = settings.rv_axis or settings.axis
        radius, height = sizes or _cylinder_within(part, axis)
        return cylinder(radius, height, axis), None
    path = Path(settings.rv_shape)
    try:
        return polyhedron(*read_surface(path))
    except SettingsError as error:
        raise SettingsError(
            f"rv_shape: {path}: {error}: expected a closed convex surface"
        ) from None


def _cylinder_within(half: FloatArray, axis: Vector) -> tuple[float, float]:
    """
    Radius and height of the cylinder that fills a box of these half edges.

    Half as high, and as wide, as lines through the box's middle along the axis and across it are
    long; if the axis is oblique, smaller by what its rims would stick out.
    """
    along = np.abs(np.array(axis))
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    with np.errstate(divide="ignore"):
        length, radius = float((half / along).min()), float((half / across).min())
    fits = min(1.0, float((half / (length * along + radius * across)).min()))
    return fits * radius, 2.0 * fits * length


def doubts_of_rv(window: Window, sample: Sample, box: SurfaceBox, largest: float) -> list[Note]:
    """
    What to tell of an RV at the sample's surface.

    Raises
    ------
    SettingsError
        If it holds no grain, reaches too far beyond the sample, or overlaps its own image.
    """
    packing, grains = sample.packing, sample.grains
    window.check_fits(packing)
    room = box.room_around(window)
    if not window.may_meet(packing.position[grains], packing.radius[grains], packing).any():
        raise SettingsError(
            f"the {window} holds no grain: choose another `rv_center` or a larger one "
            f"(`rv_radius`, `rv_size`)"
        )
    if room < -2 * largest:
        raise SettingsError(
            f"the {window} reaches {-room:g} beyond the sample, that is more than two of its "
            f"largest radii ({largest:g}): choose another `rv_center` or a smaller `rv`, "
            f"{RV_MEANING}" + ("" if window.shape.is_sphere else ", or a smaller `rv_size`")
        )
    if room >= largest:
        return []
    text = (
        f"the {window} comes within one of the largest radii ({largest:g}) of the sample's "
        f"surface: it cuts the outermost layer of grains, which a boundary arranges: choose a "
        f"smaller `rv`, or use more grains"
    )
    return [Note("rv_at_surface", text)]


@dataclass(frozen=True, eq=False)
class Deformation:
    """
    How the sample is deformed since its first frame that has grains, as far as an RV follows it.

    The place x of that frame lies at o + F (x - o₀) in another, F = H H₀⁻¹. With the cell, H has
    its vectors as columns and o is its origin; with boundary or grains, H has the extents of their
    centres along x, y, z on its diagonal, and o is the lower corner.
    """

    mode: str
    """``cell``, ``boundary`` or ``grains``."""
    origin: FloatArray
    """o₀, shape (3,)."""
    edges: FloatArray
    """H₀, shape (3, 3)."""

    @classmethod
    def since(cls, sample: Sample, mode: str, axis: Vector) -> Deformation:
        """
        From a frame on, by what the strain is measured by.

        Raises
        ------
        SettingsError
            If there is nothing to measure, or it is flat.
        """
        mode = strain_mode(sample, mode, axis)
        if not mode:
            raise SettingsError(
                "rv_follows: there is neither a periodic cell nor a boundary that tells how the "
                'sample deforms: choose `strain="grains"`, or leave out `rv_follows`'
            )
        origin, edges = _edges(sample, mode)
        own = _own_edges(edges, sample.packing.space)
        if abs(np.linalg.det(own / max(float(np.abs(own).max()), 1e-300))) < 1e-9:
            raise SettingsError(f"rv_follows: the {mode} it is to follow has no volume")
        return cls(mode, origin, edges)

    def windows_in(self, sample: Sample, windows: Sequence[Window]) -> list[Window]:
        """Windows of the first frame as they lie in another."""
        origin, edges = _edges(sample, self.mode)
        if np.array_equal(origin, self.origin) and np.array_equal(edges, self.edges):
            return list(windows)
        gradient = edges @ np.linalg.inv(self.edges)
        return [
            Window(origin + gradient @ (one.center - self.origin), one.shape.deformed(gradient))
            for one in windows
        ]


def _own_edges(edges: FloatArray, space: Space) -> FloatArray:
    """Those that lie in the space: of a plane two, there."""
    if space.across is None:
        return edges
    return edges[list(space.along)][:, edges[space.across] == 0.0]


def _edges(sample: Sample, mode: str) -> tuple[FloatArray, FloatArray]:
    """Origin and edges, as columns, of what is followed."""
    if mode == "cell":
        cell = sample.packing.cell
        if cell is None:
            raise SettingsError("rv_follows: the RV is to follow the cell, but the dump has none")
        vectors = cell.vectors.copy()
        if sample.packing.space.across is not None:
            # nothing changes across the plane
            vectors[vectors[:, sample.packing.space.across] != 0.0] = sample.packing.space.normal
        return cell.origin, vectors.T
    chosen = sample.boundary if mode == "boundary" else sample.gathered
    if not chosen.any():
        raise SettingsError(f"rv_follows: the RV is to follow the {mode}, but the frame has none")
    position = sample.packing.position[chosen]
    low, high = position.min(axis=0), position.max(axis=0)
    edges = np.diag(high - low)
    if sample.packing.space.across is not None:
        edges[(sample.packing.space.across,) * 2] = 1.0
    return low, edges
