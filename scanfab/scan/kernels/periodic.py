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
from scanfab.scan.kernels.grid import CellGrains, Spheres, cover, in_order, room_to_project
from scanfab.scan.kernels.strips import FAR, Measured, Section, Strip

# solids are listed up to so many mean radii beyond the prism; longer gaps are followed one by one
BEYOND = 16.0


class Prism(NamedTuple):
    """The lines' prism in the triad u, v, n; for several axes, each array has one more axis."""

    edges: FloatArray
    """Rows: both edges of the face, of which the first has no v, and the edge along the lines."""
    repeats: BoolArray
    """Which of these edges are periods."""
    climb: FloatArray
    """The height of a point, which is 0 to 1 in the prism, is its scalar product with this."""


def prism_along(
    triads: FloatArray, grains: CellGrains, in_plane: bool
) -> tuple[FloatArray, Section, Prism]:
    """
    The prisms of the lines along the third row of each triad, shape (D, 3, 3), in new triads.

    The section is the plane through the origin on which the measured length of each line begins.
    Lines without an end begin far before it.
    """
    n, vectors, periodic = triads[:, 2], grains.vectors, grains.periodic
    across = np.linalg.inv(vectors)
    steepness = np.abs(np.einsum("di,ik->dk", n, across)) / np.linalg.norm(across, axis=0)
    third = np.argmax(steepness, axis=1)
    first, second = (third + 1) % 3, (third + 2) % 3
    swaps = (periodic[second] & ~periodic[first]) | (in_plane & (first == 2))
    order = np.array([np.where(swaps, second, first), np.where(swaps, first, second), third]).T
    # of one layout for one axis and for several, so that Numba compiles a kernel once for both
    edges, repeats = vectors[order], periodic[order].copy()
    u = edges[:, 0] - np.einsum("di,di->d", edges[:, 0], n)[:, None] * n
    u /= np.sqrt(np.einsum("di,di->d", u, u))[:, None]
    v = edges[:, 1] - np.einsum("di,di->d", edges[:, 1], n)[:, None] * n
    v -= np.einsum("di,di->d", v, u)[:, None] * u
    v /= np.sqrt(np.einsum("di,di->d", v, v))[:, None]
    turned = np.stack([u, v, n], axis=1)
    edges = np.einsum("dki,dji->dkj", edges, turned)
    a, b, c = edges[:, 0].T, edges[:, 1].T, edges[:, 2].T
    rise_u = a[2] / a[0]
    rise_v = (b[2] - rise_u * b[0]) / b[1]
    length = c[2] - rise_u * c[0] - rise_v * c[1]
    c *= np.sign(length)
    foot, climb = np.zeros((len(n), 6)), np.ones((len(n), 3))
    foot[:, 0], foot[:, 4], foot[:, 5] = np.where(repeats[:, 2], 0.0, FAR), rise_u, rise_v
    climb[:, :2] = -foot[:, 4:]
    climb /= np.abs(length)[:, None]
    return turned, Section(np.zeros((len(n), 0, 4)), foot, np.inf), Prism(edges, repeats, climb)


@inner(error_model="numpy")
def shifts(
    repeats: bool, position: float, reach: float, high: float, step: float
) -> tuple[int, int]:
    """The range of whole k with position + k * step within reach of 0 to high; only 0 if none."""
    if not repeats:
        return 0, 1
    per_step = 1.0 / step
    return (
        int(np.ceil((-reach - position) * per_step)),
        int(np.floor((high + reach - position) * per_step)) + 1,
    )


