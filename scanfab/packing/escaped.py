"""Grains that flew away: a few that lie far from all others and must not widen the sample."""

from __future__ import annotations

from itertools import product

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.packing.packing import Packing

# A gap between surfaces is wide if it is above RADII largest radii, and above TIMES the usual gap.
# The usual gap is the one to the nearest neighbour that only a share LONELY of the grains exceeds.
# In dense samples (boxes, cells, shells) no outer grain was more than 0.5 radii away from the
# others; in loose samples and gases no more than 3.0 usual gaps, in falling grains 4.3.
RADII, TIMES, LONELY = 1.25, 5.0, 0.05
# Among fewer grains none counts as far away from the others.
FEWEST = 50
# At most this share of the grains is left out, and at most so many that flew away together. More
# grains may be a part of the sample, which the user has to decide.
SHARE, TOGETHER = 0.01, 20
# The usual gap is measured at so many grains.
SOME = 10_000


def escaped_grains(packing: Packing, grains: BoolArray) -> BoolArray:
    """
    Find the grains that lie far outside the others, by their positions and radii.

    Only grains that widen the sample along a direction that does not repeat count. The search ends
    when they are more than one in a hundred.

    Parameters
    ----------
    packing : Packing
        One frame.
    grains : ndarray of bool, shape (N,)
        Which of its particles are grains.

    Returns
    -------
    ndarray of bool, shape (N,)

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Packing
    >>> from scanfab.packing.escaped import escaped_grains
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(5.0)]), axis=-1).reshape(-1, 3)
    >>> packing = Packing(np.vstack([grid, [20.0, 2.0, 2.0]]), 0.5)
    >>> np.flatnonzero(escaped_grains(packing, np.ones(126, bool))).tolist()
    [125]
    """
    rows, left = np.flatnonzero(grains), grains.copy()
    count = _number(packing, rows)
    most = max(SHARE * count, 1.0)
    flown: list[int] = []
    # along these axes a grain has no image at another place
    periods = np.zeros((0, 3)) if packing.cell is None else packing.cell.lattice.vectors
    axes = [axis for axis in sorted(packing.space.along) if not periods[:, axis].any()]
    ends = list(product(axes, (-1.0, 1.0))) if count >= FEWEST else []
    far = RADII * float(packing.radius[rows].max(initial=0.0))
    # This quick test nearly always finds nothing, which spares loading SciPy.
    if any(_group_at_end(packing, left, *end, far) for end in ends):
        from scipy.spatial import KDTree

        some = rows[:: len(rows) // SOME + 1]
        distance, near = KDTree(packing.position[rows]).query(packing.position[some], k=2)
        gaps = distance[:, 1] - packing.radius[some] - packing.radius[rows[near[:, 1]]]
        far = max(far, TIMES * float(np.quantile(gaps, 1.0 - LONELY)))
        for axis, sign in ends:
            while _number(packing, flown) <= most and (
                group := _group_at_end(packing, left, axis, sign, far)
            ):
                left[group] = False
                flown += group
    return grains & ~left


def _number(packing: Packing, rows: IntArray | list[int]) -> int:
    """How many grains some spheres are, by their rows."""
    return len(rows) if packing.bodies is None else len(np.unique(packing.bodies.head[rows]))


def _group_at_end(
    packing: Packing, left: BoolArray, axis: int, sign: float, far: float
) -> list[int]:
    """The outermost grain along an axis with the grains near it; none if they are too many."""
    along, radius = packing.position[:, axis], packing.radius
    group = [int(np.argmax(np.where(left, sign * along + radius, -np.inf)))]
    most = min(TOGETHER, _number(packing, np.flatnonzero(left)) // 2)
    for member in group:
        # only grains in a layer around this one can be near enough
        layer = far + radius[member] + radius.max()
        rows = np.flatnonzero(left & (np.abs(along - along[member]) <= layer))
        near = rows[_gaps(packing, member, rows) <= far]
        group += [row for row in near.tolist() if row not in group]
        if _number(packing, group) > most:
            return []
    return group


def _gaps(packing: Packing, row: int, others: IntArray) -> FloatArray:
    """Gaps between the surfaces of a particle and of the nearest images of others."""
    branch = packing.position[others] - packing.position[row]
    if packing.cell is not None:
        branch = branch + packing.cell.nearest_image(branch) @ packing.cell.vectors
    distance = np.sqrt(np.einsum("ij,ij->i", branch, branch))
    return np.asarray(distance - packing.radius[others] - packing.radius[row])
