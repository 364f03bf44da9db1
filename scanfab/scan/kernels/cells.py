"""
Grains sorted into the cells of a grid, so that a ray finds the next one in a few steps.

The grid divides the box of the grains or, where they repeat, their periods. Every grain stands in
all cells that it may reach into; one that reaches through a periodic face stands in those on the
other side, too, with the image by which it does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.jit import inner, kernel
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.kernels.strips import FAR

Int32Array = npt.NDArray[np.int32]

# what lets the compiler make vector instructions of a loop that looks for the least number
LEAST = {"nnan", "nsz", "contract"}

# of a cell: nearer to the grid than that a ray is in it, but for rounding
SLIGHT = 1e-9


class Cells(NamedTuple):
    """Grains by the cell of a grid."""

    sphere: FloatArray
    """
    Centre and radius of each entry, shape (4, K).

    Entries of a cell lie together, as to look up each grain elsewhere would take longer than all
    else.
    """
    removed: BoolArray
    """Of each entry, shape (K,)."""
    vectors: FloatArray
    """Rows: the edges of the whole grid; those along which grains repeat are the periods."""
    inverse: FloatArray
    corner: FloatArray
    periodic: BoolArray
    parts: IntArray
    """Cells along each edge, shape (3,)."""
    start: IntArray
    """First entry of each cell, and behind the last one, first edge fastest."""
    farthest: float
    """Rays that have met nothing so far stay in a channel; of periodic grains, a length."""
    farthest_kept: float
    """Likewise, of rays that meet no grain that is removed."""


@inner(inline="always")
def cell_of(parts: IntArray, i: int, j: int, k: int) -> int:
    """The number of a cell."""
    return int(i + parts[0] * (j + parts[1] * k))


@kernel
def fill_cells(
    low: Int32Array,
    high: Int32Array,
    periodic: BoolArray,
    parts: IntArray,
    start: IntArray,
    grain: Int32Array,
    image: Int32Array,
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


class Ray(NamedTuple):
    """A half line on its way through the cells; room for one, used again and again."""

    place: FloatArray
    """Where it begins, in the void, shape (3,); moved by periods as the ray crosses their faces."""
    along: FloatArray
    """Unit vector."""
    cell: IntArray
    """In which it is."""
    step: IntArray
    """1 or -1: to which side it leaves its cell, along each edge of the grid."""
    out: FloatArray
    """How far from its beginning it meets the next face, across each edge of the grid."""
    width: FloatArray
    """From one such face to the next."""


@inner()
def room_for_ray() -> Ray:
    """A ray to be filled in."""
    return Ray(
        np.empty(3),
        np.empty(3),
        np.empty(3, np.int64),
        np.empty(3, np.int64),
        np.empty(3),
        np.empty(3),
    )


# Of a ray: these functions are made part of their caller, as to count the references to all these
# arrays in a call would take longer than what it does.


@inner(forceinline=True, fastmath=LEAST, error_model="numpy")
def first_in_cell(cells: Cells, ray: Ray, number: int, without_removed: bool) -> float:
    """
    How far the first solid is of those that reach into a cell.

    As the ray begins in void, each of its chords is before or behind that; by its middle, as that
    of a solid that ends there may lie before it by rounding.
    """
    # no array is looked up in the loop
    sphere, removed, start = cells.sphere, cells.removed, cells.start
    p_x, p_y, p_z = ray.place[0], ray.place[1], ray.place[2]
    n_x, n_y, n_z = ray.along[0], ray.along[1], ray.along[2]
    found = FAR
    for entry in range(np.uint64(start[number]), np.uint64(start[number + 1])):
        x, y, z = sphere[0, entry] - p_x, sphere[1, entry] - p_y, sphere[2, entry] - p_z
        depth = x * n_x + y * n_y + z * n_z
        radius = sphere[3, entry]
        reach2 = radius * radius - (x * x + y * y + z * z - depth * depth)
        is_met = (depth > 0.0) & (reach2 > 0.0) & (not (without_removed & removed[entry]))
        # choices instead of branches, which would be guessed wrong
        distance = depth - np.sqrt(reach2 if reach2 > 0.0 else 0.0)
        distance = distance if is_met else FAR
        found = distance if distance < found else found
    return found


@inner(forceinline=True, error_model="numpy")
def to_grid(cells: Cells, ray: Ray) -> float:
    """
    How far from its beginning the ray is in the grid, which has no end where grains repeat, or FAR.

    Fills in where it begins, counted in cells, as ``out``, and what it rises as ``width``.
    """
    first = 0.0
    for i in range(3):
        at = rise = 0.0
        for j in range(3):
            at += (ray.place[j] - cells.corner[j]) * cells.inverse[j, i]
            rise += ray.along[j] * cells.inverse[j, i]
        parts = cells.parts[i]
        at, rise = at * parts, rise * parts
        ray.out[i], ray.width[i] = at, rise
        if not cells.periodic[i] and not 0.0 <= at <= parts:
            # else it only gets further away
            comes = rise > 0.0 if at < 0.0 else rise < 0.0
            first = max(first, ((0.0 if at < 0.0 else parts) - at) / rise if comes else FAR)
    for i in range(3):
        at = ray.out[i] + first * ray.width[i]
        if not cells.periodic[i] and not -SLIGHT <= at <= cells.parts[i] + SLIGHT:
            first = FAR
    return first


@inner(forceinline=True, error_model="numpy")
def begins_inside(cells: Cells, ray: Ray) -> bool:
    """Let the ray begin in its first cell; whether it has one."""
    first = to_grid(cells, ray)
    if first == FAR:
        return False
    for i in range(3):
        at, rise, parts = ray.out[i], ray.width[i], cells.parts[i]
        at += first * rise
        cell, period = np.floor(at), 0.0
        if cells.periodic[i]:
            period = np.floor(cell / parts)
            for j in range(3):
                ray.place[j] -= period * cells.vectors[i, j]
        else:
            cell = min(max(cell, 0.0), parts - 1.0)
        ray.cell[i] = int(cell) - int(period) * parts
        ray.step[i] = 1 if rise > 0.0 else -1
        ray.width[i] = 1.0 / abs(rise) if rise != 0.0 else FAR
        ray.out[i] = first + (cell + (rise > 0.0) - at) / rise if rise != 0.0 else FAR
    return True


@inner(forceinline=True, error_model="numpy")
def enters_next(cells: Cells, ray: Ray, through: int) -> bool:
    """Let the ray enter its next cell, through that pair of faces; whether it is in the grid."""
    step = ray.step[through]
    ray.out[through] += ray.width[through]
    ray.cell[through] += step
    if 0 <= ray.cell[through] < cells.parts[through]:
        return True
    ray.cell[through] -= step * cells.parts[through]
    for j in range(3):
        ray.place[j] -= step * cells.vectors[through, j]
    return bool(cells.periodic[through])


@inner(forceinline=True, error_model="numpy")
def next_solid(
    cells: Cells, ray: Ray, without_removed: bool, most_steps: float
) -> tuple[float, float]:
    """
    How far from its place in the void a ray meets the next solid; FAR if there is none.

    And the steps that this took: one for each cell and each grain in it.
    """
    found, steps = FAR, 0.0
    parts, out = cells.parts, ray.out
    farthest = cells.farthest_kept if without_removed else cells.farthest
    goes_on = begins_inside(cells, ray)
    while goes_on:
        number = cell_of(parts, ray.cell[0], ray.cell[1], ray.cell[2])
        here = first_in_cell(cells, ray, number, without_removed)
        found = here if here < found else found
        steps += 1.0 + cells.start[number + 1] - cells.start[number]
        through = 0 if out[0] < out[1] else 1
        through = through if out[through] < out[2] else 2
        nearest = out[through]
        # what is found behind the cell may have others before it
        goes_on = found > nearest and nearest <= farthest and steps <= most_steps
        goes_on = goes_on and enters_next(cells, ray, through)
    return found, steps
