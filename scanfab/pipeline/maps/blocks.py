"""Where the blocks of a map lie, which of them a surface cuts, and how much it leaves."""

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
from scanfab.pipeline.maps.settings import BLOCK_OPTIONS, MapSettings
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads

# Thickness of a block in mean radii: below the first it holds less than a grain, below the second
# hardly any grain that does not lie partly in its neighbours.
REFUSED_BELOW, DOUBTED_BELOW = 1.0, 4.0
# cosine of the angle between the axis and the normal of the faces that slices are parallel to
MOST_OBLIQUE = 0.8
# in mean radii: blocks deeper inside than this lose next to no segments that leave the sample
DEPTH = 2.0
# every so many unit vectors stand for the outer surface of a shell
SOME = 8
# lines through all blocks that a window cuts, and through each the fewest and most along an edge
LINES, SIDE = 1e6, (16, 64)
# of rays through shells; even, so that all octants get as many, and none lies between two
POLAR, AZIMUTHS = 64, 128


class MapBlocks(NamedTuple):
    """
    What the blocks of a map tile; lengths in the dump's unit.

    Of the whole sample they tile a parallelepiped: along the vectors of a cell that repeat the cell
    as it is in each frame, and along other axes what the grains took in the first frame. Of the RV
    they tile its box, wherever the RV is.
    """

    settings: MapSettings
    axes: FloatArray
    """Unit vectors along which blocks lie where nothing repeats, as rows."""
    low: FloatArray
    """From the origin of the axes, where what is tiled begins along each, shape (3,)."""
    high: FloatArray
    """Likewise where it ends."""

    @classmethod
    def of(cls, settings: MapSettings, sample: Sample) -> MapBlocks:
        """
        What the blocks of a map tile, by the first frame that has grains.

        Raises
        ------
        SettingsError
            If the grains are discs in a plane.
        """
        packing, gathered = sample.packing, sample.gathered
        if packing.space.is_plane:
            raise SettingsError(
                f"a map is of spheres in space, but all grains are discs in the plane "
                f"{packing.space.name}: `compute` has the fabric of RVs, wherever `rv_center` is"
            )
        open_axes = np.eye(3)
        if settings.slices is not None:
            # the loading axis is the last one
            open_axes = line_triads(np.array([settings.axis], dtype=np.float64))[0]
        axes, origin, *_ = _axes(packing.cell, open_axes)
        to_axes = np.linalg.inv(axes)
        places = (packing.position[gathered] - origin) @ to_axes
        # how far a sphere reaches along each, measured between planes of the two others
        reach = packing.radius[gathered, None] * np.linalg.norm(to_axes, axis=0)
        return cls(settings, open_axes, (places - reach).min(axis=0), (places + reach).max(axis=0))

    def of_whole(self, cell: Cell | None) -> Blocks:
        """Of the whole sample in a frame, in the dump's coordinates."""
        axes, origin, repeats, period = _axes(cell, self.axes)
        low, high = np.where(repeats, 0.0, self.low), np.where(repeats, period, self.high)
        return self._parted(origin + low @ axes, (high - low)[:, None] * axes, repeats)

    def of_window(self, window: Window) -> Blocks:
        """Of the box of an RV, in the dump's coordinates."""
        axes, shape = self.axes, window.shape
        reach = np.array([shape.support(sign * axes) for sign in (-1.0, 1.0)])
        low, high = np.einsum("sij,ij->si", reach, axes)
        if self.settings.shells is not None:
            low, high = np.full(3, -shape.reach), np.full(3, shape.reach)
        edges = (high - low)[:, None] * axes
        return self._parted(window.center + low @ axes, edges, np.zeros(3, bool))

    def _parted(self, corner: FloatArray, edges: FloatArray, repeats: BoolArray) -> Blocks:
        """What is tiled, in as many blocks as are asked for."""
        settings, one = self.settings, Blocks(corner, edges, (1, 1, 1), repeats)
        if settings.shells is not None:
            radius = 0.5 * float(one.heights.min())
            return replace(one, radius=radius, shells=settings.shells)
        if settings.grid is not None:
            return replace(one, parts=settings.grid)
        # slices lie between the faces that are most nearly normal to the axis
        cosines = np.abs(one.matrix @ np.asarray(settings.axis)) * one.heights
        across = int(np.argmax(cosines))
        if cosines[across] < MOST_OBLIQUE:
            angle = np.degrees(np.arccos(cosines[across]))
            raise SettingsError(
                f"slices: in a periodic cell they lie between its faces, the nearest of which is "
                f"{angle:.0f} degrees off the axis: choose another `axis`, or `grid`"
            )
        return replace(one, parts=tuple(settings.blocks if k == across else 1 for k in range(3)))

    def doubts(self, sample: Sample, window: Window | None, mean: float) -> Iterator[Note]:
        """
        Whether the blocks are large enough; ``mean`` is the mean radius.

        Raises
        ------
        SettingsError
            If they are smaller than a grain.
        """
        every = [self.of_window(window)] if window is not None else []
        if {*"ab"} & {*self.settings.variants}:
            every.append(self.of_whole(sample.packing.cell))
        thinnest = float(min(one.heights.min() for one in every))
        name = next(one for one in BLOCK_OPTIONS if getattr(self.settings, one))
        found = f"makes blocks {thinnest:.4g} thick, {thinnest / mean:.3g} mean radii of the grains"
        choose = (
            f"choose fewer, so that they are at least {DOUBTED_BELOW:g} mean radii thick "
            f"({DOUBTED_BELOW * mean:.4g})"
        )
        times = thinnest / mean / (1.0 - 1e-9)
        if times < REFUSED_BELOW:
            raise SettingsError(
                f"{name}: {found}: less than a grain says nothing of a fabric: {choose}"
            )
        if times < DOUBTED_BELOW:
            unsure = "grains lie in several blocks, and errors from parts of a block are uncertain"
            yield Note("thin_blocks", f"`{name}` {found}: {unsure}: {choose}")


