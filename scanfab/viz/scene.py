"""What viewers show of a frame, as plain arrays: its grains, its RV, scan lines in a section."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import tell
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.io.series import Series
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.frames import Frames, doubts_of_frame, sample_of
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Vector
from scanfab.scan.lines import Segments, cut_lines
from scanfab.table.curves import frame_strain_column, spelt_strain

# Angle between the lines of a section and the plane across the axis, degrees.
LINE_ANGLE = 30.0
# The colour of a clump is multiplied by one of these, so that neighbours can be told apart.
SHADES = (1.0, 0.8, 0.62)
# Kinds of grains, which have a colour each.
IN_WINDOW, OUTSIDE, RATTLER = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Grains:
    """All particles of a frame, N rows (of clumps, each sphere); lengths in the dump's unit."""

    position: FloatArray
    radius: FloatArray
    id: IntArray
    contacts: IntArray
    """Number of contacts of each particle, including contacts with boundary and walls."""
    rattler: BoolArray
    boundary: BoolArray
    in_window: BoolArray
    """Whether the grain's centre lies in the RV; false if there is no RV."""
    to_place: FloatArray | None = None
    """Vectors from each sphere to the place of its body, shape (N, 3); None without bodies."""
    body: IntArray | None = None
    """Number of each sphere's body, negative for a grain of its own; None without bodies."""

    @property
    def places(self) -> FloatArray:
        """For each sphere the place of its grain, shape (N, 3)."""
        return self.position if self.to_place is None else self.position + self.to_place

    @property
    def kind(self) -> IntArray:
        """Whether each grain is a rattler, or lies in the RV or outside, shape (N,)."""
        return np.where(self.rattler, RATTLER, np.where(self.in_window, IN_WINDOW, OUTSIDE))

    @property
    def shade(self) -> IntArray:
        """Number of each sphere's shade, shape (N,); all spheres of a body have the same."""
        body = np.zeros(len(self.radius), np.int64) if self.body is None else self.body
        return np.asarray(np.maximum(body, 0) % len(SHADES))


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame to be looked at."""

    grains: Grains
    center: FloatArray
    """Centre of the RVs, shape (3,)."""
    windows: tuple[Convex, ...]
    """The RVs about their centre, in ascending order."""
    lines: Segments | None = None
    """A few scan lines, in the dump's coordinates."""
    cutoff: float = 0.0
    """Shorter void segments are dropped, dump's unit."""
    space: Space = SPACE
    """The plane of the grains if they are discs."""

    @property
    def window(self) -> Convex:
        """The largest RV."""
        return self.windows[-1]

    @property
    def is_section(self) -> bool:
        """Whether the picture shows a section through the centre."""
        return self.lines is not None or self.space.is_plane


@dataclass(frozen=True, eq=False)
class Look:
    """One frame with its scene, sample and plan, for views and reports."""

    scene: Scene
    number: int
    """Number of the frame, counted from 0."""
    sample: Sample
    strain: str
    """Its strain since the reference frame, in words; empty if it is not known."""
    first: Sample
    """The reference frame, which fixes all lengths of the series."""
    plan: Plan
    axis: Vector
    """Loading axis, a unit vector."""


def look_at(series: Series, settings: Settings, number: int = 0) -> Look:
    """
    One frame to be looked at; nothing is scanned.

    Parameters
    ----------
    series : Series
        The frames.
    settings : Settings
        Boundary, rattlers, RV, cut-off, axis and strain count. The RV is shown whatever the
        variants.
    number : int, optional
        Which frame; negative from the end.

    Raises
    ------
    ScanfabError
        If there is no such frame, it cannot be read, no frame has grains, or the settings do not
        fit the series.
    """
    settings = replace(settings, variants="c")
    # damaged frames are skipped; only a damaged frame that is asked for is an error
    frames = Frames(series, replace(settings, on_error="skip"))
    frame = series[number]
    sample = sample_of(frame, settings)
    tell(doubts_of_frame(frame, sample, settings))
    _, _, first = frames.reference()
    plan = make_plan(settings, first)
    tell(plan.notes)
    strains = plan.strains.at(frame.number, sample)
    strain = spelt_strain(strains, frame_strain_column(strains))
    if sample.grains.any():
        plan = plan.in_frame(sample)
    scene = scene_of(sample, *plan.windows, cutoff=plan.cutoff)
    return Look(scene, frame.number, sample, strain, first, plan, plan.settings.axis)


