"""Blocks of a map: where they lie, which lie at a surface, and their volumes in the RV."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.map_settings import BLOCK_OPTIONS, MapSettings
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads

# Thickness of a block in mean radii. A block thinner than the first is smaller than a grain and is
# refused. In a block thinner than the second, nearly all grains reach into neighbouring blocks.
REFUSED_BELOW, DOUBTED_BELOW = 1.0, 4.0
# least cosine of the angle between the loading axis and the normal of the faces of slices
MOST_OBLIQUE = 0.8
# in mean radii: blocks that lie deeper inside lose hardly any segments at the surface
DEPTH = 2.0
# every SOME-th unit vector is used to represent the outer surface of a shell
SOME = 8
# LINES: lines through all blocks that a window cuts together; SIDE: fewest and most per block edge
LINES, SIDE = 1e6, (16, 64)
# Numbers of rays through shells. They are even, so that each octant gets as many rays and no ray
# lies between two octants.
POLAR, AZIMUTHS = 64, 128


class MapBlocks(NamedTuple):
    """
    The region that the blocks of a map tile; lengths in the dump's unit.

    For the whole sample it is a parallelepiped: along periodic vectors it is the cell of each
    frame, and along other axes it is the extent of the grains in the first frame. For the RV it is
    the box around the RV in each frame.
    """

    settings: MapSettings
    axes: FloatArray
    """Unit vectors along which blocks lie if the sample is not periodic, as rows."""
    low: FloatArray
    """Lower end of the region along each axis, from the origin of the axes, shape (3,)."""
    high: FloatArray
    """Upper end of the region along each axis, shape (3,)."""

    @classmethod
    def of(cls, settings: MapSettings, sample: Sample) -> MapBlocks:
        """
        Find the region of a map from the reference frame.

        Raises
        ------
        SettingsError
            If the grains are discs in a plane.
        """
        packing, gathered = sample.packing, sample.gathered
        if packing.space.is_plane:
            found = f"all grains are discs in {packing.space}"
            raise SettingsError(f"a map needs spheres, but {found}: use `compute` with `rv_center`")
        open_axes = np.eye(3)
        if settings.slices is not None:
            # the loading axis is the last one
            open_axes = line_triads(np.array([settings.axis], dtype=np.float64))[0]
        axes, origin, *_ = _axes(packing.cell, open_axes)
        to_axes = np.linalg.inv(axes)
        places = (packing.position[gathered] - origin) @ to_axes
        # reach of a sphere along each axis, measured normal to the plane of the other two axes
        reach = packing.radius[gathered, None] * np.linalg.norm(to_axes, axis=0)
        return cls(settings, open_axes, (places - reach).min(axis=0), (places + reach).max(axis=0))

    def of_whole(self, cell: Cell | None) -> Blocks:
        """Blocks of the whole sample in a frame, in the dump's coordinates."""
        axes, origin, repeats, period = _axes(cell, self.axes)
        low, high = np.where(repeats, 0.0, self.low), np.where(repeats, period, self.high)
        return self._parted(origin + low @ axes, (high - low)[:, None] * axes, repeats)

    def of_window(self, window: Window) -> Blocks:
        """Blocks of the box around an RV, in the dump's coordinates."""
        axes, shape = self.axes, window.shape
        reach = np.array([shape.support(sign * axes) for sign in (-1.0, 1.0)])
        low, high = np.einsum("sij,ij->si", reach, axes)
        if self.settings.shells is not None:
            low, high = np.full(3, -shape.reach), np.full(3, shape.reach)
        edges = (high - low)[:, None] * axes
        return self._parted(window.center + low @ axes, edges, np.zeros(3, bool))

    def _parted(self, corner: FloatArray, edges: FloatArray, repeats: BoolArray) -> Blocks:
        """Divide the region into the blocks of the settings."""
        settings, undivided = self.settings, Blocks(corner, edges, (1, 1, 1), repeats)
        if settings.shells is not None:
            radius = 0.5 * float(undivided.heights.min())
            return replace(undivided, radius=radius, shells=settings.shells)
        if settings.grid is not None:
            return replace(undivided, parts=settings.grid)
        # slices are parallel to the faces that are most nearly normal to the loading axis
        cosines = np.abs(undivided.matrix @ np.asarray(settings.axis)) * undivided.heights
        across = int(np.argmax(cosines))
        if cosines[across] < MOST_OBLIQUE:
            angle = np.degrees(np.arccos(cosines[across]))
            raise SettingsError(
                f"slices: they lie along faces of the periodic cell, whose nearest normal is "
                f"{angle:.0f} degrees off the axis: choose another `axis`, or `grid`"
            )
        parts = np.where(np.arange(3) == across, settings.blocks, 1)
        return replace(undivided, parts=tuple(parts.tolist()))

    def doubts(self, sample: Sample, window: Window | None) -> Iterator[Note]:
        """
        Check that the blocks are large enough.

        Raises
        ------
        SettingsError
            If a block is thinner than a mean radius.
        """
        mean = float(sample.packing.radius[sample.grains].mean())
        tilings = [self.of_window(window)] if window is not None else []
        if {*"ab"} & {*self.settings.variants}:
            tilings.append(self.of_whole(sample.packing.cell))
        thinnest = float(min(tiling.heights.min() for tiling in tilings))
        name = next(option for option in BLOCK_OPTIONS if getattr(self.settings, option))
        text = (
            f"makes blocks {thinnest:.4g} thick, {thinnest / mean:.3g} mean radii of the grains: "
            f"choose fewer, so that they are at least {DOUBTED_BELOW:g} mean radii thick "
            f"({DOUBTED_BELOW * mean:.4g})"
        )
        times = thinnest / mean / (1.0 - 1e-9)
        if times < REFUSED_BELOW:
            raise SettingsError(f"{name}: {text}: a block smaller than a grain has no fabric")
        if times < DOUBTED_BELOW:
            unsure = "grains reach into several blocks, so the errors of blocks are uncertain"
            yield Note("thin_blocks", f"`{name}` {text}: {unsure}")


