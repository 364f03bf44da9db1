"""Pairs of overlapping spheres, by a cell list, in time linear in the number of spheres."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@njit(nogil=True, cache=True)
def bin_spheres(
    position: FloatArray, low: FloatArray, edge: float, shape: IntArray
) -> tuple[IntArray, IntArray]:
    """
    Sort spheres into cubic bins.

    Returns the start of each bin in ``order`` (one entry more than there are bins) and the
    sphere indices ordered by bin.
    """
    count = position.shape[0]
    bins = np.empty(count, np.int64)
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for i in range(count):
        x = min(int((position[i, 0] - low[0]) / edge), shape[0] - 1)
        y = min(int((position[i, 1] - low[1]) / edge), shape[1] - 1)
        z = min(int((position[i, 2] - low[2]) / edge), shape[2] - 1)
        bins[i] = (x * shape[1] + y) * shape[2] + z
        start[bins[i] + 1] += 1
    start = np.cumsum(start)
    filled = start.copy()
    order = np.empty(count, np.int64)
    for i in range(count):
        order[filled[bins[i]]] = i
        filled[bins[i]] += 1
    return start, order


@njit(nogil=True, cache=True)
def overlapping_pairs(
    position: FloatArray,
    radius: FloatArray,
    scale: float,
    owners: int,
    low: FloatArray,
    edge: float,
    shape: IntArray,
    pairs: IntArray,
) -> int:
    """
    Find pairs (i, j), i < j and i < owners, whose distance is below (r_i + r_j) * scale.

    ``edge`` must not be below the largest such distance. Pairs go into ``pairs`` (shape (M, 2))
    as long as it has room; the return value is the number of pairs that exist.
    """
    start, order = bin_spheres(position, low, edge, shape)
    found = 0
    for i in range(owners):
        x = min(int((position[i, 0] - low[0]) / edge), shape[0] - 1)
        y = min(int((position[i, 1] - low[1]) / edge), shape[1] - 1)
        z = min(int((position[i, 2] - low[2]) / edge), shape[2] - 1)
        for bx in range(max(x - 1, 0), min(x + 2, shape[0])):
            for by in range(max(y - 1, 0), min(y + 2, shape[1])):
                row = (bx * shape[1] + by) * shape[2]
                # bins along z are neighbours in memory: one run of candidates
                first = start[row + max(z - 1, 0)]
                last = start[row + min(z + 2, shape[2])]
                for k in range(first, last):
                    j = order[k]
                    if j <= i:
                        continue
                    reach = (radius[i] + radius[j]) * scale
                    distance = (
                        (position[i, 0] - position[j, 0]) ** 2
                        + (position[i, 1] - position[j, 1]) ** 2
                        + (position[i, 2] - position[j, 2]) ** 2
                    )
                    if distance < reach * reach:
                        if found < pairs.shape[0]:
                            pairs[found, 0] = i
                            pairs[found, 1] = j
                        found += 1
    return found


__all__ = ["bin_spheres", "overlapping_pairs"]
