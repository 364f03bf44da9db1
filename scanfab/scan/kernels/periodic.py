"""
Scan lines through a periodic medium, whose period is the cell.

The lines of a direction n start on a face of the cell, spread evenly over it, and run to the
opposite face: face and direction span a prism that fills space as the cell does. A gap counts if it
starts in the prism, and is followed to its end through the images. The face is the one that n
crosses most steeply; along an axis that is not periodic the lines run from the first solid to the
last, and a face is as large as the grains need.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import ZERO, inner, part
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.scan.kernels.grid import CellGrains, Spheres, in_order, room_to_project, sheared_grid
from scanfab.scan.kernels.strips import FAR, Measured, Section, Strip, dot

# solids are listed up to so many mean radii beyond the prism; longer gaps are followed one by one
BEYOND = 16.0


class Prism(NamedTuple):
    """
    The lines' prism in the triad u, v, n, with the edges (base_u, 0) and (skew_u, base_v).

    Its length along n is ``length``. A point has the height (n - rise_u * u - rise_v * v) / length,
    which is 0 to 1 in the prism.
    """

    triad: FloatArray
    first: int
    """Number of the cell's edge (base_u, 0); then the face's other edge, and the third edge."""
    second: int
    third: int
    base_u: float
    skew_u: float
    base_v: float
    rise_u: float
    rise_v: float
    length: float
    slope: float
    """Largest change of the height over a length of 1."""
    endless: bool
    """Whether lines have no end, because all edges are periodic (in a plane its two edges)."""


@part()
def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector product."""
    found = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        found[i] = a[j] * b[k] - a[k] * b[j]
    return found


@part()
def prism_along(
    normal: FloatArray, vectors: FloatArray, periodic: BoolArray, in_plane: bool
) -> Prism:
    """The prism of the lines along a direction."""
    third, steepest = 0, -1.0
    for k in range(3):
        face = cross(vectors[(k + 1) % 3], vectors[(k + 2) % 3])
        steepness = abs(dot(face, normal)) / np.sqrt(dot(face, face))
        if steepness > steepest:
            third, steepest = k, steepness
    first, second = (third + 1) % 3, (third + 2) % 3
    if (periodic[second] and not periodic[first]) or (in_plane and first == 2):
        first, second = second, first
    a, b, c = vectors[first], vectors[second], vectors[third]
    triad = np.empty((3, 3))
    triad[2] = normal
    triad[0] = a - dot(a, normal) * normal
    base_u = np.sqrt(dot(triad[0], triad[0]))
    triad[0] /= base_u
    triad[1] = cross(normal, triad[0])
    if dot(b, triad[1]) < 0.0:
        triad[1] = -triad[1]
    skew_u, base_v = dot(b, triad[0]), dot(b, triad[1])
    rise_u = dot(a, normal) / base_u
    rise_v = (dot(b, normal) - rise_u * skew_u) / base_v
    length = abs(dot(c, normal) - rise_u * dot(c, triad[0]) - rise_v * dot(c, triad[1]))
    slope = np.sqrt(1.0 + rise_u * rise_u + rise_v * rise_v) / length
    endless = periodic[0] and periodic[1] and (periodic[2] or in_plane)
    return Prism(
        triad, first, second, third, base_u, skew_u, base_v, rise_u, rise_v, length, slope, endless
    )


@inner(error_model="numpy")
def shifts(
    repeats: bool, position: float, reach: float, low: float, high: float, step: float
) -> tuple[int, int]:
    """The range of whole k with position + k * step within reach of low to high; only 0 if none."""
    if not repeats:
        return 0, 1
    per_step = 1.0 / step
    return (
        int(np.ceil((low - reach - position) * per_step)),
        int(np.floor((high + reach - position) * per_step)) + 1,
    )


