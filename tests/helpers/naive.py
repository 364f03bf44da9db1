"""Slow, obvious twins of every kernel and formula: what the fast ones must equal."""

from itertools import pairwise, product
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from scanfab.base.convex import Convex


class Segment(NamedTuple):
    """One void segment: its length, and the place of its middle."""

    length: float
    middle: np.ndarray


def chords(position, radius, point, direction):
    """Where the line through a point meets the spheres: list of (entry, exit) along it."""
    return chords_of_lines(position, radius, point[None], direction)[0]


def chords_of_lines(position, radius, points, direction):
    """The same of parallel lines, through a point each: one list for every line."""
    relative = position - points[:, None]
    depth = relative @ direction
    across = relative - depth[..., None] * direction
    half2 = radius**2 - np.sum(across**2, axis=2)
    half = np.sqrt(np.maximum(half2, 0.0))
    hit = half2 > 0
    found = [[] for _ in points]
    lines, ends = np.nonzero(hit)[0], ((depth - half)[hit], (depth + half)[hit])
    for line, entry, leave in zip(lines.tolist(), *(end.tolist() for end in ends), strict=True):
        found[line].append((entry, leave))
    return found


def union(intervals):
    """Intervals merged where they overlap or touch, in order."""
    merged = []
    for start, end in sorted(intervals):
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(merged[-1][1], end))
        else:
            merged.append((start, end))
    return merged


def gaps_between(solids):
    """Ends of what lies between neighbouring solids of a union."""
    return [(before[1], after[0]) for before, after in pairwise(solids)]


def gaps_within(solids, low, high):
    """Ends of what a union leaves free between two ends, which act as solids."""
    inside = [(start, end) for start, end in solids if end > low and start < high]
    walls = [(low, low), *((max(s, low), min(e, high)) for s, e in inside), (high, high)]
    return [(start, end) for start, end in gaps_between(walls) if end > start]


def lengths(intervals):
    """Of intervals."""
    return [end - start for start, end in intervals]


def grid_lines(position, radius, triad, offset, spacing, window):
    """
    The lines of a square grid along the third row of a triad (rows u, v, n), row by row.

    Of each its foot, its solids, and where it enters and leaves the window.
    """
    u, v, direction = triad
    surfaces = np.linalg.norm(position, axis=1) + radius
    reach = window.reach if isinstance(window, Convex) else window
    number = ceil(max([reach, *surfaces]) / spacing) + 1
    places = np.arange(-number, number + 1)
    for x in (places + offset[0]) * spacing:
        feet = x * u + ((places + offset[1]) * spacing)[:, None] * v
        solids = map(union, chords_of_lines(position, radius, feet, direction))
        yield from zip(feet, solids, *within(window, feet, direction), strict=True)


def within(window, feet, direction):
    """
    Where lines enter and leave a window, a sphere of this radius or a region as data.

    A line is foot + t * direction; what it enters behind where it leaves, it misses. Of one foot or
    of many, shape (..., 3).
    """
    if not isinstance(window, Convex):
        half = np.sqrt(np.maximum(window**2 - np.sum(feet**2, axis=-1), 0.0))
        return -half, half
    matrix, level = window.quadric

    def rise(t):
        places = feet + t * direction
        return np.sum(places @ matrix * places, axis=-1) - level

    # the parabola through three of its points
    before, here, behind = rise(-1), rise(0), rise(1)
    one, half_slope = 0.5 * (behind + before) - here, 0.25 * (behind - before)
    root = np.sqrt(np.maximum(half_slope**2 - one * here, 0.0))
    straight, inside = np.abs(one) < 1e-12, np.where(here < 0, np.inf, 0.0)
    divisor = np.where(straight, 1.0, one)
    low = np.where(straight, -inside, (-half_slope - root) / divisor)
    high = np.where(straight, inside, (-half_slope + root) / divisor)
    for *normal, distance in window.planes:
        steepness, rest = direction @ normal, distance - feet @ normal
        if abs(steepness) < 1e-12:
            high = np.where(rest > 0, high, low)
        elif steepness > 0:
            high = np.minimum(high, rest / steepness)
        else:
            low = np.maximum(low, rest / steepness)
    return low[()], high[()]


def tallies(position, radius, triad, offset, spacing, clip, cutoffs):
    """What a scan adds up at each cut-off, by name; the triad is that of :func:`grid_lines`."""
    lines = [*grid_lines(position, radius, triad, offset, spacing, clip)]
    clipped = [(solids, low, high) for _, solids, low, high in lines if low < high]
    gaps = {
        "whole": [one for _, solids, *_ in lines for one in lengths(gaps_between(solids))],
        "window": [one for line in clipped for one in lengths(gaps_within(*line))],
    }
    found = {
        "whole_lines": sum(bool(solids) for _, solids, *_ in lines),
        "window_lines": len(clipped),
        "window_void": sum(gaps["window"]),
        "window_line_length": sum(high - low for _, low, high in clipped),
    }
    for least in cutoffs:
        kept = {name: [one for one in every if one >= least] for name, every in gaps.items()}
        sums = {f"{name}_length": sum(every) for name, every in kept.items()}
        yield found | sums | {f"{name}_segments": len(every) for name, every in kept.items()}


