"""Volumes of clumps: what several of their spheres share counts once."""

from __future__ import annotations

import numpy as np

from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.packing import Packing

__all__ = ["lens_volumes", "own_shares"]

# the volume of the unit ball
BALL = 4.0 / 3.0 * np.pi
# points in pairs of spheres of one clump, all together: a second or two
MOST_POINTS = 1 << 25
# of a sphere, where clumps are so many that their errors cancel
FEWEST_POINTS = 64
# pairs at a time, times their points: some tens of megabytes
CHUNK = 256


def own_shares(packing: Packing, points: FloatArray) -> FloatArray:
    """
    Of each sphere, the part of its volume that no sphere of the same clump before it covers.

    Parameters
    ----------
    packing : Packing
        Of spheres that are grains, or parts of clumps.
    points : ndarray, shape (P, 3)
        That fill the unit ball evenly, the first few as well as all.

    Returns
    -------
    ndarray, shape (N,)
        1 for spheres that are a grain of their own.
    """
    bodies, radius = packing.bodies, packing.radius
    if bodies is None:
        return np.ones(len(radius))
    position = -bodies.to_place(packing.position, packing.cell)
    one, two = _pairs(bodies.head)
    distance = np.linalg.norm(position[one] - position[two], axis=1)
    meet = distance < radius[one] + radius[two]
    one, two = one[meet], two[meet]
    number = int(np.clip(MOST_POINTS // max(len(one), 1), FEWEST_POINTS, len(points)))
    ball = points[np.linspace(0, len(points) - 1, number).astype(np.int64)]
    rows, row = np.unique(two, return_inverse=True)
    covered = np.zeros((len(rows), number), np.bool_)
    each = np.zeros(len(one))
    for first in range(0, len(one), CHUNK):
        part = slice(first, first + CHUNK)
        place = (position[two[part]] - position[one[part]])[:, None]
        place = place + radius[two[part], None, None] * ball
        inside = np.einsum("pqi,pqi->pq", place, place) < radius[one[part], None] ** 2
        np.logical_or.at(covered, row[part], inside)
        each[part] = inside.mean(axis=1)
    # the volume that two spheres share is known, points have to tell what three or more do
    apart = np.linalg.norm(position[two] - position[one], axis=1)
    known = lens_volumes(apart, radius[one], radius[two]) / (BALL * radius[two] ** 3) - each
    share = np.ones(len(radius))
    share[rows] -= covered.mean(axis=1) + np.bincount(row, known, len(rows))
    return share


def lens_volumes(apart: FloatArray, one: FloatArray, two: FloatArray | float) -> FloatArray:
    """
    Volumes that pairs of spheres share.

    Parameters
    ----------
    apart : ndarray, shape (K,)
        Distance of their centres, dump's length unit.
    one, two : ndarray, shape (K,), or float
        Their radii, dump's length unit.
    """
    smaller = BALL * np.minimum(one, two) ** 3
    is_inside = apart <= np.abs(two - one)
    distance = np.where(is_inside, 1.0, apart)
    deep = np.maximum(two + one - apart, 0.0)
    lens = np.pi * deep**2 / (12.0 * distance)
    lens *= distance**2 + 2.0 * distance * (one + two) - 3.0 * (one - two) ** 2
    return np.where(is_inside, smaller, lens)


def _pairs(head: IntArray) -> tuple[IntArray, IntArray]:
    """All pairs of spheres of one body, the earlier and the later row, shape (K,) each."""
    order = np.argsort(head, kind="stable")
    # the place of each sphere among those of its body
    starts = np.searchsorted(head[order], head[order], side="left")
    place = np.arange(len(order)) - starts
    later = np.repeat(np.arange(len(order)), place)
    earlier = np.arange(len(later)) - np.repeat(np.cumsum(place) - place, place) + starts[later]
    return order[earlier], order[later]
