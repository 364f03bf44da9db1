"""
The square grid of scan lines along one direction, and the strips that it is cut into.

In a plane, whose normal is the grid's v, it is one row at v = 0: its shift is one number, along u.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import inner
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.kernels.strips import Strip


class Grid(NamedTuple):
    """Lines at (first_u + column * spacing, first_v + row * spacing), low <= column < high."""

    spacing: float
    first_u: float
    first_v: float
    columns: int
    rows: int
    low: IntArray
    """Of each row, from 0."""
    high: IntArray
    """Of each row, up to ``columns``."""


@inner()
def cover(
    low_u: float, high_u: float, low_v: float, high_v: float, offset: FloatArray, spacing: float
) -> Grid:
    """The lines ((i + offset_u) * spacing, (j + offset_v) * spacing) that meet a rectangle."""
    column = int(np.ceil(low_u / spacing - offset[0]))
    columns = max(int(np.floor(high_u / spacing - offset[0])) - column + 1, 0)
    row, rows, offset_v = 0, 1, 0.0
    if offset.size > 1:
        offset_v = offset[1]
        row = int(np.ceil(low_v / spacing - offset_v))
        rows = max(int(np.floor(high_v / spacing - offset_v)) - row + 1, 0)
    low, high = np.empty(rows, np.int64), np.empty(rows, np.int64)
    for row_of in range(rows):
        low[row_of], high[row_of] = 0, columns
    return Grid(
        spacing,
        (column + offset[0]) * spacing,
        (row + offset_v) * spacing,
        columns,
        rows,
        low,
        high,
    )


@inner()
def limit_row(grid: Grid, row: int, low_u: float, high_u: float) -> None:
    """Leave the lines of a row from low_u to high_u."""
    low = int(np.ceil((low_u - grid.first_u) / grid.spacing))
    high = int(np.floor((high_u - grid.first_u) / grid.spacing)) + 1
    grid.low[row] = min(max(low, 0), grid.columns)
    grid.high[row] = max(min(high, grid.columns), grid.low[row])


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
    triad: FloatArray,
    offset: FloatArray,
    spacing: float,
    reach: float,
    whole: bool,
) -> Grid:
    """
    The lines that meet the window or, of the whole, any sphere.

    ``reach`` is the radius of the ball that holds the window; lines that meet the ball alone are
    there, too.
    """
    low_u = low_v = -reach
    high_u = high_v = reach
    if whole and extent.reach > 0.0:
        low_u, high_u = shadow(extent, triad[0], low_u, high_u)
        low_v, high_v = shadow(extent, triad[1], low_v, high_v)
    grid = cover(low_u, high_u, low_v, high_v, offset, spacing)
    if not whole:
        for row in range(grid.rows):
            v = grid.first_v + row * spacing
            # one more on either side, against rounding
            half = np.sqrt(max(reach * reach - v * v, 0.0)) + spacing
            limit_row(grid, row, -half, half)
    return grid


@inner()
def sheared_grid(
    low_u: float,
    high_u: float,
    low_v: float,
    high_v: float,
    skew: float,
    offset: FloatArray,
    spacing: float,
) -> Grid:
    """The lines in a parallelogram: those in v, and in u - skew * v."""
    aside_u, aside_v = skew * low_v, skew * high_v
    grid = cover(
        low_u + min(aside_u, aside_v),
        high_u + max(aside_u, aside_v),
        low_v,
        high_v,
        offset,
        spacing,
    )
    for row in range(grid.rows):
        aside = skew * (grid.first_v + row * spacing)
        limit_row(grid, row, low_u + aside, high_u + aside)
    return grid


@inner()
def part_of(grid: Grid, first: int, most: int) -> Grid:
    """So many columns of a grid at most, from the first one wanted."""
    columns = min(most, grid.columns - first)
    low, high = np.empty(grid.rows, np.int64), np.empty(grid.rows, np.int64)
    for row in range(grid.rows):
        low[row] = min(max(grid.low[row] - first, 0), columns)
        high[row] = min(max(grid.high[row] - first, 0), columns)
    return Grid(
        grid.spacing,
        grid.first_u + first * grid.spacing,
        grid.first_v,
        columns,
        grid.rows,
        low,
        high,
    )


@inner()
def strip_of(grid: Grid, number: int, rows: int, pitch: int) -> Strip:
    """One of the strips of a grid that have so many rows each."""
    row = number * rows
    return Strip(
        grid.spacing,
        1.0 / grid.spacing,
        grid.first_u,
        grid.first_v + row * grid.spacing,
        grid.columns,
        min(rows, grid.rows - row),
        pitch,
        grid.low[row : row + rows],
        grid.high[row : row + rows],
    )
