"""The RVs of a series: where settings put them in the first frame, and in deformed frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base import shapes
from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.io.surface import read_surface
from scanfab.packing.packing import spelt_plane
from scanfab.packing.sample import Sample
from scanfab.packing.window import RV_MEANING, SurfaceBox, Window
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import cell_of, centers_of, strain_mode
from scanfab.pipeline.values import Vector

# in radii of the smallest grain: a smaller RV is a mistake
SMALLEST = 1e-9


class RV(NamedTuple):
    """One of the RVs of a series."""

    fraction: float | None = None
    """Its size as a fraction of the sample's, where there are several to be told apart."""
    window: Window | None = None
    """Its place and shape; None in a series without grains."""


def sizes_of(settings: Settings) -> tuple[RV, ...]:
    """The RVs of a series, without their windows; none if no variant needs one."""
    if not settings.needs_window:
        return ()
    return tuple(RV(one if len(settings.rvs) > 1 else None) for one in settings.rvs)


def windows_of(sample: Sample, settings: Settings) -> list[Window]:
    """
    The RVs that settings put into the first frame that has grains, in ascending order.

    Raises
    ------
    SettingsError
        If one is far smaller than any grain or lies beside the plane of the discs, or if its
        surface is that of no convex body.
    ReadError
        If the file of its surface cannot be read.
    """
    packing, space = sample.packing, sample.packing.space
    surfaces = SurfaceBox.of(packing, sample.gathered)
    smallest = float(packing.radius[sample.grains].min())
    found = []
    for fraction in settings.rvs:
        shape, center = _shape(settings, fraction * (0.5 * surfaces.extents), space)
        if settings.rv_center is not None:
            center = np.array(settings.rv_center, dtype=float)
        elif center is None:
            center = surfaces.center.copy()
        if space.across is not None:
            # rounding may put the centre beside the plane
            if abs(center[space.across] - packing.place_across) > packing.radius.max():
                raise SettingsError(
                    f"rv_center: lies outside {space} of the discs: expected "
                    f"{spelt_plane(packing.position, space)}, found {center[space.across]:g}"
                )
            center[space.across] = packing.place_across
        if 0.5 * (shape.high - shape.low)[list(space.along)].min() < SMALLEST * smallest:
            raise SettingsError(
                f"rv: the {shape} is nothing beside the smallest grain (radius {smallest:g}): "
                f"choose a larger `rv`, `rv_radius` or `rv_size`"
            )
        found.append(Window(center, shape))
    return found


def _shape(settings: Settings, part: FloatArray, space: Space) -> tuple[Convex, FloatArray | None]:
    """The shape, in a plane a flat one, and its centre if a file says where it is."""
    kind, sizes = settings.rv_shape, settings.rv_size
    part = part[sorted(space.along)]
    if kind == "sphere":
        radius = settings.rv_radius or float(part.min())
        return shapes.sphere(radius, space), None
    if kind == "box":
        edges = sizes or 2.0 * part
        return shapes.box(edges, None, space), None
    if kind == "ellipsoid":
        axes = sizes or part
        return shapes.ellipsoid(axes, None, space), None
    if kind == "cylinder":
        axis = settings.rv_axis or settings.axis
        radius, height = sizes or _cylinder_within(part, axis)
        return shapes.cylinder(radius, height, axis), None
    try:
        return shapes.polyhedron(*read_surface(Path(kind)))
    except SettingsError as error:
        text = f"rv_shape: {kind}: {error}: expected a closed convex surface"
        raise SettingsError(text) from None


def _cylinder_within(half: FloatArray, axis: Vector) -> tuple[float, float]:
    """
    Radius and height of the cylinder that fills a box of these half edges.

    Its half height and its radius are the half lengths of lines through the middle of the box,
    along the axis and across it. If the axis is oblique, the cylinder shrinks until its rims fit.
    """
    along = np.abs(np.array(axis))
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    with np.errstate(divide="ignore"):
        length, radius = float((half / along).min()), float((half / across).min())
    fits = min(1.0, float((half / (length * along + radius * across)).min()))
    return fits * radius, 2.0 * fits * length


def doubts_of_rv(window: Window, sample: Sample, box: SurfaceBox, largest: float) -> list[Note]:
    """
    Check the place of an RV, and note if it comes near the sample's surface.

    Raises
    ------
    SettingsError
        If it holds no grain, reaches too far beyond the sample, or overlaps its own image.
    """
    packing, grains = sample.packing, sample.grains
    window.check_fits(packing)
    room = box.room_around(window)
    meets = window.may_meet(packing.position, packing.radius, packing)
    if not np.any(meets & grains):
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
        space = sample.packing.space
        scale = float(np.abs(edges[list(space.along)]).max())
        if abs(np.linalg.det(edges)) <= 1e-9 * scale**space.dimension:
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


def _edges(sample: Sample, mode: str) -> tuple[FloatArray, FloatArray]:
    """Origin and edges, as columns, of what an RV follows; across a plane nothing changes."""
    space = sample.packing.space
    if mode == "cell":
        cell = cell_of(sample)
        vectors = cell.vectors.copy()
        if space.across is not None:
            vectors[vectors[:, space.across] != 0.0] = space.normal
        return cell.origin, vectors.T
    position = centers_of(sample, mode)
    low, high = position.min(axis=0), position.max(axis=0)
    edges = np.diag(high - low)
    if space.across is not None:
        edges[space.across, space.across] = 1.0
    return low, edges