@inner(error_model="numpy")
def fill_images(
    grains: CellGrains,
    triad: FloatArray,
    prism: Prism,
    beyond: float,
    extent: FloatArray,
    spheres: Spheres,
) -> int:
    """
    Fill in the images of grains that may meet a line of the prism, as far as there is room.

    Returns the number of all these images. ``extent``, the smallest and largest u along the skew
    and the smallest and largest v, becomes the bounds of the face along axes that are not periodic.
    """
    # no array is handed on in the loop: to count its references would take longer than all else
    position, edges, climb = grains.position, prism.edges, prism.climb
    u_x, u_y, u_z = triad[0, 0], triad[0, 1], triad[0, 2]
    v_x, v_y, v_z = triad[1, 0], triad[1, 1], triad[1, 2]
    n_x, n_y, n_z = triad[2, 0], triad[2, 1], triad[2, 2]
    columns, rows, layers = prism.repeats[0], prism.repeats[1], prism.repeats[2]
    a_u, a_n = edges[0, 0], edges[0, 2]
    b_u, b_v, b_n = edges[1, 0], edges[1, 1], edges[1, 2]
    c_u, c_v, c_n = edges[2, 0], edges[2, 1], edges[2, 2]
    by_u, by_v, by_n = climb[0], climb[1], climb[2]
    skew, slope = b_u / b_v, np.sqrt(by_u * by_u + by_v * by_v + by_n * by_n)
    wide = np.sqrt(1.0 + skew * skew)
    room = spheres.u.size
    count = 0
    low_u, high_u, low_v, high_v = extent[0], extent[1], extent[2], extent[3]
    for g in range(np.uint64(grains.radius.size)):
        x, y, z, r = position[g, 0], position[g, 1], position[g, 2], grains.radius[g]
        u0, v0 = u_x * x + u_y * y + u_z * z, v_x * x + v_y * y + v_z * z
        n0 = n_x * x + n_y * y + n_z * z
        height = by_u * u0 + by_v * v0 + by_n * n0
        layer = shifts(layers, height, r * slope, 1.0 + beyond, 1.0)
        for i in range(layer[0], layer[1]):
            u1, v1, n1 = u0 + i * c_u, v0 + i * c_v, n0 + i * c_n
            over = shifts(rows, v1, r, b_v, b_v)
            for j in range(over[0], over[1]):
                u2, v2, n2 = u1 + j * b_u, v1 + j * b_v, n1 + j * b_n
                aside = u2 - skew * v2
                low_v, high_v = min(low_v, v2 - r), max(high_v, v2 + r)
                low_u, high_u = min(low_u, aside - r * wide), max(high_u, aside + r * wide)
                across = shifts(columns, aside, r * wide, a_u, a_u)
                for q in range(across[0], across[1]):
                    if count < room:
                        spheres.u[count] = u2 + q * a_u
                        spheres.v[count] = v2
                        spheres.depth[count] = n2 + q * a_n
                        spheres.radius[count] = r
                        spheres.removed[count] = grains.removed[g]
                    count += 1
    extent[0], extent[1], extent[2], extent[3] = low_u, high_u, low_v, high_v
    return count


@part()
def cell_grid(
    grains: CellGrains, triad: FloatArray, prism: Prism, offset: FloatArray, spacing: float
) -> tuple[Spheres, Strip, Measured]:
    """The lines along a direction through a periodic medium, and the images that they may meet."""
    edges, climb, repeats = prism.edges, prism.climb, prism.repeats
    mean, length, slope = grains.radius.mean(), 1.0 / climb[2], np.sqrt(np.sum(climb * climb))
    beyond = BEYOND * mean / length
    extent = np.array([np.inf, -np.inf, np.inf, -np.inf])
    # a good estimate for small grains; if it is too low, the second round has enough room
    shell = 1.0 + beyond + 2.0 * mean * slope
    shell *= (1.0 + 2.0 * mean / edges[0, 0]) * (1.0 + 2.0 * mean / edges[1, 1])
    room, count = 0, int(1.1 * shell * grains.radius.size)
    images = room_to_project(ZERO)
    while room < count:
        room = count
        images = room_to_project(room)
        count = fill_images(grains, triad, prism, beyond, extent, images.found)
    # along a period, the face is as large as the period
    for k in range(2):
        if repeats[k]:
            extent[2 * k], extent[2 * k + 1] = 0.0, edges[k, k]
    grid = cover(triad, extent, edges[1, 0] / edges[1, 1], offset, spacing)
    endless = grains.periodic[0] and grains.periodic[1] and (grains.periodic[2] or offset.size == 1)
    # along an axis without a period, lines run from the first solid to the last
    counts_to = length if repeats[2] else FAR
    measured = Measured(counts_to, counts_to + BEYOND * mean, endless)
    return in_order(images, count), grid, measured
