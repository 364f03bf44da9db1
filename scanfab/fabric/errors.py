"""
Standard errors of means and of samples, and a test whether a sample is homogeneous.

The delete-one jackknife leaves out each part of the sample in turn and measures how much a value
changes. This estimates how much other samples of the same material would differ, which the error of
the scan does not include. Source: Efron and Stein (1981), doi:10.1214/aos/1176345462.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray

# number of blocks of a sample: octants about its centre; discs use the first four, as quadrants
BLOCKS = 8
# fewest parts of a block for a standard error, and fewest blocks for the test of homogeneity
FEWEST_PARTS, FEWEST_BLOCKS = 4, 3


def error_of_mean(values: FloatArray) -> float | None:
    """Standard error of the mean of independent values, shape (M,); None for fewer than two."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None


def jackknife_variance(values: FloatArray, held: BoolArray | bool = True) -> FloatArray:
    """
    Squared standard error by the delete-one jackknife: (P - 1)/P Σ (θ_p - θ̄)².

    Parameters
    ----------
    values : ndarray, shape (P, ...)
        Values θ_p, each computed without one of the P parts.
    held : ndarray of bool, shape (P, ...), optional
        Which parts are not empty; empty parts are ignored. Default: all.

    Returns
    -------
    ndarray, shape (...)
        In the unit of the values squared.

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
    Jackknife variance of the mean over replicates, minus the noise of the scan.

    Parameters
    ----------
    values : ndarray, shape (P, R, ...)
        Values without each of P parts, in each of R replicates of the scan.
    held : ndarray of bool, shape (P, ...), optional
        Which parts are not empty. Default: all.

    Returns
    -------
    ndarray, shape (...)
        Unbiased variance, which may be negative if noise dominates. A single replicate does not
        show its noise, so nothing is subtracted.
    """
    count = values.shape[1]
    of_mean = jackknife_variance(values.mean(axis=1), held)
    if count == 1:
        return of_mean
    # the variance of a single replicate has the sample's scatter plus R times the mean's noise
    in_each = held if isinstance(held, bool) else held[:, None]
    of_single = jackknife_variance(values, in_each).mean(axis=0)
    return np.asarray((count * of_mean - of_single) / (count - 1))


class Jackknife(NamedTuple):
    """How a value of the sample changes when each of its P parts is left out."""

    shift: FloatArray
    """Change of the value when each part is left out, shape (P,)."""
    error: float | None
    """Standard error due to the sample; None if it is hidden by the noise of the scan."""
    half: FloatArray
    """
    First replicate minus the mean of all replicates, without each part, shape (P,).

    For two replicates this is half their difference. It shows the noise of the scan in results
    from several frames, such as a slope. It is 0 for values that need no scan, as of contacts.
    """


def jackknife(values: FloatArray) -> Jackknife:
    """
    Standard error due to the sample, from values with and without each part.

    The replicates show how much noise the scan adds to the scatter between parts; this noise is
    subtracted. If nothing remains, the error is None: the scan has too few lines to resolve it,
    which does not mean that it is 0.

    Parameters
    ----------
    values : ndarray, shape (1 + P, R)
        Value of the whole sample, then without each part, in each replicate; R is 1 for values that
        need no scan.

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
    Standard errors of blocks by a jackknife over their parts, without the noise of the scan.

    Parameters
    ----------
    values : ndarray, shape (R, B, P)
        Values of B blocks without each of their P parts, in R replicates of the scan.
    held : ndarray of bool, shape (B, P)
        Which parts are not empty.

    Returns
    -------
    ndarray, shape (B,)
        NaN for a block with fewer than four filled parts, or if noise hides the scatter.

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
    usable = (held.sum(axis=1) >= FEWEST_PARTS) & (variance > 0)
    return np.sqrt(np.where(usable, variance, np.nan))


def ratio_with_errors(over: FloatArray, under: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ratio of totals and its standard error, shape (B,), from sums over parts, shape (B, P)."""
    above, below = over.sum(axis=1, keepdims=True), under.sum(axis=1, keepdims=True)
    rest = ratio(above - over, below - under)
    held = (under > 0) & np.isfinite(rest)
    return ratio(above, below)[:, 0], part_errors(rest[None], held)


def ratio(over: FloatArray, under: FloatArray) -> FloatArray:
    """Quotient; NaN where the divisor is not above 0."""
    return np.where(under > 0, over / np.where(under > 0, under, 1.0), np.nan)


class Homogeneity(NamedTuple):
    """Whether blocks scatter more than their errors explain."""

    ratio: float
    """√F, the scatter of the blocks relative to their errors; about 1 in homogeneous samples."""
    chance: float
    """p-value: the probability of at least this scatter if the sample is homogeneous."""
    blocks: int
    """Number of blocks."""


def homogeneity_of(
    values: FloatArray, variances: FloatArray, weights: FloatArray, freedom: float
) -> Homogeneity | None:
    """
    Test whether blocks scatter more than their errors explain, by an analysis of variance.

    With weights w, W = Σ w and x̄ = Σ w x / W, the statistic is the variance ratio
    F = Σ w (x - x̄)² / Σ w (1 - w/W) v. Both sums have the same expected value if all blocks have
    the same true value x and the errors are right. F then follows Fisher's distribution (Fisher
    1925). Its degrees of freedom are B - 1 and those of the pooled errors, by Satterthwaite (1946),
    doi:10.2307/3002019.

    Parameters
    ----------
    values : ndarray, shape (B,)
        Values x of the blocks.
    variances : ndarray, shape (B,)
        Squared standard errors v; blocks with NaN are left out.
    weights : ndarray, shape (B,)
        Weights w, roughly proportional to the expected inverse of v.
    freedom : float
        Degrees of freedom of each variance.

    Returns
    -------
    Homogeneity or None
        None for fewer than three blocks.

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
    # imported here because only maps need it
    from scipy.special import fdtrc

    usable = np.isfinite(values) & np.isfinite(variances) & (variances > 0) & (weights > 0)
    values, variances, weights = values[usable], variances[usable], weights[usable]
    count = len(values)
    if count < FEWEST_BLOCKS:
        return None
    share = weights / weights.sum()
    between = float(np.sum(share * (values - share @ values) ** 2))
    parts = share * (1.0 - share) * variances
    within = float(parts.sum())
    pooled = freedom * within**2 / float(np.sum(parts**2))
    # the expected square of an estimated variance exceeds the square of the true one by this factor
    pooled *= 1.0 + 2.0 / freedom
    statistic = between / within
    return Homogeneity(np.sqrt(statistic), float(fdtrc(count - 1, pooled, statistic)), count)