def scene_of(sample: Sample, *windows: Window, cutoff: float = 0.0) -> Scene:
    """
    The grains of a frame and its RVs, in ascending order, about one centre.

    Grains of a periodic frame lie at their images next to the centre of the RVs.
    """
    packing, window = sample.packing, windows[-1]
    grains, shapes = grains_of(sample, window), tuple(one.shape for one in windows)
    if packing.cell is not None:
        grains = _about(window, grains, packing.cell)
    return Scene(grains, window.center, shapes, cutoff=cutoff, space=packing.space)


def grains_of(sample: Sample, window: Window | None) -> Grains:
    """The particles of a frame: which are rattlers or boundary, and which lie in the RV."""
    packing, bodies = sample.packing, sample.packing.bodies
    return Grains(
        position=packing.position,
        radius=packing.radius,
        id=packing.id,
        contacts=sample.contact_numbers,
        rattler=sample.rattlers,
        boundary=sample.boundary,
        in_window=inside(packing.position if bodies is None else bodies.place, sample, window),
        to_place=None if bodies is None else bodies.to_place(packing.position, packing.cell),
        body=None if bodies is None else bodies.number,
    )


def inside(points: FloatArray, sample: Sample, window: Window | None) -> BoolArray:
    """Which points lie in the RV; if there is no RV, none do."""
    if window is None or len(points) == 0:
        return np.zeros(len(points), bool)
    return window.contains(points, sample.packing)


def _about(window: Window, grains: Grains, cell: Cell) -> Grains:
    """
    Move every grain of a periodic frame to its image next to the RV's centre.

    Otherwise faces of the cell would cut the RV, and clumps, into pieces. Further images that reach
    into the RV are added.
    """
    branch = grains.position - window.center
    nearest = branch + cell.nearest_image(grains.places - window.center) @ cell.vectors
    images, row = cell.images_near_origin(branch, grains.radius + window.radius)
    other = np.linalg.norm(images - nearest[row], axis=1) > 1e-6 * grains.radius[row]
    rows = np.concatenate([np.arange(len(nearest)), row[other]])
    taken = {name: values[rows] for name, values in vars(grains).items() if values is not None}
    taken["position"] = np.concatenate([nearest, images[other]]) + window.center
    moved = replace(grains, **taken)
    moved.in_window[:] = window.shape.contains(moved.places - window.center)
    return moved


def section_lines(scene: Scene, axis: npt.ArrayLike) -> Segments:
    """
    Parallel scan lines, inclined to the axis, in a plane through the centre that holds the axis.

    In the dump's coordinates; clipped to the RV.
    """
    grains, solid = scene.grains, ~scene.grains.boundary
    up = np.asarray(axis, dtype=np.float64)
    depth = towards_viewer(up, scene.space)
    across = np.cross(depth, up)
    turn = np.radians(LINE_ANGLE)
    along = np.cos(turn) * across + np.sin(turn) * up
    frame = np.stack([np.cross(depth, along), depth, along])
    position, radius = grains.position[solid] - scene.center, grains.radius[solid]
    reach = scene.window.reach
    spacing = max(2.5 * float(radius.mean()), reach / 40) if len(radius) else reach
    steps = np.arange(-reach + 0.5 * spacing, reach, spacing)
    points = np.column_stack([steps, np.zeros_like(steps)])
    found = cut_lines(position, radius, frame, points, scene.window)
    return replace(found, ends=found.ends + scene.center)


def towards_viewer(up: FloatArray, space: Space) -> FloatArray:
    """A unit vector across the axis that is upright, from a section to who looks at it."""
    if space.is_plane:
        # x is on the right of y in the plane x-y, and likewise in the others
        return space.normal if space.across != 1 else -space.normal
    toward: FloatArray = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    return toward / np.linalg.norm(toward)
