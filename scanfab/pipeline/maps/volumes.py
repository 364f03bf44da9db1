"""How much of the parts of a map's blocks lies in a window."""

from __future__ import annotations

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.typing import FloatArray
from scanfab.packing.window import Window
from scanfab.scan.blocks import Blocks

# through all blocks that a window cuts, and through each of them the fewest and most along an edge
LINES, SIDE = 1e6, (16, 64)
# of rays through shells; even, so that all octants get as many, and none lies between two
POLAR, AZIMUTHS = 64, 128


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
    azimuth = 2.0 * np.pi * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS
    sine, weight = np.repeat(np.sqrt(1.0 - cosine**2), AZIMUTHS), np.repeat(weight, AZIMUTHS)
    along, turn = np.repeat(cosine, AZIMUTHS), np.tile(azimuth, POLAR)
    units = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), along])
    rays = blocks.radius * units
    ends = blocks.radius * window.share(np.zeros_like(rays), rays)
    cones = np.diff(np.minimum(blocks.bounds, ends[:, None]) ** 3)
    cones *= weight[:, None] * 2 * np.pi / AZIMUTHS
    octant = blocks.of(0.5 * blocks.bounds[1] * units)
    return np.concatenate([np.bincount(octant, shell, minlength=8) for shell in cones.T / 3.0])
