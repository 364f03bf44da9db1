"""Lines through a periodic medium followed on, image by image, to the next solid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.kernels.bins import (
    GAP_HIGH,
    GAP_LOW,
    LINE_BOUND,
    LINE_U,
    Bins,
    add_gaps,
    room_for_gaps,
)
from scanfab.kernels.compiled import inner
from scanfab.kernels.periodic import CellGrains, Prism, cross, dot, shifts
from scanfab.kernels.strips import BOUND, END, FAR, SET, Strip
from scanfab.kernels.sweep import CHANNELS, KEPT, LENGTH, STEPS, VOID, WHOLE

__all__ = ["FaceMap", "follow", "has_unfinished", "map_face", "no_map"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

# a line that has met nothing along so many cells and mean free paths, and has passed by so many
# grains, stays in a channel; in media more dilute than any sample one that has passed by many more
MOST_CELLS = 64
MOST_FREE_PATHS = 20.0
FEW_GRAINS, MANY_GRAINS = 1000, 30_000
# of a map, at most: more bins, of a face that is nearly empty, would take longer to make
BINS_A_GRAIN = 8
# of a bin: places that are so near a bin's edge may lie in either
ROUNDING = 1e-6


@inner()
def entry(
    grains: CellGrains, prism: Prism, u: float, v: float, depth: float, r: float, after: float
) -> float:
    """
    Where the axis u = v = 0 enters the images, in the plane of the face, of a sphere at a place.

    Of those that it leaves behind a depth, the first; FAR if there is none.
    """
    normal = prism.frame[2]
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
def outline(grains: CellGrains) -> FloatArray:
    """
    What lies between the faces that do not repeat, shape (3, 5).

    For each of the cell's edges the normal of the face that it leads away from, and the least and
    greatest place of the grains along it.
    """
    found = np.empty((3, 5))
    for k in range(3):
        face = cross(grains.vectors[(k + 1) % 3], grains.vectors[(k + 2) % 3])
        face /= np.sqrt(dot(face, face))
        low, high = FAR, -FAR
        if not grains.periodic[k]:
            for g in range(grains.radius.size):
                place = dot(grains.position[g], face)
                low = min(low, place - grains.radius[g])
                high = max(high, place + grains.radius[g])
        found[k, :3] = face
        found[k, 3], found[k, 4] = low, high
    return found


@inner()
def way_out(faces: FloatArray, periodic: BoolArray, frame: FloatArray, u: float, v: float) -> float:
    """The depth at which a line leaves the sample through a face that does not repeat, or FAR."""
    last = FAR
    for k in range(3):
        if periodic[k]:
            continue
        face, low, high = faces[k], faces[k, 3], faces[k, 4]
        here = u * dot(frame[0], face) + v * dot(frame[1], face)
        rise = dot(frame[2], face)
        if rise > 0.0:
            last = min(last, (high - here) / rise)
        elif rise < 0.0:
            last = min(last, (low - here) / rise)
    return last


@inner()
def most_layers(grains: CellGrains, prism: Prism, second: bool) -> int:
    """Along how many cells a line is followed; 0 where no grain is left."""
    section = 0.0
    solid = 0
    for g in range(grains.radius.size):
        if not (second and grains.removed[g]):
            section += np.pi * grains.radius[g] * grains.radius[g]
            solid += 1
    if solid == 0:
        return 0
    volume = abs(dot(grains.vectors[0], cross(grains.vectors[1], grains.vectors[2])))
    most = min(MOST_FREE_PATHS * volume / (section * prism.length), MANY_GRAINS / solid)
    return max(MOST_CELLS, int(max(most, FEW_GRAINS / solid)))


class FaceMap(NamedTuple):
    """
    Which grains a line may meet in one layer of cells, by its place on the prism's face.

    The face is parted into bins along its edges; a layer is as high as the prism, and the next one
    is the same, moved by the third of the cell's edges. So a line that crosses an empty layer looks
    into one bin of it instead of asking every grain.
    """

    place: FloatArray
    """u, v and depth of each grain, and in which layer it lies, shape (N, 4)."""
    first: IntArray
    """Where the list of each bin begins, and the end of the last; no entry: not made yet."""
    listed: IntArray
    """The grains of all bins."""
    face: FloatArray
    """
    Along either edge of the face, shape (2, 3): where its bins begin, how many there are to an
    edge, and how many in all; see :func:`on_face`.
    """
    faces: FloatArray
    """See :func:`outline`."""
    largest: float
    """Radius."""


@inner()
def no_map() -> FaceMap:
    """A map that is not made yet."""
    none = np.empty((0, 0))
    numbers = np.empty(0, np.int64)
    return FaceMap(none, numbers, numbers, none, none, 0.0)


@inner()
def on_face(prism: Prism, u: float, v: float) -> tuple[float, float]:
    """A place in the plane of the face along the edges (base_u, 0) and (skew_u, base_v)."""
    along = v / prism.base_v
    return (u - along * prism.skew_u) / prism.base_u, along


@inner()
def layer_step(grains: CellGrains, prism: Prism) -> tuple[float, float, float]:
    """By how much u, v and depth grow from a layer to the next."""
    c = grains.vectors[prism.third]
    u, v, n = dot(c, prism.frame[0]), dot(c, prism.frame[1]), dot(c, prism.frame[2])
    if n - prism.rise_u * u - prism.rise_v * v > 0.0:
        return u, v, n
    return -u, -v, -n


@inner()
def place_grains(grains: CellGrains, prism: Prism) -> tuple[FloatArray, FloatArray]:
    """The places of a map, and for each grain what its disc takes of the face, in edges."""
    frame = prism.frame
    step_u, step_v, _ = layer_step(grains, prism)
    skew = prism.skew_u / prism.base_v
    wide = np.sqrt(1.0 + skew * skew)
    place, discs = np.empty((grains.radius.size, 4)), np.empty((grains.radius.size, 2, 2))
    for g in range(grains.radius.size):
        x, r = grains.position[g], grains.radius[g]
        u, v, n = dot(x, frame[0]), dot(x, frame[1]), dot(x, frame[2])
        layer = np.floor((n - prism.rise_u * u - prism.rise_v * v) / prism.length)
        place[g, 0], place[g, 1], place[g, 2], place[g, 3] = u, v, n, layer
        across, over = on_face(prism, u - layer * step_u, v - layer * step_v)
        reach_across, reach_over = r * wide / prism.base_u, r / prism.base_v
        discs[g, 0, 0], discs[g, 0, 1] = across - reach_across, across + reach_across
        discs[g, 1, 0], discs[g, 1, 1] = over - reach_over, over + reach_over
    return place, discs


@inner()
def part_face(grains: CellGrains, prism: Prism, discs: FloatArray) -> FloatArray:
    """Part the face into bins about as wide as a grain; see :class:`FaceMap`."""
    edges, square = (prism.base_u, prism.base_v), 0.0
    for radius in grains.radius:
        square += radius * radius / grains.radius.size
    low, width = np.zeros(2), np.ones(2)
    for k in range(2):
        if not grains.periodic[prism.first if k == 0 else prism.second]:
            low[k] = discs[:, k, 0].min()
            width[k] = discs[:, k, 1].max() - low[k]
    most = BINS_A_GRAIN * grains.radius.size
    # the mean square, so that a few large grains do not lie in more bins than there are grains
    side = max(2.0 * np.sqrt(square), np.sqrt(width[0] * edges[0] * width[1] * edges[1] / most))
    found = np.empty((2, 3))
    for k in range(2):
        bins = np.floor(min(max(width[k] * edges[k] / side, 1.0), float(most)))
        found[k, 0], found[k, 1], found[k, 2] = low[k], bins / width[k], bins
    return found


@inner()
def bins_met(start: float, stop: float, edge: FloatArray, repeats: bool) -> tuple[int, int]:
    """The first bin that a disc meets along an edge, and how many; a few too many for rounding."""
    bins = int(edge[2])
    first = int(np.floor((start - edge[0]) * edge[1] - ROUNDING))
    last = int(np.floor((stop - edge[0]) * edge[1] + ROUNDING))
    if not repeats:
        first, last = max(first, 0), min(last, bins - 1)
    elif last - first >= bins:
        first, last = 0, bins - 1
    return first, last - first + 1


@inner()
def map_face(grains: CellGrains, prism: Prism) -> FaceMap:
    """The map of a direction."""
    place, discs = place_grains(grains, prism)
    face = part_face(grains, prism, discs)
    columns, rows = int(face[0, 2]), int(face[1, 2])
    first, listed = np.zeros(columns * rows + 1, np.int64), np.empty(0, np.int64)
    # the lists are counted, then filled from their ends
    for is_filled in (False, True):
        for g in range(grains.radius.size):
            across = bins_met(discs[g, 0, 0], discs[g, 0, 1], face[0], grains.periodic[prism.first])
            over = bins_met(discs[g, 1, 0], discs[g, 1, 1], face[1], grains.periodic[prism.second])
            for row in range(over[0], over[0] + over[1]):
                for column in range(across[0], across[0] + across[1]):
                    k = (row % rows) * columns + column % columns
                    if is_filled:
                        first[k] -= 1
                        listed[first[k]] = g
                    else:
                        first[k] += 1
        if not is_filled:
            for k in range(1, first.size):
                first[k] += first[k - 1]
            listed = np.empty(first[-1], np.int64)
    return FaceMap(place, first, listed, face, outline(grains), grains.radius.max())


@inner()
def bin_along(edge: FloatArray, repeats: bool, place: float) -> int:
    """The bin of a place along an edge of the face, or -1 outside."""
    if repeats:
        return int(min(np.floor((place - np.floor(place)) * edge[1]), edge[2] - 1.0))
    found = np.floor((place - edge[0]) * edge[1])
    return int(found) if 0.0 <= found < edge[2] else -1


@inner()
def next_solid(
    grains: CellGrains,
    prism: Prism,
    face: FaceMap,
    second: bool,
    most: int,
    u: float,
    v: float,
    after: float,
) -> tuple[float, int]:
    """
    Where the line through (u, v) enters the next solid behind a depth, which lies in void.

    FAR if it stays in a channel. And the steps that this took: layers, and grains asked.
    ``second``: of the grains that are not removed.
    """
    step_u, step_v, step_n = layer_step(grains, prism)
    margin = face.largest * prism.slope
    place = (after - prism.rise_u * u - prism.rise_v * v) / prism.length - margin
    lowest = np.floor(place)
    last = way_out(face.faces, grains.periodic, prism.frame, u, v) + 2.0 * face.largest
    found = FAR
    steps = 0
    # one more, as the first layer may lie mostly before the place
    for layers in range(most + 1 if most > 0 else 0):
        layer = lowest + layers
        # spheres that are so far away begin behind what was found, or outside the sample
        if (min(found, last) - after) / prism.length + 2.0 * margin < layer - place:
            break
        steps += 1
        across, over = on_face(prism, u - layer * step_u, v - layer * step_v)
        column = bin_along(face.face[0], grains.periodic[prism.first], across)
        row = bin_along(face.face[1], grains.periodic[prism.second], over)
        if column < 0 or row < 0:
            continue
        k = row * int(face.face[0, 2]) + column
        for i in range(face.first[k], face.first[k + 1]):
            g = face.listed[i]
            steps += 1
            if second and grains.removed[g]:
                continue
            up = layer - face.place[g, 3]
            u1 = face.place[g, 0] + up * step_u - u
            v1 = face.place[g, 1] + up * step_v - v
            n1 = face.place[g, 2] + up * step_n
            found = min(found, entry(grains, prism, u1, v1, n1, grains.radius[g], after))
    return found, steps


@inner()
def is_unfinished(lines: FloatArray, place: np.uint64, which: int, length: float) -> bool:
    """Whether a line has met nothing, or a gap starts in its length that no listed chord ends."""
    bound, end = lines[place + BOUND], lines[place + SET * np.uint64(which) + END]
    return bool(end == -FAR or bound <= end < bound + length)


@inner()
def has_unfinished(lines: FloatArray, strip: Strip, which: int, length: float) -> bool:
    """Whether any line of a strip has to be followed."""
    for row in range(strip.rows):
        for column in range(strip.columns):
            if is_unfinished(lines, np.uint64(row * strip.pitch + column), which, length):
                return True
    return False


@inner()
def follow(
    lines: FloatArray,
    strip: Strip,
    which: int,
    grains: CellGrains,
    prism: Prism,
    face: FaceMap,
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
    most = most_layers(grains, prism, which == 1)
    # else a line leaves through a face that does not repeat
    endless = grains.periodic[0] and grains.periodic[1] and grains.periodic[2]
    for row in range(strip.rows):
        v = strip.first_v + row * strip.spacing
        for column in range(strip.columns):
            u = strip.first_u + column * strip.spacing
            place = np.uint64(row * strip.pitch + column)
            if not is_unfinished(lines, place, which, prism.length):
                continue
            if tally[0, STEPS] >= most_steps:
                return
            bound = lines[place + BOUND]
            end = lines[place + SET * np.uint64(which) + END]
            is_empty = end == -FAR
            start, steps = next_solid(
                grains, prism, face, which == 1, most, u, v, bound if is_empty else end
            )
            tally[0, STEPS] += steps
            if start < FAR:
                if not is_empty:
                    gap = start - end
                    tally[which, WHOLE + VOID] += gap
                    if bins.cutoffs.size > 0:
                        one = room_for_gaps(1)
                        one[LINE_U, 0], one[LINE_BOUND, 0] = u, bound
                        one[GAP_LOW, 0], one[GAP_HIGH, 0] = end, start
                        add_gaps(bins, one, np.uint64(1), 1.0, which, v, True, None, None)
                    elif gap >= least:
                        tally[which, WHOLE + LENGTH] += gap
                        tally[which, WHOLE + KEPT] += 1.0
            elif endless:
                tally[which, CHANNELS] += 1.0
                tally[which, WHOLE + VOID] += (
                    prism.length if is_empty else bound + prism.length - end
                )