def edge_sums(solids, enters, leaves, cutoff, rule):
    """
    Length, number, and number of those left out, of one line's segments, by a rule at the edge.

    ``solids`` is the union of all solids on the line, also of those beyond the window.
    """
    length = number = left = 0.0
    bounds = [-np.inf, *(place for solid in solids for place in solid), np.inf]
    for low, high in zip(bounds[::2], bounds[1::2], strict=True):
        inside = min(high, leaves) - max(low, enters)
        ends = sum(1 for place in (low, high) if enters < place < leaves)
        if inside <= 0:
            continue
        if rule == "clip" and inside >= cutoff:
            length, number = length + inside, number + 1
        if rule == "ends" and inside >= cutoff:
            # c + Σ (I - c) / Σ e/2, as one ratio
            length, number = length + inside - cutoff + cutoff * ends / 2, number + ends / 2
        if rule == "start" and not np.isfinite(high - low):
            left += ends / 2
        elif rule == "start" and high - low >= cutoff:
            length, number = length + (high - low) * ends / 2, number + ends / 2
    return np.array([length, number, left])


def plane_sums(position, radius, angle, offset, spacing, cutoff, window=None, rule="clip"):
    """
    Length and number of the segments of discs in x-y, on lines side by side at an angle with x.

    Without a window those between the first and the last disc of each line; else those that count
    by a rule at its edge.
    """
    direction, u = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0]])
    reach = (np.linalg.norm(position, axis=1) + radius).max() if window is None else window.reach
    number = ceil(reach / spacing) + 1
    feet = (np.arange(-number, number + 1)[:, None] + offset) * spacing * u
    total = np.zeros(3)
    for foot, found in zip(feet, chords_of_lines(position, radius, feet, direction), strict=True):
        solids = union(found)
        if window is None:
            kept = [one for one in lengths(gaps_between(solids)) if one >= cutoff]
            total += sum(kept), len(kept), 0
        else:
            total += edge_sums(solids, *within(window, foot, direction), cutoff, rule)
    return total[:2]


def void_segments(position, radius, triad, offset, spacing, clip):
    """The void segments on a grid of lines: those of the whole sample, those of the window."""
    whole, window = [], []
    for foot, solids, low, high in grid_lines(position, radius, triad, offset, spacing, clip):
        kinds = [(whole, gaps_between(solids))]
        if low < high:
            kinds.append((window, gaps_within(solids, low, high)))
        for found, gaps in kinds:
            for start, end in gaps:
                found.append(Segment(end - start, foot + 0.5 * (start + end) * triad[2]))
    return whole, window


def block(place, blocks):
    """The block of a place, from its definition; -1 for none."""
    number, before, distance = 0, 1, np.zeros(3)
    coordinates = np.linalg.solve(blocks.edges.T, place - blocks.corner)
    for axis, parts in enumerate(blocks.parts):
        along = coordinates[axis]
        if blocks.repeats[axis]:
            along %= 1.0
        elif not 0 <= along <= 1:
            return -1
        number += before * min(int(along * parts), parts - 1)
        before *= parts
        distance += (along - 0.5) * blocks.edges[axis]
    if not blocks.radius:
        return number
    share = np.linalg.norm(distance) / blocks.radius
    if share > 1:
        return -1
    return number + before * min(int(share * blocks.shells), blocks.shells - 1)


def gap_sums(segments, blocks, cutoffs):
    """Number, length and square of segments by block and cut-off, shape (B, C, 3)."""
    sums = np.zeros((len(blocks), len(cutoffs), 3))
    for length, middle, *weight in segments:
        number = block(middle, blocks)
        if number >= 0:
            weights = weight[0] if weight else 1.0
            kept = length >= np.array(cutoffs)
            sums[number, kept] += weights * np.array([1.0, length, length**2])
    return sums


def shifts_within(reach, branch, vectors, periodic):
    """All shifts by whole periodic vectors that may bring a branch within reach."""
    rows = [k for k in range(3) if periodic[k]]
    if not rows:
        return [(0, 0, 0)]
    # planes of the lattice, in its span: open vectors do not bound it
    inverse = np.linalg.pinv(vectors[rows])
    layers = [range(1)] * 3
    for k, along, per_length in zip(
        rows, branch @ inverse, np.linalg.norm(inverse, axis=0), strict=True
    ):
        most = reach * per_length + 1e-9
        layers[k] = range(ceil(-along - most), floor(-along + most) + 1)
    return list(product(*layers))


