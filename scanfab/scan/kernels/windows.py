"""Where the lines along an axis enter and leave a window, as numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.jit import inner
from scanfab.base.typing import FloatArray

# Of the quadric's own size: along a line for which it changes less than that by rounding alone, it
# does not change at all. Such a line, one along a cylinder's axis, leaves it far beyond the planes.
FLAT, LEAST = 1e-15, 1e-300
# of a ball inside that may touch the surface: so much smaller it does not, whatever rounding does
NEARLY = 1.0 - 1e-9
# of the unit normal of a plane, along a line: where it is less, the line is taken for parallel
GRAZING = 1e-100


class Clip(NamedTuple):
    """What lines are clipped to: the data of a :class:`scanfab.base.convex.Convex`."""

    planes: FloatArray
    """Shape (P, 4)."""
    isotropic: float
    deviator: FloatArray
    level: float
    reach: float


class Section(NamedTuple):
    """
    A window as the lines along one axis meet it.

    Those through (u, v) are inside at depths within √(level - a u² - 2 b u v - c v²) of
    rise_u u + rise_v v, and on the inner side of all planes.
    """

    planes: FloatArray
    """
    Rows h, p, q, side: the plane is met at the depth side * (h - p u - q v), shape (P, 4).

    On the side 1 a line leaves the window there, on the side -1 it enters.
    """
    level: float
    a: float
    b: float
    c: float
    rise_u: float
    rise_v: float
    reach: float
    core: float
    """Radius of a ball about the origin that lies inside, and has no place of the surface."""


@inner()
def form(matrix: FloatArray, one: FloatArray, two: FloatArray) -> float:
    """The bilinear form of a matrix."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += one[i] * matrix[i, j] * two[j]
    return total


@inner()
def planes_along(planes: FloatArray, triad: FloatArray) -> FloatArray:
    """As :class:`Section` has them."""
    along = np.empty_like(planes)
    for k in range(planes.shape[0]):
        n_u, n_v, n_n = 0.0, 0.0, 0.0
        for i in range(3):
            n_u += triad[0, i] * planes[k, i]
            n_v += triad[1, i] * planes[k, i]
            n_n += triad[2, i] * planes[k, i]
        # along a plane a line meets it far beyond all others, in front or behind
        steep = max(abs(n_n), GRAZING)
        along[k, 0], along[k, 1], along[k, 2] = planes[k, 3] / steep, n_u / steep, n_v / steep
        along[k, 3] = -1.0 if n_n < 0.0 else 1.0
    return along


@inner()
def core_of(clip: Clip) -> float:
    """Radius of a ball about the origin that lies inside a window: not always the largest."""
    squares = 0.0
    for i in range(3):
        for j in range(3):
            squares += clip.deviator[i, j] * clip.deviator[i, j]
    # no eigenvalue of the quadric is greater
    core = np.sqrt(max(clip.level, 0.0) / max(clip.isotropic + np.sqrt(squares), LEAST))
    for k in range(clip.planes.shape[0]):
        core = min(core, clip.planes[k, 3])
    return NEARLY * float(core)


@inner()
def section_along(clip: Clip, triad: FloatArray) -> Section:
    """
    The section for the lines along the third row of a triad (rows u, v, n).

    On a line the quadric x·(m I + D) x = L is a quadratic equation in the depth t. With q the
    matrix in the triad,

        t = -(q_un u + q_vn v) / q_nn ± √(L / q_nn - a u² - 2 b u v - c v²),

    where a = q_uu / q_nn - (q_un / q_nn)², and b, c likewise. m I is the same in every triad.
    """
    u, v, n = triad[0], triad[1], triad[2]
    m, deviator = clip.isotropic, clip.deviator
    largest = 0.0
    for i in range(3):
        for j in range(3):
            largest = max(largest, abs(deviator[i, j]))
    along, lean_u, lean_v = m + form(deviator, n, n), form(deviator, u, n), form(deviator, v, n)
    flat = FLAT * (m + largest) + LEAST
    if along < flat:
        along, lean_u, lean_v = flat, 0.0, 0.0
    lean_u, lean_v = lean_u / along, lean_v / along
    return Section(
        planes_along(clip.planes, triad),
        clip.level / along,
        (m + form(deviator, u, u)) / along - lean_u * lean_u,
        form(deviator, u, v) / along - lean_u * lean_v,
        (m + form(deviator, v, v)) / along - lean_v * lean_v,
        -lean_u,
        -lean_v,
        clip.reach,
        core_of(clip),
    )
