"""
Void fabric block by block, and standard errors from the parts of each block.

It is that of :mod:`scanfab.fabric.void`, but an axis without any segment takes the mean length of
its block in the same replicate, so that replicates need not be kept axis by axis: of a thousand
blocks these would be too many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.errors import variance_without_noise
from scanfab.fabric.tensor import axial, weighted_tensors

# of the replicates' axes without a segment: with more the filled ones would look isotropic
MOST_FILLED = 0.05
# parts of a block without which there is no telling how much they differ
FEWEST_PARTS = 4


@dataclass(frozen=True, eq=False)
class BlockFabrics:
    """Tensors and sums of R replicates in blocks, or without their parts, of a shape ``(...)``."""

    tensors: FloatArray
    """Fabric tensors, shape (R, ..., 3, 3); that of a block without anything is isotropic."""
    length: FloatArray
    """Σ w·sum, dump's length unit, shape (R, ...)."""
    number: FloatArray
    """Σ w·count, shape (R, ...)."""
    segments: FloatArray
    """Kept segments, shape (R, ...)."""
    filled: FloatArray
    """Fraction of the axes without any kept segment, shape (R, ...)."""

    @property
    def is_met(self) -> BoolArray:
        """Whether a block has any segment, shape (...)."""
        return np.asarray(self.number.sum(axis=0) > 0)

    @property
    def exists(self) -> BoolArray:
        """Whether a block has enough segments for a fabric, shape (...)."""
        return np.asarray((self.filled.mean(axis=0) <= MOST_FILLED) & self.is_met)

    def axial_errors(self, axis: FloatArray) -> FloatArray:
        """Standard errors of the axial anisotropies by the scan; NaN for one replicate; (...)."""
        values = axial(self.tensors, axis)
        if len(values) < 2:
            return np.full(values.shape[1:], np.nan)
        return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def block_fabrics(
    axes: FloatArray, weights: FloatArray, length: FloatArray, number: FloatArray
) -> BlockFabrics:
    """
    The void fabrics of blocks from the sums of a scan.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors of each replicate.
    weights : ndarray, shape (D,)
        The direction rule's weights.
    length, number : ndarray, shape (R, D, ...)
        Of the kept segments, as :func:`scanfab.void_fabric` takes them.
    """
    empty = number <= 0
    over, under = (np.einsum("d,rd...->r...", weights, one) for one in (length, number))
    usual = np.where(under > 0, ratio(over, under), 1.0)
    mean = np.where(empty, usual[:, None], ratio(length, number))
    mean *= weights.reshape(-1, *[1] * (mean.ndim - 2))
    tensors = weighted_tensors(axes, mean)
    return BlockFabrics(tensors, over, under, number.sum(axis=1), empty.mean(axis=1))


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
    >>> from scanfab.fabric.blocks import part_errors
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
