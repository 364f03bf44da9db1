"""Which blocks of a map lose segments at a surface, and how much of a block lies in a window."""

from __future__ import annotations

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.packing.sample import Sample
from scanfab.scan.blocks import Blocks

# of the mean radius: blocks further inside lose next to no segments that leave the sample
DEPTH = 2.0
# of unit vectors for the ball about a corner, and for the surface of a shell
SOME = 8
# through all blocks that a window cuts, and through each of them the fewest and most along an edge
LINES, SIDE = 1e6, (16, 64)
# of rays through shells; even, so that all octants get as many, and none lies between two
POLAR, AZIMUTHS = 64, 128


def outlines(blocks: Blocks) -> FloatArray:
    """Places whose hull is a block's, or nearly a shell's outer surface, shape (B, K, 3)."""
    if blocks.edges is None:
        return blocks.corners
    units = direction_points()[0][::SOME]
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
    for unit in direction_points()[0][::SOME]:
        moved = outline + DEPTH * mean * unit
        inside &= window.contains(moved.reshape(-1, 3)).reshape(inside.shape)
    return np.asarray(~inside.all(axis=1))


def volumes_inside(
    blocks: Blocks, splits: tuple[int, int, int], window: Convex | None, center: FloatArray
) -> FloatArray:
    """
    What of each part of each block lies in a window, if there is one; shape (B, P).

    Each line is cut exactly at the window, so that volumes are right to a part in a thousand.
    """
    parts = int(np.prod(splits))
    if window is None:
        return np.repeat(blocks.volumes[:, None] / parts, parts, axis=1)
    finer = blocks.finer(splits)
    of = _grid_inside if blocks.edges is None else _shells_inside
    found: FloatArray = np.empty((len(blocks), parts))
    block, part = blocks.of_finer(splits)
    found[block, part] = of(finer, window, center)
    return found


def _grid_inside(blocks: Blocks, window: Convex, center: FloatArray) -> FloatArray:
    """The volumes of blocks of a grid in a window, (B,)."""
    edges = blocks.corner_edges[1] / np.array(blocks.parts)[:, None]
    corners = blocks.corners - center
    # a block all of whose corners lie in a convex window does so, too
    whole = window.contains(corners.reshape(-1, 3)).reshape(corners.shape[:2]).all(axis=1)
    reach = 0.5 * np.linalg.norm(corners[:, 0] - corners[:, -1], axis=1)
    cut = np.flatnonzero(~whole & window.may_meet(corners.mean(axis=1), reach))
    side = int(np.clip(np.sqrt(LINES / max(len(cut), 1)), *SIDE))
    share = np.where(whole, 1.0, 0.0)
    for block in cut:
        turns = (np.roll(edges, turn, axis=0) for turn in range(3))
        shares = [_along_lines(turned, corners[block, 0], window, side) for turned in turns]
        # lines along a cylinder's axis are inside or outside, and tell its volume less well
        share[block] = min(shares, key=_roughness).mean()
    return np.asarray(share * blocks.volumes)


def _roughness(shares: FloatArray) -> float:
    """How much neighbouring lines differ."""
    return sum(float(np.sum(np.diff(shares, axis=axis) ** 2)) for axis in (0, 1))


def _along_lines(edges: FloatArray, corner: FloatArray, window: Convex, side: int) -> FloatArray:
    """Which part of lines along the last edge lies in a window; by their places on the others."""
    one, two, along = edges
    steps = (np.arange(side) + 0.5) / side
    starts = corner + (steps[:, None, None] * one + steps[:, None] * two).reshape(-1, 3)
    return window.share(starts, np.broadcast_to(along, starts.shape)).reshape(side, side)


def _shells_inside(blocks: Blocks, window: Convex, center: FloatArray) -> FloatArray:
    """The volumes of the octants of shells about a window's centre, by rays from there; (B,)."""
    cosine, weight = np.polynomial.legendre.leggauss(POLAR)
    azimuth = 2.0 * np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS
    sine, weight = np.repeat(np.sqrt(1.0 - cosine**2), AZIMUTHS), np.repeat(weight, AZIMUTHS)
    along, turn = np.repeat(cosine, AZIMUTHS), np.tile(azimuth, POLAR)
    units = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), along])
    bounds = np.append(blocks.radii[:, 0], blocks.radius)
    rays = blocks.radius * units
    ends = blocks.radius * window.share(np.zeros_like(rays), rays)
    cones = np.diff(np.minimum(bounds, ends[:, None]) ** 3) * weight[:, None] * 2 * np.pi / AZIMUTHS
    octant = blocks.of(center + 0.5 * bounds[1] * units)
    found = [np.bincount(octant, shell, minlength=8) for shell in cones.T / 3.0]
    return np.concatenate(found)


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
