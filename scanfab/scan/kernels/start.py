"""
What the rule ``start`` keeps of the solids beyond the window.

Only chords that reach into the window change the state of a line that the sweep moves on
(:mod:`scanfab.scan.kernels.sweep`). Of the others, and of those that begin before the window, a
line keeps where the last solid before it ends and where the first one behind it begins, in whatever
order they come. There the first segment of the line begins, and its last one ends. The place before
the window is kept with a minus: on the line as seen from behind, it is the least place, too.

Solids are listed as far as a margin beyond the window. A line that has met none there keeps the
margin's end; what is longer is followed alone (:mod:`scanfab.scan.kernels.beyond`).
"""

from __future__ import annotations

import numpy as np

from scanfab.base.jit import LANES, REORDERED, Flag, inner
from scanfab.base.typing import FloatArray
from scanfab.scan.kernels.edges import listed_to
from scanfab.scan.kernels.strips import (
    BEFORE,
    BEHIND,
    END,
    FAR,
    SET,
    Edge,
    Sphere,
    Strip,
    columns_of_row,
    span,
)


@inner(forceinline=True, error_model="numpy")
def met_beyond(
    lines: FloatArray, i: np.uint64, start: float, stop: float, enters: float, leaves: float
) -> None:
    """Let a line keep what a chord makes of the solids beyond the window; of NaN it is nothing."""
    before, behind = lines[i + BEFORE], lines[i + BEHIND]
    place = -stop if start <= enters else before
    lines[i + BEFORE] = place if place < before else before
    place = start if start >= leaves else behind
    lines[i + BEHIND] = place if place < behind else behind


@inner(forceinline=True, error_model="numpy")
def reaches_in(start: float, stop: float, enters: float, leaves: float) -> bool:
    """Whether a chord has a part in the window."""
    return (stop > enters) & (start < leaves)


@inner(forceinline=True, error_model="numpy")
def begins_at(low: float, before: float) -> float:
    """Where a gap begins; the first one of a line at the last solid before the window."""
    return low if low > -before else -before


@inner(forceinline=True, error_model="numpy")
def settled_gap(low: float, high: float, before: float, least: float) -> tuple[float, float, float]:
    """
    Length and number that a gap adds which ends in the window, and its length.

    That of a first gap is too long by what lies before the window, which :func:`last_gap` knows.
    """
    length = high - begins_at(low, before)
    weight = 0.5 if low < -before else 1.0
    kept = length >= least
    void = length if length > 0.0 else 0.0
    return weight * length if kept else 0.0, weight if kept else 0.0, void


@inner(forceinline=True, error_model="numpy")
def last_gap(
    lines: FloatArray, i: np.uint64, least: float, enters: float, leaves: float, edge: Edge
) -> tuple[float, float, float]:
    """
    Length and number that the void behind a line's last solid adds, and its length in the window.

    Less what its first gap has before the window.
    """
    end, before, behind = lines[i + END], lines[i + BEFORE], lines[i + BEHIND]
    length = behind - end
    is_met = (end > -FAR) & (end < FAR)
    ends_beyond = is_met & (end < leaves) & (behind < leaves + listed_to(edge))
    kept = ends_beyond & (length >= least)
    void = leaves - (end if end > -FAR else enters)
    void = void if void > 0.0 else 0.0
    outside = enters + before if is_met else 0.0
    void -= outside if outside > 0.0 else 0.0
    return 0.5 * length if kept else 0.0, 0.5 if kept else 0.0, void


@inner(fastmath=REORDERED, error_model="numpy")
def visit_beyond(
    lines: FloatArray,
    strip: Strip,
    sphere: Sphere,
    kept: float,
    second: Flag,
) -> float:
    """
    Visit the chords of a sphere that does not reach into the window; returns how many these are.

    ``kept`` is NaN for a sphere that is not in the second set of solids.
    """
    chords = 0.0
    radius, per_spacing = sphere.radius, strip.per_spacing
    rows = span(sphere.v, radius, strip.first_v, per_spacing, 0, strip.rows)
    columns = span(sphere.u, radius, strip.first_u, per_spacing, 0, strip.columns)
    from_u, from_v = strip.first_u - sphere.u, strip.first_v - sphere.v
    plane, depth = (BEFORE, -sphere.depth) if sphere.depth < 0.0 else (BEHIND, sphere.depth)
    for row in range(rows[0], rows[1]):
        dv = from_v + row * strip.spacing
        reach2 = radius * radius - dv * dv
        first, met, cut = columns_of_row(strip, sphere, row, reach2, columns[0], columns[1])
        chords += cut
        vectors = (met + LANES - 1) // LANES
        first_du = from_u + first * strip.spacing
        at = np.uint64(row * strip.pitch + first) + plane
        for j in range(np.uint64(vectors * LANES)):
            i = at + j
            du = first_du + strip.spacing * np.int32(j)
            place = depth - np.sqrt(reach2 - du * du)
            known = lines[i]
            lines[i] = place if place < known else known
            if second is not None:
                place += kept
                known = lines[i + SET]
                lines[i + SET] = place if place < known else known
    return chords
