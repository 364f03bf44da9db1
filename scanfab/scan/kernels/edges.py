"""
What a void segment counts at the window's surface: the three rules, one beside the other.

A segment [low, high] on a line that is inside the window from ``enters`` to ``leaves`` adds a
length and a number to the sums of its direction. With L = high - low, I the part of it inside, e
the number of its ends inside (0, 1, 2), where a place at which the window cuts it is no end, and c
the cut-off::

    rule    counts if   length                number
    clip    I >= c      I                     1
    start   L >= c      L e/2                 e/2
    ends    I >= c      (I - c) + c e/2       e/2

The mean length is the ratio of the two sums. That of ``ends`` is c + Σ (I - c) / Σ e/2, written as
one ratio. docs/details/edges.md says why the last two have no bias.

What ``start`` keeps of the solids beyond the window, :mod:`scanfab.scan.kernels.start` says.
"""

from __future__ import annotations

from scanfab.base.jit import Flag, inner
from scanfab.scan.kernels.strips import FAR, Edge

# Of the margin: segments that reach so far are followed, whatever rounding says of its very end.
NEARLY = 1.0 - 1e-6


CLIPPED, WEIGHED = Edge(None, None, 0.0, None), Edge(True, None, 0.0, None)


@inner(forceinline=True, error_model="numpy")
def ends_inside(low: float, high: float, enters: float, leaves: float) -> float:
    """Half the number of ends in the window of a segment that has a part there."""
    return (0.5 if low > enters else 0.0) + (0.5 if high < leaves else 0.0)


@inner(forceinline=True, error_model="numpy")
def listed_to(edge: Edge) -> float:
    """From where on solids beyond the window may not be listed."""
    return edge.margin * NEARLY


@inner(forceinline=True, error_model="numpy")
def window_gap(
    low: float, high: float, least: float, enters: float, leaves: float, whole: Flag, edge: Edge
) -> tuple[float, float, float]:
    """Length and number that a gap adds to the window's sums, and the length of it inside."""
    last = high if high < leaves else leaves
    first = low
    if whole is not None or edge.start is not None:
        # else no line begins before the window
        first = low if low > enters else enters
    inside = last - first
    void = inside if inside > 0.0 else 0.0
    if edge.start is not None:
        length = high - low
        # the others are followed
        known = (high < leaves + listed_to(edge)) & (length < 0.5 * FAR)
        kept = (inside > 0.0) & (length >= least) & known
        weight = ends_inside(low, high, enters, leaves)
        return weight * length if kept else 0.0, weight if kept else 0.0, void
    kept = inside >= least
    if edge.ends is not None:
        weight = ends_inside(low, high, enters, leaves)
        return (
            inside - least + weight * least if kept else 0.0,
            weight if kept else 0.0,
            void,
        )
    return inside if kept else 0.0, 1.0 if kept else 0.0, void
