"""
Grains sorted into the cells of a grid, so that a ray finds the next one in a few steps.

The grid divides the box of the grains or, where they repeat, their periods. Every grain stands in
all cells that it may reach into; one that reaches through a periodic face stands in those on the
other side, too, with the image by which it does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import inner, kernel
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.strips import FAR

__all__ = ["Cells", "fill_cells", "next_solid"]


class Cells(NamedTuple):
    """Grains by the cell of a grid; its first cell begins at the origin that positions have."""

    position: FloatArray
    """Of the grains, shape (N, 3)."""
    radius: FloatArray
    removed: BoolArray
    vectors: FloatArray
    """Rows: the edges of the whole grid; those along which grains repeat are the periods."""
    inverse: FloatArray
    corner: FloatArray
    periodic: BoolArray
    parts: IntArray
    """Cells along each edge, shape (3,)."""
    start: IntArray
    """First entry of each cell, and behind the last one, first edge fastest."""
    grain: IntArray
    """Of each entry its row, shape (K,)."""
    image: IntArray
    """The periods by which its image in that cell lies behind it, shape (K, 3)."""
    farthest: float
    """Rays that have met nothing so far stay in a channel; of periodic grains, a length."""


@inner(inline="always")
def cell_of(parts: IntArray, i: int, j: int, k: int) -> int:
    """The number of a cell."""
    return int(i + parts[0] * (j + parts[1] * k))


@kernel
def fill_cells(
    low: IntArray,
    high: IntArray,
    periodic: BoolArray,
    parts: IntArray,
    start: IntArray,
    grain: IntArray,
    image: IntArray,
) -> None:
    """
    Count what each cell holds or, if there is room for it, list it.

    ``low`` and ``high`` are the first and last cells that each grain reaches, shape (N, 3), beyond
    the periods, too. ``start`` counts, shape (cells + 1,), or tells where the next entry goes.
    """
    counts = grain.size == 0
    for g in range(low.shape[0]):
        for k in range(low[g, 2], high[g, 2] + 1):
            for j in range(low[g, 1], high[g, 1] + 1):
                for i in range(low[g, 0], high[g, 0] + 1):
                    cell = cell_of(parts, i % parts[0], j % parts[1], k % parts[2])
                    if counts:
                        start[cell + 1] += 1
                        continue
                    entry = start[cell]
                    grain[entry] = g
                    image[entry, 0] = -(i // parts[0])
                    image[entry, 1] = -(j // parts[1])
                    image[entry, 2] = -(k // parts[2])
                    start[cell] += 1


@inner(error_model="numpy")
def next_solid(
    cells: Cells, place: FloatArray, along: FloatArray, without_removed: bool, most_steps: float
) -> tuple[float, float]:
    """
    How far from a place in the void the next solid is along a unit vector; FAR if there is none.

    And the steps that this took: one for each cell and each grain in it.

    As the place lies in void, each chord of the ray is before or behind it; by its middle, as that
    of a solid that ends there may lie before it by rounding.
    """
    at, rise = np.empty(3), np.empty(3)
    cell, turn = np.empty(3, np.int64), np.empty(3, np.int64)
    found, steps = FAR, 0.0
    for i in range(3):
        at[i] = rise[i] = 0.0
        for j in range(3):
            at[i] += (place[j] - cells.corner[j]) * cells.inverse[j, i] * cells.parts[i]
            rise[i] += along[j] * cells.inverse[j, i] * cells.parts[i]
        cell[i] = int(np.floor(at[i]))
        if not cells.periodic[i] and (cell[i] < 0 or cell[i] >= cells.parts[i]):
            return FAR, steps
    while True:
        for i in range(3):
            turn[i] = cell[i] // cells.parts[i]
        number = cell_of(
            cells.parts,
            cell[0] - turn[0] * cells.parts[0],
            cell[1] - turn[1] * cells.parts[1],
            cell[2] - turn[2] * cells.parts[2],
        )
        for entry in range(cells.start[number], cells.start[number + 1]):
            g = cells.grain[entry]
            if without_removed and cells.removed[g]:
                continue
            depth = across2 = 0.0
            for j in range(3):
                to = cells.position[g, j] - place[j]
                for i in range(3):
                    to += (turn[i] + cells.image[entry, i]) * cells.vectors[i, j]
                depth += to * along[j]
                across2 += to * to
            reach2 = cells.radius[g] * cells.radius[g] - (across2 - depth * depth)
            if depth > 0.0 and reach2 > 0.0:
                found = min(found, depth - np.sqrt(reach2))
        steps += 1.0 + cells.start[number + 1] - cells.start[number]
        # where the ray leaves the cell, and through which face
        leaves, through = FAR, 0
        for i in range(3):
            if rise[i] != 0.0:
                face = (cell[i] + (1 if rise[i] > 0.0 else 0) - at[i]) / rise[i]
                if face < leaves:
                    leaves, through = face, i
        if found <= leaves or leaves > cells.farthest or steps > most_steps:
            return found, steps
        cell[through] += 1 if rise[through] > 0.0 else -1
        outside = cell[through] < 0 or cell[through] >= cells.parts[through]
        if outside and not cells.periodic[through]:
            return found, steps
