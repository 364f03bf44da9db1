"""Pairs of grains that overlap, or that nearly touch: where short gaps are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.packing.sample import Sample, Variant
from scanfab.packing.search import overlapping_pairs
from scanfab.packing.window import Window


@dataclass(frozen=True, eq=False)
class NearPairs:
    """
    Pairs of a region's grains whose surfaces are near, and how much the grains shade.

    Attributes
    ----------
    normal : ndarray, shape (M, 3)
        Unit vectors between the centres of each pair.
    overlap : ndarray, shape (M,)
        r1 + r2 less the distance of the centres, dump's length unit; below 0 for a gap.
    reduced_radius : ndarray, shape (M,)
        r1 r2 / (r1 + r2), dump's length unit.
    shadow : float
        What lines of one direction meet of all grains: Σ π r², of discs Σ 2 r.
    volume : float
        Of the region, of discs its area.
    space : Space
        The plane in which discs lie.
    """

    normal: FloatArray
    overlap: FloatArray
    reduced_radius: FloatArray
    shadow: float
    volume: float
    space: Space = SPACE


def near_pairs(sample: Sample, variant: Variant, window: Window | None, gap: float) -> NearPairs:
    """
    The pairs of a variant's solids whose surfaces are no more than a gap apart.

    Parameters
    ----------
    sample : Sample
        Of spheres, without clumps.
    variant : Variant
        Whose solids.
    window : Window or None
        The RV, in which the pairs' middles and the grains' centres lie; None for a whole that
        repeats along all vectors of its cell.
    gap : float
        Between surfaces, dump's length unit.

    Returns
    -------
    NearPairs
    """
    packing = sample.packing
    solid = sample.grains & ~sample.removed(variant)
    position, radius = packing.position[solid], packing.radius[solid]
    pairs, image = overlapping_pairs(position, radius + 0.5 * gap, 1.0, packing.cell)
    one, two = pairs.T
    branch = position[two] - position[one]
    if packing.cell is not None:
        branch += image @ packing.cell.vectors
    distance = np.linalg.norm(branch, axis=1)
    normal = branch / np.where(distance > 0.0, distance, 1.0)[:, None]
    overlap = radius[one] + radius[two] - distance
    chosen = distance > 0.0
    inside = sample.counted(variant, window)[solid]
    if window is not None:
        middle = position[one] + normal * (radius[one] - 0.5 * overlap)[:, None]
        chosen &= window.contains(middle, packing)
        volume = window.shape.volume
    else:
        assert packing.cell is not None
        volume = packing.cell.volume
    reduced = radius[one] * radius[two] / (radius[one] + radius[two])
    return NearPairs(
        normal[chosen],
        overlap[chosen],
        reduced[chosen],
        packing.space.shadow(radius[inside]),
        volume,
        packing.space,
    )
