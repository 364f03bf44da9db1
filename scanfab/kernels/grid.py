"""The square grid of scan lines along one direction, and the strips that it is cut into."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import inner
from scanfab.kernels.sweep import Strip

__all__ = ["Grid", "bounds", "columns_in", "cover", "open_grid", "part_of", "strip_of"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Grid(NamedTuple):
    """Lines at (first_u + row * shear + column * spacing, first_v + row * spacing)."""

    spacing: float
    first_u: float
    first_v: float
    shear: float
    columns: int
    rows: int


@inner()
def cover(
    low_u: float, high_u: float, low_v: float, high_v: float, offset: FloatArray, spacing: float
) -> Grid:
    """The lines ((i + offset_u) * spacing, (j + offset_v) * spacing) that meet a rectangle."""
    column = int(np.ceil(low_u / spacing - offset[0]))
    row = int(np.ceil(low_v / spacing - offset[1]))
    columns = int(np.floor(high_u / spacing - offset[0])) - column + 1
    rows = int(np.floor(high_v / spacing - offset[1])) - row + 1
    return Grid(
        spacing,
        (column + offset[0]) * spacing,
        (row + offset[1]) * spacing,
        0.0,
        max(columns, 0),
        max(rows, 0),
    )


class Bounds(NamedTuple):
    """A box and a sphere about the origin that hold all spheres."""

    centre: FloatArray
    half: FloatArray
    reach: float


@inner()
def bounds(position: FloatArray, radius: FloatArray) -> Bounds:
    """What holds all spheres."""
    low, high = np.empty(3), np.empty(3)
    low[:], high[:] = np.inf, -np.inf
    reach = 0.0
    for k in range(radius.size):
        distance2 = 0.0
        for i in range(3):
            x = position[k, i]
            distance2 += x * x
            low[i], high[i] = min(low[i], x - radius[k]), max(high[i], x + radius[k])
        reach = max(reach, np.sqrt(distance2) + radius[k])
    for i in range(3):
        low[i], high[i] = 0.5 * (low[i] + high[i]), 0.5 * (high[i] - low[i])
    return Bounds(low, high, reach)


@inner()
def shadow(extent: Bounds, side: FloatArray, low: float, high: float) -> tuple[float, float]:
    """Where the spheres may be along a side of the grid, and at least from low to high."""
    middle = half = 0.0
    for i in range(3):
        middle += extent.centre[i] * side[i]
        half += extent.half[i] * abs(side[i])
    return (
        min(low, max(middle - half, -extent.reach)),
        max(high, min(middle + half, extent.reach)),
    )


@inner()
def open_grid(
    extent: Bounds,
    frame: FloatArray,
    offset: FloatArray,
    spacing: float,
    window_radius: float,
    whole: bool,
) -> Grid:
    """The lines that meet the sphere window or, of the whole, any sphere."""
    low_u = low_v = -window_radius
    high_u = high_v = window_radius
    if whole and extent.reach > 0.0:
        low_u, high_u = shadow(extent, frame[0], low_u, high_u)
        low_v, high_v = shadow(extent, frame[1], low_v, high_v)
    return cover(low_u, high_u, low_v, high_v, offset, spacing)


@inner()
def part_of(grid: Grid, first: int, most: int) -> Grid:
    """So many columns of a grid at most, from the first one wanted."""
    return Grid(
        grid.spacing,
        grid.first_u + first * grid.spacing,
        grid.first_v,
        grid.shear,
        min(most, grid.columns - first),
        grid.rows,
    )


@inner()
def columns_in(grid: Grid, window_radius: float) -> tuple[IntArray, IntArray]:
    """
    Of each row the range of columns that may meet the sphere window; all if its radius is 0.

    One more on either side, against rounding.
    """
    low, high = np.empty(grid.rows, np.int64), np.empty(grid.rows, np.int64)
    for row in range(grid.rows):
        low[row], high[row] = 0, grid.columns
        if window_radius > 0.0:
            v = grid.first_v + row * grid.spacing
            half = np.sqrt(max(window_radius * window_radius - v * v, 0.0))
            first_u = grid.first_u + row * grid.shear
            low[row] = max(int(np.ceil((-half - first_u) / grid.spacing)) - 1, 0)
            high[row] = min(int(np.floor((half - first_u) / grid.spacing)) + 2, grid.columns)
    return low, high


@inner()
def strip_of(
    grid: Grid, low: IntArray, high: IntArray, number: int, rows: int, pitch: int
) -> Strip:
    """One of the strips of a grid that have so many rows each; ``low`` and ``high`` of all rows."""
    row = number * rows
    return Strip(
        grid.spacing,
        1.0 / grid.spacing,
        grid.first_u + row * grid.shear,
        grid.first_v + row * grid.spacing,
        grid.shear,
        grid.columns,
        min(rows, grid.rows - row),
        pitch,
        low[row : row + rows],
        high[row : row + rows],
    )