def _axes(
    cell: Cell | None, open_axes: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Axes of the whole: unit vectors, origin, which axes are periodic, and their periods."""
    if cell is None or not cell.is_periodic:
        return open_axes, np.zeros(3), np.zeros(3, bool), np.zeros(3)
    period = np.linalg.norm(cell.vectors, axis=1)
    return cell.vectors / period[:, None], cell.origin, np.array(cell.periodic), period


def near_surface(blocks: Blocks, sample: Sample, window: Window | None) -> BoolArray:
    """
    Which blocks lie so near to a surface that they lose segments, shape (B,).

    The surface is that of the window, or without a window that of the sample.
    """
    mean = float(sample.packing.radius[sample.gathered].mean())
    # planes n·x = f that touch the surface: n has the shape (K, 3), f has the shape (K,)
    if window is None:
        normals, furthest = _hull_of(sample)
    else:
        normals = np.concatenate([window.shape.planes[:, :3], direction_points()[0]])
        touching = window.shape.support(normals) + window.center
        furthest = np.einsum("ki,ki->k", touching, normals)
    outline = blocks.corners
    if blocks.radius:
        units = direction_points()[0][::SOME]
        outline = blocks.middles[:, None] + blocks.bounds[1:, None, None] * units
    near = np.zeros(len(blocks), bool)
    for normal, distance in zip(normals, furthest, strict=True):
        near |= np.any(outline @ normal - distance > -DEPTH * mean, axis=1)
    return near


def _hull_of(sample: Sample) -> tuple[FloatArray, FloatArray]:
    """Facets of the hull of the grain centres; a plane in front of all blocks if it is flat."""
    from scipy.spatial import ConvexHull, QhullError

    cell, across = sample.packing.cell, np.eye(3)
    if cell is not None and cell.is_periodic:
        repeating = cell.vectors[np.array(cell.periodic)]
        # orthonormal vectors normal to the periodic vectors: only along these is there a surface
        across = np.linalg.svd(repeating)[2][len(repeating) :]
    places = sample.packing.position[sample.gathered] @ across.T
    if len(across) < 2:
        return np.concatenate([across, -across]), np.array([*places.max(0), *-places.min(0)])
    try:
        facets = np.unique(ConvexHull(places).equations, axis=0)
    except (QhullError, ValueError):
        return np.zeros((1, 3)), np.array([-np.inf])
    return facets[:, :-1] @ across, -facets[:, -1]


def volumes_inside(blocks: Blocks, window: Window | None) -> FloatArray:
    """
    Volumes of the eight parts of each block inside a window, shape (B, 8).

    Without a window the parts count in full. Lines are cut exactly at the window, so that the
    volumes are right to about 0.1 %.
    """
    if window is None:
        return np.repeat(blocks.volumes[:, None] / 8, 8, axis=1)
    inside = _shells_inside if blocks.radius else _grid_inside
    return blocks.by_part(inside(blocks.finer().moved(window.center), window.shape))


def _grid_inside(blocks: Blocks, window: Convex) -> FloatArray:
    """Volumes of the blocks of a grid inside a window about the origin, shape (B,)."""
    edges, corners = blocks.edges / np.array(blocks.parts)[:, None], blocks.corners
    # a window is convex, so it contains a block if it contains all corners
    whole = window.contains(corners.reshape(-1, 3)).reshape(corners.shape[:2]).all(axis=1)
    reach = 0.5 * np.linalg.norm(corners[:, 0] - corners[:, -1], axis=1)
    cut = np.flatnonzero(~whole & window.may_meet(corners.mean(axis=1), reach))
    side = int(np.clip(np.sqrt(LINES / max(len(cut), 1)), *SIDE))
    steps = (np.arange(side) + 0.5) / side
    share = np.where(whole, 1.0, 0.0)
    for block in cut:
        best = np.inf
        for turn in range(3):
            first, second, along = np.roll(edges, turn, axis=0)
            across = (steps[:, None, None] * first + steps[:, None] * second).reshape(-1, 3)
            lines = window.share(corners[block, 0] + across, np.broadcast_to(along, across.shape))
            lines = lines.reshape(side, side)
            # The direction whose lines vary least is used: lines along the axis of a cylinder, for
            # example, are either inside or outside and give its volume less accurately.
            rough = sum(float(np.sum(np.diff(lines, axis=axis) ** 2)) for axis in (0, 1))
            if rough < best:
                best, share[block] = rough, lines.mean()
    return np.asarray(share * blocks.volumes)


def _shells_inside(blocks: Blocks, window: Convex) -> FloatArray:
    """Volumes of the octants of shells inside a window, by rays from its centre, shape (B,)."""
    cosine, weight = np.polynomial.legendre.leggauss(POLAR)
    along = np.repeat(cosine, AZIMUTHS)
    turn = np.tile(2.0 * np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS, POLAR)
    across = np.sqrt(1.0 - along**2)
    units = np.column_stack([across * np.cos(turn), across * np.sin(turn), along])
    share = window.share(np.zeros_like(units), blocks.radius * units)
    cones = np.diff(np.minimum(blocks.bounds, blocks.radius * share[:, None]) ** 3) / 3.0
    cones *= np.repeat(weight, AZIMUTHS)[:, None] * 2.0 * np.pi / AZIMUTHS
    octant = blocks.of(0.5 * blocks.bounds[1] * units)
    return np.concatenate([np.bincount(octant, shell, minlength=8) for shell in cones.T])