def nearest_length(branch, vectors, periodic):
    """The shortest length of a branch with all shifts that are not longer than itself."""
    lattice = vectors[list(periodic)]
    if len(lattice):
        branch = branch - np.rint(branch @ np.linalg.pinv(lattice)) @ lattice
    shifts = shifts_within(np.linalg.norm(branch), branch, vectors, periodic)
    return min(np.linalg.norm(branch + shift @ vectors) for shift in shifts)


def contacts(position, radius, tolerance=0.0, vectors=None, periodic=(True, True, True)):
    """
    Contacts by geometry, of all pairs with all images: a set of (first, second, image).

    Each contact once, named from its lower row; one with an own image by the image whose first
    shift is positive. ``vectors`` are those of the cell, or its edges.
    """
    periodic = (False,) * 3 if vectors is None else periodic
    vectors = np.zeros((3, 3)) if vectors is None else np.asarray(vectors, dtype=float)
    vectors = np.diag(vectors) if vectors.ndim == 1 else vectors
    found = set()
    for i, j in product(range(len(position)), repeat=2):
        branch, reach = position[j] - position[i], (radius[i] + radius[j]) * (1 + tolerance)
        for shift in shifts_within(reach, branch, vectors, periodic) if i <= j else ():
            if i == j and shift <= (0, 0, 0):
                continue
            if np.linalg.norm(branch + shift @ vectors) < reach:
                found.add((i, j, shift))
    return found


def void_tensor(axes, weights, mean_lengths):
    """G_vs of one replicate: Σ w ℓ n⊗n / Σ w ℓ, written out."""
    terms = list(zip(axes, weights, mean_lengths, strict=True))
    total = sum(weight * length for _, weight, length in terms)
    return sum(weight * length / total * np.outer(n, n) for n, weight, length in terms)


def contact_tensor(normals):
    """G_c: the mean of n⊗n, written out."""
    return sum(np.outer(normal, normal) for normal in normals) / len(normals)


def axial(tensor, axis):
    """a·G·a - (1 - a·G·a)/2, written out."""
    along = sum(axis[i] * tensor[i][j] * axis[j] for i, j in product(range(3), repeat=2))
    return along - (1 - along) / 2


def distinct(rows):
    """Rows of three whole numbers, each once; np.unique takes several times as long."""
    low = rows.min(axis=0)
    seen = np.zeros(np.ptp(rows, axis=0) + 1, bool)
    seen[tuple((rows - low).T)] = True
    return np.argwhere(seen) + low


def periodic_solids(position, radius, vectors, periods, foot, direction, low, high):
    """The union of the solids on a line through a periodic medium, from low to high and around."""
    heights = 1 / np.linalg.norm(np.linalg.inv(vectors), axis=0)
    # a place of the line lies within a cell of one that is looked at, and grains of as many around
    around = [
        np.arange(-n, n + 1) if period else np.zeros(1, int)
        for n, period in zip(np.ceil(radius.max() / heights).astype(int) + 1, periods, strict=True)
    ]
    steps = np.arange(low, high, 0.5 * heights.min())
    cells = np.floor((foot + steps[:, None] * direction - position[0]) @ np.linalg.inv(vectors))
    cells = distinct(np.where(periods, cells, 0.0).astype(int))
    spread = np.array(list(product(*around)))
    shifts = distinct((cells[:, None] + spread).reshape(-1, 3))
    turns = np.floor((position - position[0]) @ np.linalg.inv(vectors))
    home = position - np.where(periods, turns, 0.0) @ vectors
    images = (home[None] + (shifts @ vectors)[:, None]).reshape(-1, 3)
    radii = np.tile(radius, len(shifts))
    depth = (images - foot) @ direction
    inside = (depth > low) & (depth < high)
    return union(chords(images[inside], radii[inside], foot, direction))


def periodic_segments(position, radius, vectors, periods, foot, direction, measured):
    """
    Gaps of one line through a periodic medium, from a list of images as far as the longest gap.

    With a measured length, those that start in it; else all between the first and last solid.
    """
    if len(radius) == 0:
        return []
    low, high = (-3.0, max(measured, 1.0) + 150.0) if measured else (-60.0, 60.0)
    solids = periodic_solids(position, radius, vectors, periods, foot, direction, low, high)
    return [
        Segment(after[0] - before[1], foot + 0.5 * (before[1] + after[0]) * direction)
        for before, after in pairwise(solids)
        if not measured or 0 <= before[1] < measured
    ]


def held_grains(pairs, walls, grains, least):
    """Grains left when one after another goes that too few of those left, or others, hold."""
    left = set(range(len(grains)))

    def numbers():
        found = dict(zip(range(len(grains)), walls, strict=True))
        for one, two in pairs:
            if one in left and two in left:
                found[one] += 1
                found[two] += 1
        return found

    while loose := [row for row in left if grains[row] and numbers()[row] < least]:
        left.remove(loose[-1])
    return {row for row in left if grains[row]}
