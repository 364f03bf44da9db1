"""RVs of a series: their place in the reference frame, and in the other frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base import shapes
from scanfab.base.convex import Convex
from scanfab.base.errors import Note, ScanfabNote, SettingsError
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.io.surface import read_surface
from scanfab.packing.packing import spelt_plane, spelt_some
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import RV_MEANING, SurfaceBox, Window
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import cell_of, centers_of, strain_mode
from scanfab.pipeline.values import Vector

# in radii of the smallest grain: a smaller RV is refused as a mistake
SMALLEST = 1e-9


class RV(NamedTuple):
    """One of the RVs of a series."""

    fraction: float | None = None
    """Size as a fraction of the sample; None unless there are several RVs."""
    window: Window | None = None
    """Place and shape; None for the whole sample."""
    lack: str = ""
    """Why there is no void fabric in it; empty if there is one."""


def rvs_of(settings: Settings, sample: Sample) -> tuple[RV, ...]:
    """
    The RVs in ascending order in the reference frame; empty if no variant needs an RV.

    Raises
    ------
    SettingsError
        If an RV is far smaller than any grain, lies beside the plane of the discs, or has a surface
        that is not convex.
    ReadError
        If the file of the surface cannot be read.
    """
    sizes = settings.rvs if settings.needs_window else ()
    packing, space = sample.packing, sample.packing.space
    surfaces = SurfaceBox.of(packing, sample.gathered)
    smallest = float(packing.radius[sample.grains].min())
    rvs = []
    for size in sizes:
        shape, center = _shape(settings, size * (0.5 * surfaces.extents), space)
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
                f"rv: the {shape} is far too small for grains of radius {smallest:g}"
            )
        rvs.append(RV(size if len(sizes) > 1 else None, Window(center, shape)))
    return tuple(rvs)


def _shape(settings: Settings, part: FloatArray, space: Space) -> tuple[Convex, FloatArray | None]:
    """The shape (flat in a plane), and its centre if a file gives it, else None."""
    kind, sizes, part = settings.rv_shape, settings.rv_size, part[sorted(space.along)]
    if kind == "sphere":
        return shapes.sphere(settings.rv_radius or float(part.min()), space), None
    if kind == "box":
        return shapes.box(sizes or 2.0 * part, None, space), None
    if kind == "ellipsoid":
        return shapes.ellipsoid(sizes or part, None, space), None
    if kind == "cylinder":
        axis = settings.rv_axis or settings.axis
        radius, height = sizes or _cylinder_within(part, axis)
        return shapes.cylinder(radius, height, axis), None
    try:
        return shapes.polyhedron(*read_surface(Path(kind)))
    except SettingsError as error:
        text = f"{error}: expected a closed convex surface"
        raise SettingsError(f"rv_shape: {kind}: {text}") from None


def _cylinder_within(half: FloatArray, axis: Vector) -> tuple[float, float]:
    """
    Radius and height of the cylinder that fills a box with the given half edges.

    Radius and half height are the distances from the middle of the box to its surface, across the
    axis and along it. If the axis is oblique, the cylinder shrinks until its rims fit.
    """
    along = np.abs(np.array(axis))
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    with np.errstate(divide="ignore"):
        length, radius = float((half / along).min()), float((half / across).min())
    fits = min(1.0, float((half / (length * along + radius * across)).min()))
    return fits * radius, 2.0 * fits * length


def in_sample(rv: RV, sample: Sample) -> RV:
    """The RV, with the reason why it has no void fabric in a sample, if it has none."""
    packing, window = sample.packing, rv.window
    assert window is not None
    largest = float(packing.radius[sample.grains].max())
    beyond = -SurfaceBox.of(packing, sample.gathered).room_around(window)
    lack = ""
    if not sample.counted(VARIANTS["c"], window).any():
        lack = f"the {window} holds no centre of a grain"
    elif beyond > 2 * largest:
        lack = (
            f"the {window} reaches {beyond:g} beyond the sample, which is more than twice the "
            f"largest radius ({largest:g})"
        )
        escaped = packing.id[sample.grains & ~sample.gathered]
        if escaped.size:
            lack += f"; its extents leave out {spelt_some(escaped)} that flew away"
    return rv._replace(lack=lack)


def empty_rvs(rvs: Iterable[RV]) -> Iterator[Note]:
    """A note for each RV that has no void fabric in a frame: why, and what to do."""
    for rv in rvs:
        if rv.lack:
            size = "" if rv.fraction is None else f"_{rv.fraction:g}"
            yield Note(
                f"empty_rv{size}",
                f"{rv.lack}, so c and d have no void fabric: choose another `rv_center` or `rv`, "
                f"{RV_MEANING}, another frame for its place (such as `reference=-1`), or let it "
                f'move with the sample (`rv_follows="strain"`, `strain="grains"`)',
                kind=ScanfabNote,
            )


def doubts_of_rv(window: Window, sample: Sample) -> list[Note]:
    """A note if an RV lies near the surface of the sample."""
    largest = float(sample.packing.radius[sample.grains].max())
    room = SurfaceBox.of(sample.packing, sample.gathered).room_around(window)
    text = (
        f"the {window} comes closer to the sample's surface than the largest radius ({largest:g}), "
        f"so it cuts the outermost grains, which the boundary arranges: choose a smaller `rv`"
    )
    return [Note("rv_at_surface", text)] if -2 * largest <= room < largest else []


@dataclass(frozen=True, eq=False)
class Deformation:
    """
    The affine deformation that an RV follows, relative to the reference frame.

    A point x of that frame lies at o + F (x - o₀) in another frame, with F = H H₀⁻¹. If the RV
    follows the cell, H has the cell's vectors as columns and o is its origin. If it follows
    boundary or grains, the diagonal of H holds the extents of their centres along x, y, z, and o is
    the lower corner.
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
        Start the deformation at a frame; ``mode`` says what the strain is measured by.

        Raises
        ------
        SettingsError
            If there is nothing to measure the deformation by, or if it has no volume.
        """
        mode = strain_mode(sample, mode, axis)
        if not mode:
            text = "there is neither a periodic cell nor a boundary to follow"
            raise SettingsError(f'rv_follows: {text}: choose `strain="grains"`')
        origin, edges = _edges(sample, mode)
        space = sample.packing.space
        scale = float(np.abs(edges[list(space.along)]).max())
        if abs(np.linalg.det(edges)) <= 1e-9 * scale**space.dimension:
            raise SettingsError(f"rv_follows: the {mode} to follow has no volume")
        return cls(mode, origin, edges)

    def rvs_in(self, sample: Sample, rvs: Iterable[RV]) -> tuple[RV, ...]:
        """The RVs of the first frame as they lie in another frame."""
        origin, edges = _edges(sample, self.mode)
        if np.array_equal(origin, self.origin) and np.array_equal(edges, self.edges):
            return tuple(rvs)
        gradient = edges @ np.linalg.inv(self.edges)
        found = []
        for size, window, _ in rvs:
            assert window is not None
            center = origin + gradient @ (window.center - self.origin)
            found.append(RV(size, Window(center, window.shape.deformed(gradient))))
        return tuple(found)


def _edges(sample: Sample, mode: str) -> tuple[FloatArray, FloatArray]:
    """Origin and edges (columns) of the cell or extents; constant along a plane's normal."""
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
