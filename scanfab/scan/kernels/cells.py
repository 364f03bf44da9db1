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

__all__ = ["Cells", "Ray", "fill_cells", "next_solid", "room_for_ray"]


class Cells(NamedTuple):
    """Grains by the cell of a grid."""

    sphere: FloatArray
    """
    Centre and radius of each entry, shape (K, 4).

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


class Ray(NamedTuple):
    """A half line on its way through the cells; room for one, used again and again."""

    place: FloatArray
    """Where it begins, in the void, shape (3,)."""
    along: FloatArray
    """Unit vector."""
    at: FloatArray
    """Where it begins, counted in cells."""
    rise: FloatArray
    """Cells along each edge of the grid for a length of 1."""
    cell: IntArray
    """In which it is, counted through the periods."""


@inner()
def room_for_ray() -> Ray:
    """A ray to be filled in."""
    return Ray(np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3, np.int64))


@inner(error_model="numpy")
def first_in_cell(cells: Cells, ray: Ray, without_removed: bool) -> tuple[float, int]:
    """
    How far the first solid is of those that reach into the ray's cell, and how many these are.

    As the ray begins in void, each of its chords is before or behind that; by its middle, as that
    of a solid that ends there may lie before it by rounding.
    """
    # no array is looked up in the loop
    parts, vectors, sphere, removed = cells.parts, cells.vectors, cells.sphere, cells.removed
    i, j, k = ray.cell[0] // parts[0], ray.cell[1] // parts[1], ray.cell[2] // parts[2]
    number = cell_of(
        parts,
        ray.cell[0] - i * parts[0],
        ray.cell[1] - j * parts[1],
        ray.cell[2] - k * parts[2],
    )
    first, last = np.uint64(cells.start[number]), np.uint64(cells.start[number + 1])
    # the ray's place, moved to the first period
    p_x = ray.place[0] - i * vectors[0, 0] - j * vectors[1, 0] - k * vectors[2, 0]
    p_y = ray.place[1] - i * vectors[0, 1] - j * vectors[1, 1] - k * vectors[2, 1]
    p_z = ray.place[2] - i * vectors[0, 2] - j * vectors[1, 2] - k * vectors[2, 2]
    n_x, n_y, n_z = ray.along[0], ray.along[1], ray.along[2]
    found = FAR
    for entry in range(first, last):
        if without_removed and removed[entry]:
            continue
        x, y, z = sphere[entry, 0] - p_x, sphere[entry, 1] - p_y, sphere[entry, 2] - p_z
        depth = x * n_x + y * n_y + z * n_z
        radius = sphere[entry, 3]
        reach2 = radius * radius - (x * x + y * y + z * z - depth * depth)
        if depth > 0.0 and reach2 > 0.0:
            found = min(found, depth - np.sqrt(reach2))
    return found, int(last - first)


@inner(error_model="numpy")
def way_out(ray: Ray) -> tuple[float, int]:
    """How far the ray's way out of its cell is, and through which pair of faces it leads."""
    nearest, through = FAR, 0
    for i in range(3):
        rise = ray.rise[i]
        if rise != 0.0:
            face = (ray.cell[i] + (1 if rise > 0.0 else 0) - ray.at[i]) / rise
            if face < nearest:
                nearest, through = face, i
    return nearest, through


@inner(error_model="numpy")
def begins_inside(cells: Cells, ray: Ray) -> bool:
    """Let the ray begin; whether that is in the grid, which has no end where grains repeat."""
    inside = True
    for i in range(3):
        at = rise = 0.0
        for j in range(3):
            at += (ray.place[j] - cells.corner[j]) * cells.inverse[j, i]
            rise += ray.along[j] * cells.inverse[j, i]
        ray.at[i], ray.rise[i] = at * cells.parts[i], rise * cells.parts[i]
        ray.cell[i] = int(np.floor(ray.at[i]))
        inside &= cells.periodic[i] or 0 <= ray.cell[i] < cells.parts[i]
    return inside


@inner(error_model="numpy")
def next_solid(
    cells: Cells, ray: Ray, without_removed: bool, most_steps: float
) -> tuple[float, float]:
    """
    How far from its place in the void a ray meets the next solid; FAR if there is none.

    And the steps that this took: one for each cell and each grain in it.
    """
    found, steps = FAR, 0.0
    goes_on = begins_inside(cells, ray)
    while goes_on:
        here, grains = first_in_cell(cells, ray, without_removed)
        found = min(found, here)
        steps += 1.0 + grains
        out, through = way_out(ray)
        # what is found behind the cell may have others before it
        goes_on = found > out and out <= cells.farthest and steps <= most_steps
        ray.cell[through] += 1 if ray.rise[through] > 0.0 else -1
        inside = 0 <= ray.cell[through] < cells.parts[through]
        goes_on &= cells.periodic[through] or inside
    return found, steps
