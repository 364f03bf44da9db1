"""Slow, obvious twins in two dimensions: discs, and lines beside one another, by brute force."""

from itertools import product
from math import ceil, cos, hypot, sin, sqrt

import numpy as np

from tests.helpers.naive import edge_sums, gaps_between, gaps_within, lengths, union


def lines_along(angle, offset, spacing, reach):
    """The lines of one direction, as (foot, direction)."""
    n, u = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
    number = ceil(reach / spacing) + 1
    return [((i + offset) * spacing * u, n) for i in range(-number, number + 1)]


def chords(discs, foot, n):
    """Where a line meets discs (x, y, r), as the union of entry and exit."""
    found = []
    for x, y, r in discs:
        along = (x - foot[0]) * n[0] + (y - foot[1]) * n[1]
        aside = (x - foot[0]) * n[1] - (y - foot[1]) * n[0]
        if abs(aside) < r:
            half = sqrt(r**2 - aside**2)
            found.append((along - half, along + half))
    return union(found)


def in_circle(radius):
    """Where a line enters and leaves a circle about the origin; None if it misses it."""

    def clip(foot, n):
        along, aside = -(foot @ n), foot[0] * n[1] - foot[1] * n[0]
        half = sqrt(radius**2 - aside**2) if abs(aside) < radius else 0.0
        return (along - half, along + half) if half else None

    return clip


def in_ellipse(a, b):
    """The same of an ellipse with semi-axes along x and y."""

    def clip(foot, n):
        p, q = foot / [a, b], n / [a, b]
        one, half, rest = q @ q, p @ q, p @ p - 1
        root = half**2 - one * rest
        if root <= 0:
            return None
        return (-half - sqrt(root)) / one, (-half + sqrt(root)) / one

    return clip


def in_box(a, b):
    """The same of a rectangle with half edges along x and y."""

    def clip(foot, n):
        low, high = -np.inf, np.inf
        for place, rise, half in zip(foot, n, (a, b), strict=True):
            ends = sorted([(-half - place) / rise, (half - place) / rise])
            low, high = max(low, ends[0]), min(high, ends[1])
        return (low, high) if low < high else None

    return clip


def whole_sums(discs, angle, offset, spacing, cutoff, reach):
    """Length and number of the segments between the first and the last disc of each line."""
    kept = [
        length
        for foot, n in lines_along(angle, offset, spacing, reach)
        for length in lengths(gaps_between(chords(discs, foot, n)))
        if length >= cutoff
    ]
    return sum(kept), len(kept)


def window_sums(discs, angle, offset, spacing, cutoff, clip, reach, rule="clip"):
    """Length and number that count by a rule, with all discs there are, also beyond the window."""
    total = np.zeros(2)
    for foot, n in lines_along(angle, offset, spacing, reach):
        ends = clip(foot, n)
        if ends is None:
            continue
        solids = chords(discs, foot, n)
        if rule == "clip":
            kept = [x for x in lengths(gaps_within(solids, *ends)) if x >= cutoff]
            total += sum(kept), len(kept)
        else:
            total += edge_sums(solids, *ends, cutoff, rule)[:2]
    return total


def images(discs, vectors, reach):
    """The images of discs in a periodic cell (two vectors as rows) within reach of the origin."""
    heights = abs(np.linalg.det(vectors)) / np.linalg.norm(vectors, axis=1)[::-1]
    most = [ceil(reach / height) + 2 for height in heights]
    shifts = product(*(range(-m, m + 1) for m in most))
    return [
        (x + s[0], y + s[1], r)
        for s in (np.array(shift) @ vectors for shift in shifts)
        for x, y, r in discs
        if hypot(x + s[0], y + s[1]) < reach + r
    ]


def contacts(discs, vectors):
    """Number of pairs that overlap, with all images."""
    found = 0
    for i, (x, y, r) in enumerate(discs):
        for j, (p, q, s) in enumerate(discs):
            for shift in product((-1, 0, 1), repeat=2):
                dx, dy = np.array(shift) @ vectors
                if (i, (0, 0)) < (j, shift) and hypot(p + dx - x, q + dy - y) < r + s:
                    found += i < j or shift > (0, 0)
    return found
