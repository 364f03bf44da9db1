"""
Void fabric block by block: tensors of all blocks at once, with both of their errors.

Whether blocks scatter more than their errors is told by an analysis of variance (Fisher 1925).

As :mod:`scanfab.fabric.void` and :mod:`scanfab.fabric.jackknife` have them for one sample, but that
an axis without any segment takes its block's mean length in the same replicate, so that replicates
need not be kept axis by axis: of a thousand blocks these would be too many.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.tensor import COMPONENTS

# of the replicates' axes without a segment: with more the filled ones would look isotropic
MOST_FILLED = 0.05
# parts of a block without which there is no telling how much they differ
FEWEST_PARTS = 4
# blocks without which there is no telling whether they differ
FEWEST_BLOCKS = 3


@dataclass(frozen=True, eq=False)
class BlockFabrics:
    """The void fabrics of all blocks, of one variant."""

    replicates: FloatArray
    """The components of each replicate's tensors, xx, yy, zz, xy, xz, yz, shape (R, B, 6)."""
    length: FloatArray
    """Σ w·sum of each replicate, dump's length unit, shape (R, B)."""
    number: FloatArray
    """Σ w·count of each replicate, shape (R, B)."""
    segments: FloatArray
    """Kept segments of each replicate, shape (R, B)."""
    filled: FloatArray
    """Fraction of a replicate's axes without any kept segment, shape (R, B)."""

    @classmethod
    def of(
        cls, axes: FloatArray, weights: FloatArray, length: FloatArray, number: FloatArray
    ) -> BlockFabrics:
        """
        From the sums of a scan.

        Parameters
        ----------
        axes : ndarray, shape (R, D, 3)
            Unit vectors of each replicate.
        weights : ndarray, shape (D,)
            The direction rule's weights.
        length, number : ndarray, shape (R, D, B)
            Of the kept segments, as :func:`scanfab.void_fabric` takes them.
        """
        tensors, filled = _tensors(axes, weights, length, number)
        return cls(
            tensors,
            np.einsum("d,rdb->rb", weights, length),
            np.einsum("d,rdb->rb", weights, number),
            number.sum(axis=1),
            filled,
        )

    @property
    def exists(self) -> BoolArray:
        """Whether a block has enough segments for a fabric, shape (B,)."""
        return np.asarray((self.filled.mean(axis=0) <= MOST_FILLED) & self.is_met)

    @property
    def is_met(self) -> BoolArray:
        """Whether a block has any segment, shape (B,)."""
        return np.asarray(self.number.sum(axis=0) > 0)

    @property
    def mean_length(self) -> FloatArray:
        """Σ w·sum / Σ w·count, dump's length unit, shape (B,); NaN without segments."""
        return _ratio(self.length.sum(axis=0), self.number.sum(axis=0))

    @property
    def tensors(self) -> FloatArray:
        """Mean over the replicates, shape (B, 3, 3)."""
        found = np.empty((self.replicates.shape[1], 3, 3))
        for k, (i, j) in enumerate(COMPONENTS.values()):
            found[:, i, j] = found[:, j, i] = self.replicates[..., k].mean(axis=0)
        return found

    def axial_errors(self, axis: FloatArray) -> FloatArray:
        """Standard errors of the axial anisotropies by the scan; NaN for one replicate; (B,)."""
        count = len(self.replicates)
        if count < 2:
            return np.full(self.replicates.shape[1], np.nan)
        values = along(self.replicates, axis)
        return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(count))


@dataclass(frozen=True, eq=False)
class WithoutParts:
    """What becomes of each block without each of its parts, shapes (R, B, P)."""

    axial: FloatArray
    """The void fabric's axial anisotropy."""
    mean_length: FloatArray
    """Dump's length unit."""
    segments: FloatArray
    """Kept in the part."""

    @classmethod
    def of(
        cls,
        axes: FloatArray,
        weights: FloatArray,
        length: FloatArray,
        number: FloatArray,
        axis: FloatArray,
    ) -> WithoutParts:
        """From the sums of a scan as of :class:`BlockFabrics`, shape (R, D, B, P)."""
        rest_length = length.sum(axis=3, keepdims=True) - length
        # what rounding leaves of nothing is none
        rest = np.maximum(number.sum(axis=3, keepdims=True) - number, 0.0)
        count = length.shape
        flat = (*count[:2], count[2] * count[3])
        tensors, _ = _tensors(axes, weights, rest_length.reshape(flat), rest.reshape(flat))
        shape = (count[0], *count[2:])
        over, under = (np.einsum("d,rdbp->rbp", weights, one) for one in (rest_length, rest))
        return cls(along(tensors, axis).reshape(shape), _ratio(over, under), number.sum(axis=1))

    @property
    def is_met(self) -> BoolArray:
        """Which parts have any segment, shape (B, P)."""
        return np.asarray(self.segments.sum(axis=0) > 0)


