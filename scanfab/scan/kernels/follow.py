"""Lines through a periodic medium followed on, image by image, to the next solid."""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import ZERO, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.bins import (
    Bins,
    add_gaps,
    list_gap,
    room_for_gaps,
)
from scanfab.scan.kernels.periodic import CellGrains, Prism, cross, dot, shifts
from scanfab.scan.kernels.strips import END, ENTRY, FAR, SET, Strip
from scanfab.scan.kernels.sweep import CHANNELS, KEPT, LENGTH, STEPS, VOID, WHOLE

# a line that has met nothing along so many cells and mean free paths, and has passed by so many
# grains, stays in a channel; in media more dilute than any sample one that has passed by many more
MOST_CELLS = 64
MOST_FREE_PATHS = 20.0
FEW_GRAINS, MANY_GRAINS = 1000, 30_000


@inner()
def entry(
    grains: CellGrains, prism: Prism, u: float, v: float, depth: float, r: float, after: float
) -> float:
    """
    Where the axis u = v = 0 enters the images, in the plane of the face, of a sphere at a place.

    Of those that it leaves behind a depth, the first; FAR if there is none.
    """
    normal = prism.triad[2]
    found = FAR
    over = 0, 1
    if grains.periodic[prism.second]:
        over = shifts(v, r, 0.0, 0.0, prism.base_v)
    for j in range(over[0], over[1]):
        v1, u1 = v + j * prism.base_v, u + j * prism.skew_u
        reach2 = r * r - v1 * v1
        across = 0, 1
        if grains.periodic[prism.first]:
            across = shifts(u1, np.sqrt(max(reach2, 0.0)), 0.0, 0.0, prism.base_u)
        for q in range(across[0], across[1]):
            u2 = u1 + q * prism.base_u
            if reach2 > u2 * u2:
                half = np.sqrt(reach2 - u2 * u2)
                middle = depth + j * dot(grains.vectors[prism.second], normal)
                middle += q * dot(grains.vectors[prism.first], normal)
                # not by its end: that of the solid left behind is there, to rounding
                if middle > after:
                    found = min(found, middle - half)
    return found


@inner()
def way_out(grains: CellGrains, triad: FloatArray, u: float, v: float) -> float:
    """The depth at which a line leaves the sample through a face that does not repeat, or FAR."""
    last = FAR
    for k in range(3):
        if grains.periodic[k]:
            continue
        face = cross(grains.vectors[(k + 1) % 3], grains.vectors[(k + 2) % 3])
        face /= np.sqrt(dot(face, face))
        low, high = FAR, -FAR
        for g in range(grains.radius.size):
            place = dot(grains.position[g], face)
            low, high = min(low, place - grains.radius[g]), max(high, place + grains.radius[g])
        here = u * dot(triad[0], face) + v * dot(triad[1], face)
        rise = dot(triad[2], face)
        if rise > 0.0:
            last = min(last, (high - here) / rise)
        elif rise < 0.0:
            last = min(last, (low - here) / rise)
    return last


@inner()
def limits_of(grains: CellGrains, prism: Prism, second: bool) -> tuple[float, int]:
    """The largest radius, and along how many cells a line is followed; 0 where no grain is left."""
    largest = section = 0.0
    solid = 0
    for g in range(grains.radius.size):
        largest = max(largest, grains.radius[g])
        if not (second and grains.removed[g]):
            section += np.pi * grains.radius[g] * grains.radius[g]
            solid += 1
    if solid == 0:
        return largest, 0
    volume = abs(dot(grains.vectors[0], cross(grains.vectors[1], grains.vectors[2])))
    most = min(MOST_FREE_PATHS * volume / (section * prism.length), MANY_GRAINS / solid)
    return largest, max(MOST_CELLS, int(max(most, FEW_GRAINS / solid)))


@inner()
def next_solid(
    grains: CellGrains,
    prism: Prism,
    second: bool,
    limits: tuple[float, int],
    u: float,
    v: float,
    after: float,
) -> tuple[float, float]:
    """
    Where the line through (u, v) enters the next solid behind a depth, which lies in void.

    FAR if it stays in a channel. And the steps that this took: one for each grain and cell.
    ``second``: of the grains that are not removed.
    """
    triad, c = prism.triad, grains.vectors[prism.third]
    largest, most = limits
    rise_c = dot(c, triad[2]) - prism.rise_u * dot(c, triad[0]) - prism.rise_v * dot(c, triad[1])
    step = 1.0 if rise_c > 0.0 else -1.0
    margin = largest * prism.slope
    place = (after - prism.rise_u * u - prism.rise_v * v) / prism.length - margin
    last = way_out(grains, triad, u, v) + 2.0 * largest
    found, steps = FAR, 0.0
    for cells in range(most):
        # spheres that are so far away begin behind what was found, or outside the sample
        if (min(found, last) - after) / prism.length + 2.0 * margin < cells:
            break
        steps += grains.radius.size
        for g in range(grains.radius.size):
            if second and grains.removed[g]:
                continue
            x, r = grains.position[g], grains.radius[g]
            u0, v0, n0 = dot(x, triad[0]), dot(x, triad[1]), dot(x, triad[2])
            height = (n0 - prism.rise_u * u0 - prism.rise_v * v0) / prism.length
            k = np.ceil(place + cells - height) * step
            u1 = u0 + k * dot(c, triad[0]) - u
            v1 = v0 + k * dot(c, triad[1]) - v
            n1 = n0 + k * dot(c, triad[2])
            found = min(found, entry(grains, prism, u1, v1, n1, r, after))
    return found, steps


@inner()
def follow(
    lines: FloatArray,
    strip: Strip,
    which: int,
    grains: CellGrains,
    prism: Prism,
    least: float,
    most_steps: float,
    tally: FloatArray,
    bins: Bins,
) -> None:
    """
    Tally the gaps that start in the measured length and end beyond what was listed of it.

    And the steps that this takes. It ends when the tally of the direction has so many: then all of
    it is worth nothing.
    """
    limits = limits_of(grains, prism, which == 1)
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.columns):
            u = strip.first_u + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            enters = lines[place + ENTRY]
            end = lines[place + SET * np.uint64(which) + END]
            is_empty = end == -FAR
            if not is_empty and not enters <= end < enters + prism.length:
                continue
            if tally[0, STEPS] >= most_steps:
                return
            after = enters if is_empty else end
            start, steps = next_solid(grains, prism, which == 1, limits, u, v, after)
            tally[0, STEPS] += steps
            if start < FAR:
                if not is_empty:
                    gap = start - end
                    tally[which, WHOLE + VOID] += gap
                    if bins.cutoffs.size > 0:
                        one = room_for_gaps(1)
                        list_gap(one, ZERO, u, end, start, enters, enters, True, None, None)
                        add_gaps(bins, one, np.uint64(1), 1.0, which, v, True, None)
                    elif gap >= least:
                        tally[which, WHOLE + LENGTH] += gap
                        tally[which, WHOLE + KEPT] += 1.0
            elif prism.endless:
                # else the line leaves through a face that does not repeat
                tally[which, CHANNELS] += 1.0
                tally[which, WHOLE + VOID] += (
                    prism.length if is_empty else enters + prism.length - end
                )
