"""The blocks of the sample or the RV: what lies in them, and which of them a surface cuts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.maps.measurement import MapMeasurement
from scanfab.scan.blocks import Blocks
from scanfab.scan.edges import ENDS, START

# of the mean radius: blocks further inside lose next to no segments that leave the sample
DEPTH = 2.0
# of unit vectors for the outer surface of a shell
SOME = 8
# through all blocks that a window cuts, and through each of them the fewest and most along an edge
LINES, SIDE = 1e6, (16, 64)
# of rays through shells; even, so that all octants get as many, and none lies between two
POLAR, AZIMUTHS = 64, 128


@dataclass(frozen=True, eq=False)
class Region:
    """The blocks of the whole sample, of a and b, or of the window, of c and d."""

    sample: Sample
    window: Window | None
    """None for the whole."""
    blocks: Blocks
    """In the dump's coordinates."""
    at_surface: BoolArray
    """Which blocks lose segments, shape (B,)."""
    volumes: FloatArray
    """What of each of the eight parts of each block lies in the region, shape (B, 8)."""

    @classmethod
    def of(cls, sample: Sample, found: MapMeasurement, in_window: bool) -> Region:
        """Of the whole sample, or of the RV, of a frame."""
        plan, solids, blocks = found.plan, found.solids, found.blocks[in_window]
        window = plan.window if in_window else None
        if window is not None and plan.edge == START:
            # it follows segments beyond the RV, and gives each end to the block it is in
            facets = np.zeros((0, 4))
        elif window is not None:
            facets = _facets_of_window(window.shape, window.center)
        elif plan.edge == ENDS and solids.inner is not None:
            facets = _facets_of_window(solids.inner.shape, solids.inner.center + solids.origin)
        else:
            facets = _facets_of_hull(sample)
        outline = blocks.corners
        if blocks.radius:
            units = direction_points()[0][::SOME]
            outline = blocks.middles[:, None] + blocks.bounds[1:, None, None] * units
        at_surface = np.zeros(len(blocks), bool)
        depth = DEPTH * float(sample.packing.radius[sample.gathered].mean())
        for *normal, distance in facets:
            at_surface |= np.any(outline @ np.array(normal) + distance > -depth, axis=1)
        return cls(sample, window, blocks, at_surface, volumes_inside(blocks, window))

    def placed(self, points: FloatArray) -> FloatArray:
        """Those images of places that are next to the window's centre."""
        if self.window is None:
            return points
        return self.window.center + self.window.branches(points, self.sample.packing)

    def sums(self, points: FloatArray, *values: Any) -> list[FloatArray]:
        """Values of places by the block and the part that these lie in, shape (B, 8) each."""
        number = self.blocks.finer().of(self.placed(points))
        inside, count = number >= 0, 8 * len(self.blocks)
        return [
            self.blocks.by_part(np.bincount(number[inside], one[inside], count).astype(np.float64))
            for one in values
        ]


def _facets_of_window(shape: Convex, center: FloatArray) -> FloatArray:
    """
    Rows n, d with n·x + d <= 0 inside, shape (K, 4).

    Of a curved surface those that touch it in many directions.
    """
    normals = np.concatenate([shape.planes[:, :3], direction_points()[0]])
    furthest = np.einsum("ki,ki->k", shape.support(normals) + center, normals)
    return np.column_stack([normals, -furthest])


def _facets_of_hull(sample: Sample) -> FloatArray:
    """
    The same of the hull of the grains' centres; along vectors that repeat there is no surface.

    Every place lies outside that of a flat sample.
    """
    from scipy.spatial import ConvexHull, QhullError

    cell, across = sample.packing.cell, np.eye(3)
    if cell is not None and cell.is_periodic:
        repeating = cell.vectors[np.array(cell.periodic)]
        # orthonormal vectors of what these do not span
        across = np.linalg.svd(repeating)[2][len(repeating) :]
    places = sample.packing.position[sample.gathered] @ across.T
    if not len(across):
        return np.zeros((0, 4))
    if len(across) == 1:
        facets = np.array([[1.0, -places.max()], [-1.0, places.min()]])
    else:
        try:
            facets = np.unique(ConvexHull(places).equations, axis=0)
        except (QhullError, ValueError):
            return np.array([[0.0, 0.0, 0.0, np.inf]])
    return np.column_stack([facets[:, :-1] @ across, facets[:, -1]])


def volumes_inside(blocks: Blocks, window: Window | None) -> FloatArray:
    """
    What of each of the eight parts of each block lies in a window, if there is one; shape (B, 8).

    Each line is cut exactly at the window, so that volumes are right to a part in a thousand.
    """
    if window is None:
        return np.repeat(blocks.volumes[:, None] / 8, 8, axis=1)
    inside = _shells_inside if blocks.radius else _grid_inside
    finer = blocks.finer().moved(window.center)
    return blocks.by_part(inside(finer, window.shape))


def _grid_inside(blocks: Blocks, window: Convex) -> FloatArray:
    """The volumes of blocks of a grid in a window about the origin, (B,)."""
    edges, corners = blocks.edges / np.array(blocks.parts)[:, None], blocks.corners
    # a block all of whose corners lie in a convex window does so, too
    whole = window.contains(corners.reshape(-1, 3)).reshape(corners.shape[:2]).all(axis=1)
    reach = 0.5 * np.linalg.norm(corners[:, 0] - corners[:, -1], axis=1)
    cut = np.flatnonzero(~whole & window.may_meet(corners.mean(axis=1), reach))
    side = int(np.clip(np.sqrt(LINES / max(len(cut), 1)), *SIDE))
    steps = (np.arange(side) + 0.5) / side
    share = np.where(whole, 1.0, 0.0)
    for block in cut:
        found = []
        for turn in range(3):
            one, two, along = np.roll(edges, turn, axis=0)
            across = (steps[:, None, None] * one + steps[:, None] * two).reshape(-1, 3)
            lines = window.share(corners[block, 0] + across, np.broadcast_to(along, across.shape))
            found.append(lines.reshape(side, side))
        # lines along a cylinder's axis are inside or outside, and tell its volume less well
        share[block] = min(found, key=_roughness).mean()
    return np.asarray(share * blocks.volumes)


def _roughness(shares: FloatArray) -> float:
    """How much neighbouring lines differ."""
    return sum(float(np.sum(np.diff(shares, axis=axis) ** 2)) for axis in (0, 1))


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