def along(components: FloatArray, axis: FloatArray) -> FloatArray:
    """The axial anisotropy of tensors by their six components, (..., 6) to (...)."""
    factors = np.array([axis[i] * axis[j] * (1 if i == j else 2) for i, j in COMPONENTS.values()])
    values: FloatArray = 1.5 * (components @ factors) - 0.5
    return values


def jackknife_errors(values: FloatArray, parts: BoolArray) -> FloatArray:
    """
    Standard errors from the values without each part, without what the scan's noise adds.

    Parameters
    ----------
    values : ndarray, shape (R, B, P)
        Of each replicate; all have the same parts.
    parts : ndarray of bool, shape (B, P)
        Those that hold anything.

    Returns
    -------
    ndarray, shape (B,)
        NaN where too few parts hold anything, or the noise hides the scatter.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.blocks import jackknife_errors
    >>> x = np.array([1.0, 2.0, 4.0, 7.0])
    >>> means = (x.sum() - x) / 3
    >>> error = jackknife_errors(means[None, None], np.ones((1, 4), bool))
    >>> bool(np.isclose(error[0], x.std(ddof=1) / 2))
    True
    """
    count = len(values)
    variance = _variances(values.mean(axis=0), parts)
    if count > 1:
        # as in jackknife.variance_without_noise
        single = np.mean([_variances(one, parts) for one in values], axis=0)
        variance = (count * variance - single) / (count - 1)
    known = (parts.sum(axis=1) >= FEWEST_PARTS) & (variance > 0)
    return np.where(known, np.sqrt(np.where(known, variance, 1.0)), np.nan)


def ratio_jackknife(over: FloatArray, under: FloatArray) -> FloatArray:
    """Errors of Σ over / Σ under, by sums over each part, shape (B, P), to (B,)."""
    rest_over = over.sum(axis=1, keepdims=True) - over
    rest = _ratio(rest_over, under.sum(axis=1, keepdims=True) - under)
    parts = (under > 0) & np.isfinite(rest)
    return jackknife_errors(np.where(parts, rest, 0.0)[None], parts)


def _variances(values: FloatArray, parts: BoolArray) -> FloatArray:
    """Of the jackknife, (B, P) to (B,); parts that hold nothing do not count."""
    number = np.maximum(parts.sum(axis=1), 1)
    kept = np.where(parts, values, 0.0)
    off = np.where(parts, values - (kept.sum(axis=1) / number)[:, None], 0.0)
    return np.asarray((off**2).sum(axis=1) * (number - 1) / number)


def _tensors(
    axes: FloatArray, weights: FloatArray, length: FloatArray, number: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Σ w ℓ n⊗n / Σ w ℓ of sums (R, D, B) by components, (R, B, 6), and filled axes, (R, B)."""
    empty = number <= 0
    over, under = (np.einsum("d,rdb->rb", weights, one) for one in (length, number))
    # a block without anything gets the tensor of an isotropic one, and is not shown
    usual = np.where(under > 0, over / np.where(under > 0, under, 1.0), 1.0)
    mean = np.where(empty, usual[:, None], length / np.where(empty, 1.0, number))
    mean *= weights[:, None]
    products = np.stack([axes[..., i] * axes[..., j] for i, j in COMPONENTS.values()], axis=-1)
    tensors = np.matmul(np.swapaxes(mean, 1, 2), products) / mean.sum(axis=1)[..., None]
    return tensors, empty.mean(axis=1)


def _ratio(over: FloatArray, under: FloatArray) -> FloatArray:
    """NaN where there is nothing to divide by."""
    return np.where(under > 0, over / np.where(under > 0, under, 1.0), np.nan)


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
    Whether values of blocks scatter more than their errors explain: an analysis of variance.

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
    >>> from scanfab.fabric.blocks import homogeneity_of
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
