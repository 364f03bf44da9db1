"""
Is a sample homogeneous: do its blocks scatter more than their errors?

An analysis of variance (Fisher 1925): the variance between blocks against that which the jackknife
over the parts of each block, and the noise of the scan, make between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.typing import FloatArray

# blocks that a test is of
FEWEST = 3


class Homogeneity(NamedTuple):
    """What the scatter of blocks says."""

    ratio: float
    """Of their scatter to what their errors explain: 1 in the mean of homogeneous samples."""
    chance: float
    """That blocks of a homogeneous sample scatter so much or more."""
    blocks: int
    """How many there are."""


def homogeneity_of(
    values: FloatArray, variances: FloatArray, weights: FloatArray, freedom: float
) -> Homogeneity | None:
    """
    Whether values of blocks scatter more than their errors explain.

    With weights w of the sum W, and x̄ = Σ w x / W, the variance ratio is
    F = Σ w (x - x̄)² / Σ w (1 - w/W) v. Both sums have the same expectation where all blocks have
    one and errors are right; F then follows Fisher's distribution with B - 1 degrees of freedom
    and those of the pooled errors, after Satterthwaite (1946), doi:10.2307/3002019.

    Parameters
    ----------
    values : ndarray, shape (B,)
        Of the blocks.
    variances : ndarray, shape (B,)
        Squared standard errors v; NaN where there is none: such blocks are left out.
    weights : ndarray, shape (B,)
        About proportional to what the inverse of v is expected to be.
    freedom : float
        Degrees of freedom of each variance.

    Returns
    -------
    Homogeneity or None
        None of fewer than three blocks.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.homogeneity import homogeneity_of
    >>> x = np.random.default_rng(3).normal(size=(20, 8))
    >>> words = x.var(axis=1, ddof=1) / 8, np.ones(20), 7.0
    >>> homogeneity_of(x.mean(axis=1), *words).chance > 0.05
    True
    >>> shifted = x.mean(axis=1) + np.linspace(-1, 1, 20)
    >>> homogeneity_of(shifted, *words).chance < 0.001
    True
    """
    # loaded here, as few need it
    from scipy.special import fdtrc

    known = np.isfinite(values) & np.isfinite(variances) & (variances > 0) & (weights > 0)
    values, variances, weights = values[known], variances[known], weights[known]
    count = len(values)
    if count < FEWEST:
        return None
    share = weights / weights.sum()
    between = float(np.sum(share * (values - share @ values) ** 2))
    parts = share * (1.0 - share) * variances
    within = float(parts.sum())
    pooled = freedom * within**2 / float(np.sum(parts**2))
    # squares of variances that are themselves uncertain are too large by this in the mean
    pooled *= 1.0 + 2.0 / freedom
    statistic = between / within
    return Homogeneity(np.sqrt(statistic), float(fdtrc(count - 1, pooled, statistic)), count)
