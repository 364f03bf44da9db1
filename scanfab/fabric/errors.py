"""
Standard errors: of means, of a sample by a jackknife over its parts, and what they say of blocks.

The delete-one jackknife leaves out one part of the sample after the other, and asks how much a
value moves. That says how far another sample of the same material would differ; the error of the
scan says nothing of it. Efron and Stein (1981), doi:10.1214/aos/1176345462.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray

# parts of a sample: octants about its centre; of discs the first four, quadrants of their plane
BLOCKS = 8
# parts of a block without which there is no telling how much they differ, and blocks likewise
FEWEST_PARTS, FEWEST_BLOCKS = 4, 3


def error_of_mean(values: FloatArray) -> float | None:
    """Standard error of the mean of independent values, shape (M,); None for fewer than two."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None


def jackknife_variance(values: FloatArray, held: BoolArray | bool = True) -> FloatArray:
    """
    Squared standard error from the values without each of P parts: (P - 1)/P Σ (θ_p - θ̄)².

    Parameters
    ----------
    values : ndarray, shape (P, ...)
        Without each part.
    held : ndarray of bool, shape (P, ...), optional
        Which parts hold anything; the others do not count. All by default.

    Returns
    -------
    ndarray, shape (...)

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.errors import jackknife_variance
    >>> x = np.array([1.0, 2.0, 4.0])
    >>> means = (x.sum() - x) / 2
    >>> bool(np.isclose(jackknife_variance(means), x.var(ddof=1) / 3))
    True
    """
    held = np.broadcast_to(held, values.shape)
    number = np.maximum(held.sum(axis=0), 1)
    mean = np.where(held, values, 0.0).sum(axis=0) / number
    spread = np.where(held, (values - mean) ** 2, 0.0).sum(axis=0)
    return np.asarray(spread * (number - 1) / number)


def variance_without_noise(values: FloatArray, held: BoolArray | bool = True) -> FloatArray:
    """
    Jackknife variance of the mean over replicates, without what their own noise adds.

    Parameters
    ----------
    values : ndarray, shape (P, R, ...)
        Without each of P parts, in each of R replicates, which have the parts in common.
    held : ndarray of bool, shape (P, ...), optional
        Which parts hold anything; all by default.

    Returns
    -------
    ndarray, shape (...)
        Unbiased, so negative at times where the noise is the larger part. With one replicate the
        noise is not known and stays in.
    """
    count = values.shape[1]
    of_mean = jackknife_variance(values.mean(axis=1), held)
    if count == 1:
        return of_mean
    # of one replicate: the sample's scatter, and R times the noise that the mean has
    in_each = held if isinstance(held, bool) else held[:, None]
    of_single = jackknife_variance(values, in_each).mean(axis=0)
    return np.asarray((count * of_mean - of_single) / (count - 1))


class Jackknife(NamedTuple):
    """A value of the sample without each of its P parts."""

    shift: FloatArray
    """By how much leaving out each part moves the value, shape (P,)."""
    error: float | None
    """The standard error that follows; None if the scan's noise hides it."""
    half: FloatArray
    """
    How far the first replicate lies above the mean of all, without each part: of two replicates
    half their difference. Shape (P,).

    From these the noise of the scan is known in whatever is made of several frames, such as a
    slope. 0 where nothing is scanned, as for contacts.
    """


def jackknife(values: FloatArray) -> Jackknife:
    """
    The standard error of the sample, from a value of the whole and without each part.

    The noise that the scan adds to the scatter between parts is known from its replicates, and
    taken off. If nothing is left there is no error: the lines are too few to see it, which is no
    proof that there is none.

    Parameters
    ----------
    values : ndarray, shape (1 + P, R)
        Of the whole, then without each part, in each replicate; R is 1 where nothing is scanned.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.errors import jackknife
    >>> x = np.array([1.0, 2.0, 4.0])
    >>> means = np.append(x.mean(), (x.sum() - x) / 2)
    >>> bool(np.isclose(jackknife(means[:, None]).error, x.std(ddof=1) / np.sqrt(3)))
    True
    """
    means, without = values.mean(axis=1), values[1:]
    variance = float(variance_without_noise(without))
    is_hidden = variance <= 0.0 and values.shape[1] > 1
    error = None if is_hidden else math.sqrt(variance)
    return Jackknife(means[1:] - means[0], error, without[:, 0] - means[1:])