@inner(error_model="numpy")
def fill_images(
    grains: CellGrains, prism: Prism, beyond: float, extent: FloatArray, spheres: Spheres
) -> int:
    """
    Fill in the images of grains that may meet a line of the prism, as far as there is room.

    Returns the number of all these images. ``extent``, the smallest and largest v and the smallest
    and largest u along the skew, becomes the bounds of the face along axes that are not periodic.
    """
    # no array is handed on in the loop: to count its references would take longer than all else
    triad, position = prism.triad, grains.position
    u_x, u_y, u_z = triad[0, 0], triad[0, 1], triad[0, 2]
    v_x, v_y, v_z = triad[1, 0], triad[1, 1], triad[1, 2]
    n_x, n_y, n_z = triad[2, 0], triad[2, 1], triad[2, 2]
    layers = grains.periodic[prism.third]
    rows, columns = grains.periodic[prism.second], grains.periodic[prism.first]
    a, b = grains.vectors[prism.first], grains.vectors[prism.second]
    c = grains.vectors[prism.third]
    along_a, along_b = dot(a, triad[2]), dot(b, triad[2])
    c_u, c_v, c_n = dot(c, triad[0]), dot(c, triad[1]), dot(c, triad[2])
    step = 1.0 if c_n - prism.rise_u * c_u - prism.rise_v * c_v > 0.0 else -1.0
    skew = prism.skew_u / prism.base_v
    wide = np.sqrt(1.0 + skew * skew)
    room = spheres.u.size
    count = 0
    low_v, high_v, low_u, high_u = extent[0], extent[1], extent[2], extent[3]
    for g in range(np.uint64(grains.radius.size)):
        x, y, z, r = position[g, 0], position[g, 1], position[g, 2], grains.radius[g]
        u0, v0 = u_x * x + u_y * y + u_z * z, v_x * x + v_y * y + v_z * z
        n0 = n_x * x + n_y * y + n_z * z
        height = (n0 - prism.rise_u * u0 - prism.rise_v * v0) / prism.length
        layer = shifts(layers, height, r * prism.slope, 0.0, 1.0 + beyond, 1.0)
        for i in range(layer[0], layer[1]):
            k = i * step
            u1, v1, n1 = u0 + k * c_u, v0 + k * c_v, n0 + k * c_n
            over = shifts(rows, v1, r, 0.0, prism.base_v, prism.base_v)
            for j in range(over[0], over[1]):
                u2, v2, n2 = u1 + j * prism.skew_u, v1 + j * prism.base_v, n1 + j * along_b
                aside = u2 - skew * v2
                low_v, high_v = min(low_v, v2 - r), max(high_v, v2 + r)
                low_u, high_u = min(low_u, aside - r * wide), max(high_u, aside + r * wide)
                across = shifts(columns, aside, r * wide, 0.0, prism.base_u, prism.base_u)
                for q in range(across[0], across[1]):
                    if count < room:
                        spheres.u[count] = u2 + q * prism.base_u
                        spheres.v[count] = v2
                        spheres.depth[count] = n2 + q * along_a
                        spheres.radius[count] = r
                        spheres.removed[count] = grains.removed[g]
                    count += 1
    extent[0], extent[1], extent[2], extent[3] = low_v, high_v, low_u, high_u
    return count


@part()
def cell_grid(
    grains: CellGrains, normal: FloatArray, offset: FloatArray, spacing: float
) -> tuple[Prism, Spheres, Strip, Measured]:
    """The lines along a direction through a periodic medium, and the images that they may meet."""
    prism = prism_along(normal, grains.vectors, grains.periodic, offset.size == 1)
    mean = grains.radius.mean()
    beyond = BEYOND * mean / prism.length
    # smallest and largest v, smallest and largest u along the skew
    extent = np.array([np.inf, -np.inf, np.inf, -np.inf])
    # a good estimate for small grains; if it is too low, the second round has enough room
    shell = 1.0 + beyond + 2.0 * mean * prism.slope
    shell *= (1.0 + 2.0 * mean / prism.base_u) * (1.0 + 2.0 * mean / prism.base_v)
    room, count = 0, int(1.1 * shell * grains.radius.size)
    images = room_to_project(ZERO)
    while room < count:
        room = count
        images = room_to_project(room)
        count = fill_images(grains, prism, beyond, extent, images.found)
    if grains.periodic[prism.second]:
        extent[0], extent[1] = 0.0, prism.base_v
    if grains.periodic[prism.first]:
        extent[2], extent[3] = 0.0, prism.base_u
    skew = prism.skew_u / prism.base_v
    grid = sheared_grid(extent[2], extent[3], extent[0], extent[1], skew, offset, spacing)
    measured = Measured(prism.length, prism.length + BEYOND * mean)
    if not grains.periodic[prism.third]:
        # lines without a measured length run from the first solid to the last
        measured = Measured(FAR, FAR)
    return prism, in_order(images, count), grid, measured


@part()
def foot_of(prism: Prism, measured: Measured) -> Section:
    """
    The plane through the origin on which the measured length of each line begins.

    Lines without an end begin far before it.
    """
    level = measured.length if measured.length == FAR else 0.0
    return Section(np.empty((0, 4)), level, 0.0, 0.0, 0.0, prism.rise_u, prism.rise_v)