def _axes(
    cell: Cell | None, open_axes: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Unit vectors along which the whole is tiled, where they begin, which repeat, and how soon."""
    if cell is None or not cell.is_periodic:
        return open_axes, np.zeros(3), np.zeros(3, bool), np.zeros(3)
    period = np.linalg.norm(cell.vectors, axis=1)
    return cell.vectors / period[:, None], cell.origin, np.array(cell.periodic), period


def near_surface(
    blocks: Blocks, normals: FloatArray, furthest: FloatArray, mean: float
) -> BoolArray:
    """
    Which blocks lie so near to the surface of a convex region that they lose segments, shape (B,).

    The planes n·x = f touch the region; ``normals`` n has the shape (K, 3), ``furthest`` f (K,).
    ``mean`` is the mean radius of the grains.
    """
    outline = blocks.corners
    if blocks.radius:
        units = direction_points()[0][::SOME]
        outline = blocks.middles[:, None] + blocks.bounds[1:, None, None] * units
    found = np.zeros(len(blocks), bool)
    for normal, distance in zip(normals, furthest, strict=True):
        found |= np.any(outline @ normal - distance > -DEPTH * mean, axis=1)
    return found


def surface_of(window: Window) -> tuple[FloatArray, FloatArray]:
    """Planes that touch a window in many directions, as :func:`near_surface` takes them."""
    normals = np.concatenate([window.shape.planes[:, :3], direction_points()[0]])
    places = window.shape.support(normals) + window.center
    return normals, np.einsum("ki,ki->k", places, normals)


def hull_of(sample: Sample) -> tuple[FloatArray, FloatArray]:
    """Likewise the facets of the hull of the grains' centres; a flat sample has no inside."""
    from scipy.spatial import ConvexHull, QhullError

    cell, across = sample.packing.cell, np.eye(3)
    if cell is not None and cell.is_periodic:
        repeating = cell.vectors[np.array(cell.periodic)]
        # orthonormal vectors of what these do not span: only there is a surface
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
    How much of each of the eight parts of each block lies in a window, if there is one; (B, 8).

    Each line is cut exactly at the window, so that volumes are right to a part in a thousand.
    """
    if window is None:
        return np.repeat(blocks.volumes[:, None] / 8, 8, axis=1)
    inside = _shells_inside if blocks.radius else _grid_inside
    return blocks.by_part(inside(blocks.finer().moved(window.center), window.shape))


def _grid_inside(blocks: Blocks, window: Convex) -> FloatArray:
    """The volumes of blocks of a grid in a window about the origin, shape (B,)."""
    edges, corners = blocks.edges / np.array(blocks.parts)[:, None], blocks.corners
    # as a window is convex, a block lies in it if all its corners do
    whole = window.contains(corners.reshape(-1, 3)).reshape(corners.shape[:2]).all(axis=1)
    reach = 0.5 * np.linalg.norm(corners[:, 0] - corners[:, -1], axis=1)
    cut = np.flatnonzero(~whole & window.may_meet(corners.mean(axis=1), reach))
    side = int(np.clip(np.sqrt(LINES / max(len(cut), 1)), *SIDE))
    steps = (np.arange(side) + 0.5) / side
    share = np.where(whole, 1.0, 0.0)
    for block in cut:
        best = np.inf
        for turn in range(3):
            one, two, along = np.roll(edges, turn, axis=0)
            across = (steps[:, None, None] * one + steps[:, None] * two).reshape(-1, 3)
            lines = window.share(corners[block, 0] + across, np.broadcast_to(along, across.shape))
            lines = lines.reshape(side, side)
            # lines along a cylinder's axis are inside or outside, and tell its volume less well
            rough = sum(float(np.sum(np.diff(lines, axis=axis) ** 2)) for axis in (0, 1))
            if rough < best:
                best, share[block] = rough, lines.mean()
    return np.asarray(share * blocks.volumes)


def _shells_inside(blocks: Blocks, window: Convex) -> FloatArray:
    """The volumes of the octants of shells about a window's centre, by rays from there; (B,)."""
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
