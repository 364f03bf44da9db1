"""What there is to see in a frame, as plain arrays: grains, contacts, lines; for every viewer."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.scan.segments import Segments, cut_lines

# between the lines of a section and the plane across the axis, degrees
LINE_ANGLE = 30.0
# of a colour, each of its parts: what tells clumps apart that are neighbours
SHADES = (1.0, 0.8, 0.62)


@dataclass(frozen=True, eq=False)
class Grains:
    """All particles of a frame, N rows (of clumps, each sphere); lengths in the dump's unit."""

    position: FloatArray
    radius: FloatArray
    id: IntArray
    contacts: IntArray
    """Number of contacts of each, those with boundary particles and walls included."""
    rattler: BoolArray
    boundary: BoolArray
    in_window: BoolArray
    """Whether the grain's centre lies in the RV; false for all without an RV."""
    to_place: FloatArray | None = None
    """From each sphere to the place of its body, shape (N, 3); None if each is one of its own."""
    body: IntArray | None = None
    """Number of each sphere's body, negative for one of its own; None if all are."""

    @property
    def places(self) -> FloatArray:
        """Where the grains are: for each sphere, the place of the body that it is a part of."""
        return self.position if self.to_place is None else self.position + self.to_place

    @property
    def shade(self) -> IntArray:
        """Which of the shades each sphere has: one for all spheres of a body, shape (N,)."""
        if self.body is None:
            return np.zeros(len(self.radius), np.int64)
        return np.asarray(np.maximum(self.body, 0) % len(SHADES))


@dataclass(frozen=True, eq=False)
class ContactLines:
    """All contacts of a frame as branch vectors, M rows; lengths in the dump's unit."""

    ends: FloatArray
    """Both centres, shape (M, 2, 3); the second next to the first through periodic faces."""
    normal: FloatArray
    force: FloatArray | None
    """On the second grain, shape (M, 3), dump's unit."""
    boundary: BoolArray
    """Whether a boundary particle takes part."""
    in_window: BoolArray
    """Whether the contact point lies in the RV."""


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame to be looked at."""

    grains: Grains
    center: FloatArray
    """Of the RV, or of the grains without an RV, shape (3,)."""
    window: Convex | None
    """The RV about its centre, of several the largest; None without one."""
    smaller: tuple[Convex, ...] = ()
    """The others."""
    lines: Segments | None = None
    """A few scan lines, in the dump's coordinates."""
    cutoff: float = 0.0
    """Void segments that are shorter are dropped, dump's unit."""
    cell: Cell | None = None
    """Of a periodic frame."""
    space: Space = SPACE
    """The plane in which all lies, if the grains are discs."""


def scene_of(sample: Sample, *windows: Window) -> Scene:
    """The grains of a frame and its RVs, in ascending order, about one centre."""
    window = windows[-1] if windows else None
    chosen = sample.grains if sample.grains.any() else np.ones(len(sample.packing), bool)
    center = np.zeros(3) if window is None else window.center
    if window is None and len(sample.packing):
        center = sample.packing.position[chosen].mean(axis=0)
        if sample.packing.space.across is not None:
            center[sample.packing.space.across] = sample.packing.place_across
    cell = sample.packing.cell if sample.packing.is_periodic else None
    shape = None if window is None else window.shape
    smaller = tuple(one.shape for one in windows[:-1])
    space = sample.packing.space
    return Scene(grains_of(sample, window), center, shape, smaller, cell=cell, space=space)


