"""Whether a sample without a cell looks as if it repeated: its opposite faces fit together."""

from __future__ import annotations

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray
from scanfab.packing.packing import Packing

# grains of a face that tell whether it fits
MOST_GRAINS = 2000
# in mean radii: lengths that differ by no more are one period, as contacts overlap a little
SAME = 0.1
# contacts through a face, as a fraction of those through the middle: 0.6 to 1.5 in periodic
# samples, up to 0.3 between flat walls
FITS = 0.5
# of those: pairs that would overlap more, as they do where a contact is oblique
BEYOND = 0.4
# contacts that tell anything
FEWEST = 10


def fitting_periods(packing: Packing) -> list[float | None]:
    """
    The period along x, y and z at which grains of opposite faces touch; None where they do not.

    Parameters
    ----------
    packing : Packing
        With contacts. Its cell does not count; only upright faces are compared.
    """
    return [_period(packing, axis) for axis in range(3)]


def _period(packing: Packing, axis: int) -> float | None:
    """The length by which one face is moved so that about as many pairs touch as inside."""
    along, radius = packing.position[:, axis], packing.radius
    if len(along) < FEWEST:
        return None
    low, high = float(along.min()), float(along.max())
    layer = 2.0 * float(radius.max())
    # where rounding leaves nothing of the layer there is no face
    if not 3.0 * layer <= high - low < layer / np.finfo(float).eps:
        return None
    lengths, share = _lengths(packing, axis, along < low + layer, along > high - layer)
    if len(lengths) < FEWEST:
        return None
    lengths.sort()
    ends = np.searchsorted(lengths, lengths + SAME * float(radius.mean()), side="right")
    counts = ends - np.arange(len(lengths))
    counts[len(lengths) - ends > BEYOND * counts] = 0
    best = int(np.argmax(counts))
    # contacts whose grains lie on both sides of the middle
    assert packing.contacts is not None
    is_above = along[packing.contacts.pairs] >= 0.5 * (low + high)
    expected = share * np.count_nonzero(is_above[:, 0] != is_above[:, 1])
    if expected < FEWEST or counts[best] < max(FEWEST, FITS * expected):
        return None
    return float(np.median(lengths[best : ends[best]]))


def _lengths(
    packing: Packing, axis: int, is_low: BoolArray, is_high: BoolArray
) -> tuple[FloatArray, float]:
    """
    For each pair of grains at opposite faces, the period at which they would touch.

    And the share of the low face's grains that were looked at.
    """
    from scipy.spatial import KDTree

    across = np.delete(packing.position, axis, axis=1)
    one, two = np.flatnonzero(is_low), np.flatnonzero(is_high)
    count = len(one)
    if count > MOST_GRAINS:
        middle = np.median(across[one], axis=0)
        one = one[np.argsort(np.linalg.norm(across[one] - middle, axis=1))[:MOST_GRAINS]]
    near = KDTree(across[two]).query_ball_point(
        across[one], packing.radius[one] + float(packing.radius[two].max())
    )
    partners = two[np.concatenate([np.asarray(rows, np.int64) for rows in near])]
    first = np.repeat(one, [len(rows) for rows in near])
    reach = packing.radius[first] + packing.radius[partners]
    room = reach**2 - np.sum((across[first] - across[partners]) ** 2, axis=1)
    meets = room > 0
    along = packing.position[:, axis]
    apart: FloatArray = along[partners[meets]] - along[first[meets]] + np.sqrt(room[meets])
    return apart, len(one) / count
