"""The blocks of the whole sample or of the RV: what lies in each, and which a surface cuts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.maps.volumes import volumes_inside
from scanfab.pipeline.plan import Plan
from scanfab.scan.blocks import Blocks
from scanfab.scan.edges import ENDS, START
from scanfab.scan.solids import Solids

# of the mean radius: blocks further inside lose next to no segments that leave the sample
DEPTH = 2.0
# of unit vectors for the outer surface of a shell
SOME = 8


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
    def of(
        cls, sample: Sample, plan: Plan, solids: Solids, blocks: Blocks, in_window: bool
    ) -> Region:
        """Of the whole sample, or of the RV of a frame."""
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