def about_window(scene: Scene) -> Scene:
    """
    A periodic frame with every grain at its image next to the RV's centre.

    Else an RV near a face, or in a cell that is sheared, would be seen in pieces, and so would be a
    clump. Further images that reach into the RV are there too.
    """
    cell, grains = scene.cell, scene.grains
    if cell is None or scene.window is None:
        return scene
    branch = grains.position - scene.center
    nearest = branch + cell.nearest_image(grains.places - scene.center) @ cell.vectors
    images, row = cell.images_near_origin(branch, grains.radius + scene.window.reach)
    other = np.linalg.norm(images - nearest[row], axis=1) > 1e-6 * grains.radius[row]
    rows = np.concatenate([np.arange(len(nearest)), row[other]])
    position = np.concatenate([nearest, images[other]]) + scene.center
    values = {one.name: getattr(grains, one.name) for one in fields(grains)}
    shown: dict[str, Any] = {name: of if of is None else of[rows] for name, of in values.items()}
    shown["position"] = position
    moved = Grains(**shown)
    moved.in_window[:] = scene.window.contains(moved.places - scene.center)
    return replace(scene, grains=moved)


def section_lines(scene: Scene, axis: npt.ArrayLike) -> Segments:
    """
    Parallel scan lines, inclined to the axis, in a plane through the centre that holds the axis.

    In the dump's coordinates; clipped to the RV, if there is one, in which periodic images of the
    grains are solid too.
    """
    grains = scene.grains
    solid = ~grains.boundary
    up = np.asarray(axis, dtype=np.float64)
    depth = towards_viewer(up, scene.space)
    across = np.cross(depth, up)
    turn = np.radians(LINE_ANGLE)
    along = np.cos(turn) * across + np.sin(turn) * up
    frame = np.stack([np.cross(depth, along), depth, along])
    position = grains.position[solid] - scene.center
    radius = grains.radius[solid]
    reach = float(np.linalg.norm(position, axis=1).max(initial=0.0))
    if scene.window is not None:
        reach = scene.window.reach
    if scene.cell is not None and scene.window is not None:
        position, row = scene.cell.images_near_origin(position, radius + reach)
        radius = radius[row]
    spacing = max(2.5 * float(radius.mean()), reach / 40) if len(radius) else reach
    steps = np.arange(-reach + 0.5 * spacing, reach, spacing) if spacing > 0 else np.zeros(0)
    points = np.column_stack([steps, np.zeros_like(steps)])
    found = cut_lines(position, radius, frame, points, scene.window)
    return replace(found, ends=found.ends + scene.center)


def towards_viewer(up: FloatArray, space: Space) -> FloatArray:
    """A unit vector across the axis that is upright, from a section to who looks at it."""
    if space.is_plane:
        # what is upright has the plane's first axis on its right, if it is the second one
        return space.normal if space.across != 1 else -space.normal
    toward: FloatArray = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    return toward / np.linalg.norm(toward)


def grains_of(sample: Sample, window: Window | None) -> Grains:
    """The particles of a frame, with what the sample knows of them."""
    packing, bodies = sample.packing, sample.packing.bodies
    places = packing.position if bodies is None else bodies.place
    return Grains(
        position=packing.position,
        radius=packing.radius,
        id=packing.id,
        contacts=sample.contact_numbers,
        rattler=sample.rattlers,
        boundary=sample.boundary,
        in_window=_inside(places, sample, window),
        to_place=None if bodies is None else bodies.to_place(packing.position, packing.cell),
        body=None if bodies is None else bodies.number,
    )


def contact_lines(sample: Sample, window: Window | None) -> ContactLines:
    """The contacts of a frame as lines between centres."""
    packing, contacts = sample.packing, sample.contacts
    first, second = packing.position[contacts.pairs].transpose(1, 0, 2)
    if packing.cell is not None:
        second = second + contacts.image @ packing.cell.vectors
    return ContactLines(
        ends=np.stack([first, second], axis=1),
        normal=contacts.normal,
        force=contacts.force,
        boundary=~sample.contacts_without(sample.boundary),
        in_window=_inside(contacts.point, sample, window),
    )


def _inside(points: FloatArray, sample: Sample, window: Window | None) -> BoolArray:
    if window is None or len(points) == 0:
        return np.zeros(len(points), bool)
    return window.contains(points, sample.packing)