def part_errors(values: FloatArray, held: BoolArray) -> FloatArray:
    """
    Standard errors from the values without each part, without what the scan's noise adds.

    Parameters
    ----------
    values : ndarray, shape (R, B, P)
        Of each replicate; all have the same parts.
    held : ndarray of bool, shape (B, P)
        The parts that hold anything.

    Returns
    -------
    ndarray, shape (B,)
        NaN where too few parts hold anything, or the noise hides the scatter.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.errors import part_errors
    >>> x = np.array([1.0, 2.0, 4.0, 7.0])
    >>> means = (x.sum() - x) / 3
    >>> error = part_errors(means[None, None], np.ones((1, 4), bool))
    >>> bool(np.isclose(error[0], x.std(ddof=1) / 2))
    True
    """
    variance = variance_without_noise(np.moveaxis(values, -1, 0), held.T)
    known = (held.sum(axis=1) >= FEWEST_PARTS) & (variance > 0)
    return np.sqrt(np.where(known, variance, np.nan))


def ratio_with_errors(over: FloatArray, under: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Σ over / Σ under and its errors, shape (B,), from sums over each part, shape (B, P)."""
    above, below = over.sum(axis=1, keepdims=True), under.sum(axis=1, keepdims=True)
    rest = ratio(above - over, below - under)
    held = (under > 0) & np.isfinite(rest)
    return ratio(above, below)[:, 0], part_errors(rest[None], held)


def ratio(over: FloatArray, under: FloatArray) -> FloatArray:
    """NaN where there is nothing to divide by."""
    return np.where(under > 0, over / np.where(under > 0, under, 1.0), np.nan)


class Homogeneity(NamedTuple):
    """Whether blocks scatter more than their errors explain."""

    ratio: float
    """Scatter of the blocks over what their errors explain; about 1 in homogeneous samples."""
    chance: float
    """Probability that the blocks of a homogeneous sample scatter as much or more."""
    blocks: int
    """Number of blocks."""


def homogeneity_of(
    values: FloatArray, variances: FloatArray, weights: FloatArray, freedom: float
) -> Homogeneity | None:
    """
    Whether values of blocks scatter more than their errors explain: an analysis of variance.

    With weights w of the sum W, and x̄ = Σ w x / W, the variance ratio is
    F = Σ w (x - x̄)² / Σ w (1 - w/W) v. Both sums have the same expectation where all blocks have
    one and errors are right; F then follows Fisher's distribution (Fisher 1925) with B - 1 degrees
    of freedom and those of the pooled errors, after Satterthwaite (1946), doi:10.2307/3002019.

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
    >>> from scanfab.fabric.errors import homogeneity_of
    >>> x = np.random.default_rng(3).normal(size=(20, 8))
    >>> words = x.var(axis=1, ddof=1) / 8, np.ones(20), 7.0
    >>> homogeneity_of(x.mean(axis=1), *words).chance > 0.05
    True
    >>> shifted = x.mean(axis=1) + np.linspace(-1, 1, 20)
    >>> homogeneity_of(shifted, *words).chance < 0.001
    True
    """
    # imported here because few scans need it
    from scipy.special import fdtrc

    known = np.isfinite(values) & np.isfinite(variances) & (variances > 0) & (weights > 0)
    values, variances, weights = values[known], variances[known], weights[known]
    count = len(values)
    if count < FEWEST_BLOCKS:
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
