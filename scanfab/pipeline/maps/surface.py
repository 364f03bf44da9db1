"""Which blocks of a map lose segments at a surface, and how much of a block lies in a window."""

from __future__ import annotations

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.distribution import sphere_points
from scanfab.packing.sample import Sample
from scanfab.scan.blocks import Blocks

__all__ = ["cut_by_hull", "cut_by_window", "volumes_inside"]

# of the mean radius: blocks further inside lose next to no segments that leave the sample
DEPTH = 2.0
# of unit vectors for the ball about a corner, and for the surface of a shell
SOME = 8


def outlines(blocks: Blocks) -> FloatArray:
    """Places whose hull is a block's, or nearly a shell's outer surface, shape (B, K, 3)."""
    if blocks.edges is None:
        return blocks.corners
    units = sphere_points()[0][::SOME]
    return np.asarray(blocks.middles[:, None] + blocks.radii[:, 1, None, None] * units)


def cut_by_hull(blocks: Blocks, sample: Sample) -> BoolArray:
    """
    Which blocks do not lie within the hull of the grains' centres, two mean radii below it.

    Along the vectors that repeat there is no surface. Shape (B,).
    """
    packing = sample.packing
    across = _open_directions(sample)
    outline = outlines(blocks) @ across
    if not across.shape[1]:
        return np.zeros(len(blocks), bool)
    places = packing.position[sample.gathered] @ across
    depth = DEPTH * float(packing.radius[sample.gathered].mean())
    facets = _facets(places)
    if facets is None:
        return np.ones(len(blocks), bool)
    found = np.zeros(len(blocks), bool)
    for *normal, distance in facets:
        found |= np.any(outline @ np.array(normal) + distance > -depth, axis=1)
    return found


def cut_by_window(blocks: Blocks, window: Convex, center: FloatArray, mean: float) -> BoolArray:
    """Which blocks do not lie within a window, two mean radii below its surface; shape (B,)."""
    outline = outlines(blocks) - center
    inside = np.ones(outline.shape[:2], bool)
    for unit in sphere_points()[0][::SOME]:
        moved = outline + DEPTH * mean * unit
        inside &= window.contains(moved.reshape(-1, 3)).reshape(inside.shape)
    return np.asarray(~inside.all(axis=1))


def volumes_inside(
    blocks: Blocks, splits: tuple[int, int, int], window: Convex | None, center: FloatArray
) -> FloatArray:
    """What of each part of each block lies in a window, if there is one; shape (B, P)."""
    finer, parts = blocks.finer(splits), int(np.prod(splits))
    volumes = np.empty((len(blocks), parts))
    order = blocks.of_finer(splits)
    if window is None and blocks.edges is None:
        return np.repeat(blocks.volumes[:, None] / parts, parts, axis=1)
    for block in range(len(blocks)):
        places, share = blocks.filled(block)
        part = order[1][finer.of(places)]
        inside = np.ones(len(places), bool)
        if window is not None:
            inside = window.contains(places - center)
        volumes[block] = np.bincount(part, share * inside, minlength=parts)
    return volumes


def _open_directions(sample: Sample) -> FloatArray:
    """Orthonormal directions across the vectors that repeat, as columns, shape (3, K)."""
    cell = sample.packing.cell
    if cell is None or not cell.is_periodic:
        return np.eye(3)
    repeating = cell.vectors[np.array(cell.periodic)]
    # what the repeating vectors do not span
    *_, rows = np.linalg.svd(repeating)
    return np.asarray(rows[len(repeating) :].T)


def _facets(places: FloatArray) -> FloatArray | None:
    """Of the places' hull, normals and distances n·x + d <= 0 inside; None of flat samples."""
    from scipy.spatial import ConvexHull, QhullError

    if places.shape[1] == 1:
        return np.array([[1.0, -places.max()], [-1.0, places.min()]])
    try:
        return np.unique(ConvexHull(places).equations, axis=0)
    except (QhullError, ValueError):
        return None
