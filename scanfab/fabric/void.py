"""
Void fabric by scan lines: G_vs = Σ w ℓ n⊗n / Σ w ℓ, Eq. 1 of the 2017 paper with weights.

Theocharis, Vairaktaris and Dafalias (2017), Powders and Grains 2017, EPJ Web of
Conferences 140, after Oda, Nemat-Nasser and Konishi (1985),
doi:10.3208/sandf1972.25.3_85. In the paper all weights w of directions are 1; see
docs/details/directions-and-errors.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.fabric.distribution import even_polynomials
from scanfab.fabric.errors import error_of_mean, ratio
from scanfab.fabric.tensor import FabricTensor, axial, weighted_tensors

# Axes that keep no segment are filled with a mean length, which makes the tensor look isotropic.
# If more than this fraction is empty, there is no fabric. The limit for the blocks of a map is
# stricter, because their axes are filled with the mean of the block itself.
MOST_FILLED, MOST_FILLED_IN_BLOCK = 0.5, 0.05
# Highest degree of the polynomial fitted to mean lengths, by dimension. For discs the mean lengths
# vary faster with direction, and each even degree adds only two terms.
MOST_EVEN = {3: 8, 2: 16}


@dataclass(frozen=True, eq=False)
class VoidFabric:
    """
    Void fabric of a variant, with its standard error due to the scan.

    Attributes
    ----------
    tensor : FabricTensor
        Fabric tensor, the mean over the replicates.
    mean_length : float
        Mean length of the kept segments, Σ w·sum / Σ w·count, dump's length unit.
    replicates : ndarray
        Fabric tensor of each replicate, shape (R, 3, 3).
    axes : ndarray
        Unit vectors of each replicate, shape (R, D, 3).
    weights : ndarray
        Weights w of the direction rule, shape (D,).
    mean_lengths : ndarray
        Mean length ℓ for each replicate and axis, shape (R, D), dump's length unit.
    filled : float
        Fraction of axes that keep no segment in a replicate and take the other replicates' mean.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import void_fabric
    >>> ones = np.ones((1, 3))
    >>> void_fabric(np.eye(3)[None], np.ones(3) / 3, ones * [1, 1, 2], ones)
    VoidFabric: mean length 1.333 (dump's unit), 1 replicate of 3 axes
      FabricTensor: alpha 0.25, principal values 0.5, 0.25, 0.25, major axis (0, 0, 1)
    """

    tensor: FabricTensor
    mean_length: float
    replicates: FloatArray
    axes: FloatArray
    weights: FloatArray
    mean_lengths: FloatArray
    filled: float

    def __repr__(self) -> str:
        count, axes = self.mean_lengths.shape
        return (
            f"VoidFabric: mean length {self.mean_length:.4g} (dump's unit), "
            f"{counted(count, 'replicate')} of {counted(axes, 'axis', 'axes')}\n  {self.tensor!r}"
        )

    def axial_error(self, axis: npt.ArrayLike) -> float | None:
        """
        Standard error of the axial anisotropy due to the scan, from the scatter of the replicates.

        It covers the choice of lines, not the choice of the sample.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Unit vector.

        Returns
        -------
        float or None
            Dimensionless; None for a single replicate.
        """
        return error_of_mean(axial(self.replicates, axis, self.tensor.space))

    def expected_error(self, axis: npt.ArrayLike, degree: int | None = None) -> float | None:
        """
        Standard error due to the scan, from the scatter of mean lengths about an even polynomial.

        With few replicates it is far less noisy than :meth:`axial_error`, because every axis
        counts. But it depends on the polynomial, so it serves to plan scans.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Unit vector.
        degree : int, optional
            Degree that the direction rule integrates exactly. Lengths that the rule integrates
            exactly cause no error, so the polynomial has the highest even degree, from 4 to 8 (in a
            plane to 16), whose product with n⊗n is exact.

        Returns
        -------
        float or None
            Dimensionless; None if there are too few mean lengths for the polynomial.
        """
        count = len(self.mean_lengths)
        space = self.tensor.space
        even = min(max((degree or 0) // 2 * 2 - 2, 4), MOST_EVEN[space.dimension])
        design = even_polynomials(self.axes.reshape(-1, 3), even, space)
        lengths, terms = self.mean_lengths.ravel(), design.shape[1]
        if len(lengths) < 3 * terms:
            return None
        # there are many more lengths than terms, so the faster normal equations are accurate enough
        fit = np.linalg.lstsq(design.T @ design, design.T @ lengths, rcond=None)[0]
        variance = np.sum((lengths - design @ fit) ** 2) / (len(lengths) - terms)
        # derivative of the axial anisotropy, a ratio of sums over axes, by each mean length
        along = space.axial((self.axes @ np.asarray(axis, dtype=float)) ** 2)
        slope = self.weights * (along - self.tensor.axial(axis))
        slope /= (self.mean_lengths @ self.weights)[:, None]
        return float(np.sqrt(variance * np.sum(slope**2)) / count)


def void_fabric(
    axes: FloatArray,
    weights: FloatArray,
    length: FloatArray,
    segments: FloatArray | IntArray,
    space: Space = SPACE,
) -> VoidFabric | None:
    """
    Compute the void fabric from the sums of a scan.

    In each replicate, the mean length ℓ(n) of an axis is the total length of its kept segments, on
    all lines together, divided by their number. A mean of per-line means would be biased and show
    anisotropy where there is none.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors of each replicate.
    weights : ndarray, shape (D,)
        The direction rule's weights.
    length : ndarray, shape (R, D)
        Total length of the kept segments, dump's length unit.
    segments : ndarray, shape (R, D)
        Number of the kept segments. For the second moment, give the sums of squared lengths and of
        lengths in place of length and number.
    space : Space, optional
        The plane of the axes, if the grains are discs.

    Returns
    -------
    VoidFabric or None
        None if an axis keeps no segment in any replicate, or if more than half of all axes keep no
        segment in their replicate, because the filled tensor would look isotropic.

    References
    ----------
    Theocharis, Vairaktaris and Dafalias, 3D scan line method for identifying void fabric of
    granular materials, Powders and Grains 2017, EPJ Web of Conferences 140, Eq. 1.

    Oda, Nemat-Nasser and Konishi, 1985, doi:10.3208/sandf1972.25.3_85.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import void_fabric
    >>> ones = np.ones((1, 3))
    >>> void_fabric(np.eye(3)[None], np.ones(3) / 3, ones * [1, 1, 2], ones).tensor.matrix[2, 2]
    np.float64(0.5)
    """
    total_length, total_segments = length.sum(axis=0), segments.sum(axis=0)
    if np.any(total_segments == 0):
        return None
    empty = segments == 0
    if empty.mean() > MOST_FILLED:
        return None
    # an axis without segments in a replicate takes its mean length over the other replicates
    mean = np.where(empty, total_length / total_segments, length / np.where(empty, 1, segments))
    tensors = weighted_tensors(axes, weights * mean)
    return VoidFabric(
        tensor=FabricTensor(tensors.mean(axis=0), space),
        mean_length=float((weights @ total_length) / (weights @ total_segments)),
        replicates=tensors,
        axes=axes,
        weights=weights,
        mean_lengths=mean,
        filled=float(empty.mean()),
    )


@dataclass(frozen=True, eq=False)
class BlockFabrics:
    """
    Void fabrics of many blocks, or of blocks without each part, in R replicates.

    Unlike in :class:`VoidFabric`, an axis without segments takes the mean length of its block in
    the same replicate, so the sums of each axis need not be kept for all replicates: with a
    thousand blocks they would fill the memory. ``(...)`` stands for the shape of the blocks.
    """

    tensors: FloatArray
    """Fabric tensors, shape (R, ..., 3, 3); isotropic for a block without segments."""
    length: FloatArray
    """Weighted total length Σ w·sum, dump's length unit, shape (R, ...)."""
    number: FloatArray
    """Weighted number of segments Σ w·count, shape (R, ...)."""
    segments: FloatArray
    """Number of kept segments, shape (R, ...)."""
    filled: FloatArray
    """Fraction of the axes without a kept segment, shape (R, ...)."""

    @property
    def is_met(self) -> BoolArray:
        """Whether each block has any segment, shape (...)."""
        return np.asarray(self.number.sum(axis=0) > 0)

    @property
    def exists(self) -> BoolArray:
        """Whether each block has enough segments for a fabric, shape (...)."""
        return np.asarray((self.filled.mean(axis=0) <= MOST_FILLED_IN_BLOCK) & self.is_met)

    def axial_errors(self, axis: FloatArray) -> FloatArray:
        """Standard errors of axial anisotropies due to the scan, (...); NaN with one replicate."""
        values = axial(self.tensors, axis)
        if len(values) < 2:
            return np.full(values.shape[1:], np.nan)
        return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def block_fabrics(
    axes: FloatArray, weights: FloatArray, length: FloatArray, number: FloatArray
) -> BlockFabrics:
    """
    Compute the void fabrics of blocks from the sums of a scan.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors of each replicate.
    weights : ndarray, shape (D,)
        The direction rule's weights.
    length, number : ndarray, shape (R, D, ...)
        Total length and number of the kept segments, as for :func:`scanfab.void_fabric`.
    """
    empty = number <= 0
    over, under = (np.einsum("d,rd...->r...", weights, values) for values in (length, number))
    usual = np.where(under > 0, ratio(over, under), 1.0)
    mean = np.where(empty, usual[:, None], ratio(length, number))
    mean *= weights.reshape(-1, *[1] * (mean.ndim - 2))
    tensors = weighted_tensors(axes, mean)
    return BlockFabrics(tensors, over, under, number.sum(axis=1), empty.mean(axis=1))
