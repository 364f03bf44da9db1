"""The search for pairs of near spheres, in time linear in the number of spheres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.jit import inner, kernel
from scanfab.base.typing import BoolArray, FloatArray, IntArray

PairArray = npt.NDArray[np.int32]


class Grid(NamedTuple):
    """Spheres in the order of the bins of a box; a sphere outside belongs to an outermost bin."""

    spheres: FloatArray
    """Shape (N, 4): centre and radius."""
    row: PairArray
    """Shape (N,): which sphere of the packing each one is."""
    start: IntArray
    """Shape (bins + 1,): where each bin starts. Bins along z follow one another."""
    shape: IntArray
    """Shape (3,): number of bins along x, y and z."""
    low: FloatArray
    """Shape (3,): corner of the box."""
    width: FloatArray
    """Shape (3,): edges of a bin, longer than two spheres of the grid in contact are apart."""


@inner()
def _bin(grid: Grid, sphere: FloatArray, axis: int) -> int:
    place = (sphere[axis] - grid.low[axis]) / grid.width[axis]
    number: int = int(min(max(place, 0.0), grid.shape[axis] - 1.0))
    return number


@kernel
def find_pairs(
    grid: Grid,
    other: Grid,
    own: bool,
    is_real: BoolArray,
    scale: float,
    most: int,
    pairs: PairArray,
    found: int,
) -> int:
    """
    Add the pairs whose distance is below (r_i + r_j) * scale; how many there are then.

    One sphere is of a grid, the second of its own grid or of another one with larger spheres, whose
    bins around the first sphere hold all that can be near. Only pairs whose smaller row is real
    count, others are periodic images of these. Pairs that find no room in ``pairs``, shape (M, 2),
    are counted only, and the search ends once there are more than ``most``.
    """
    shape, b = other.shape, other.spheres
    for i in range(len(grid.row)):
        if found > most:
            return found
        a, one = grid.spheres[i], grid.row[i]
        x, y, z = _bin(other, a, 0), _bin(other, a, 1), _bin(other, a, 2)
        low, high = max(z - 1, 0), min(z + 2, shape[2])
        for bx in range(max(x - 1, 0), min(x + 2, shape[0])):
            for by in range(max(y - 1, 0), min(y + 2, shape[1])):
                column = (bx * shape[1] + by) * shape[2]
                first = other.start[column + low]
                # in its own grid a sphere meets those that come behind it
                for j in range(max(first, i + 1) if own else first, other.start[column + high]):
                    dx, dy, dz = b[j, 0] - a[0], b[j, 1] - a[1], b[j, 2] - a[2]
                    reach = (a[3] + b[j, 3]) * scale
                    if dx * dx + dy * dy + dz * dz < reach * reach:
                        two = other.row[j]
                        if is_real[min(one, two)]:
                            if found < len(pairs):
                                pairs[found, 0], pairs[found, 1] = min(one, two), max(one, two)
                            found += 1
    return found
