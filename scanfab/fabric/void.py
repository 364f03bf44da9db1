"""
Void fabric by scan lines: G_vs = Σ w ℓ n⊗n / Σ w ℓ, Eq. 1 of the 2017 paper with weights.

Theocharis, Vairaktaris and Dafalias (2017), Powders and Grains 2017, EPJ Web of
Conferences 140, after Oda, Nemat-Nasser and Konishi (1985),
doi:10.3208/sandf1972.25.3_85. As printed the weights w of the directions are 1; see docs/method.md.
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

# Of the replicates' axes without a segment, above which there is no fabric: with more the filled
# ones would look isotropic. A block's axes are filled with its own mean, which hides more.
MOST_FILLED, MOST_FILLED_IN_BLOCK = 0.5, 0.05
# By dimension, the highest degree of the polynomial that mean lengths are compared with. Those of
# discs vary faster with the direction, and a degree costs only two terms there.
MOST_EVEN = {3: 8, 2: 16}


@dataclass(frozen=True, eq=False)
class VoidFabric:
    """
    Void fabric of one variant, with the scan's standard error.

    Attributes
    ----------
    tensor : FabricTensor
        Mean over the replicates.
    mean_length : float
        Σ w·sum / Σ w·count, dump's length unit.
    replicates : ndarray
        The tensor of each replicate, shape (R, 3, 3).
    axes : ndarray
        Unit vectors of each replicate, shape (R, D, 3).
    weights : ndarray
        Of the direction rule, shape (D,).
    mean_lengths : ndarray
        ℓ of each replicate and axis, shape (R, D), dump's length unit.
    filled : float
        Fraction of a replicate's axes without any kept segment, given the mean of the others.

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
        Standard error of the axial anisotropy, from the scatter of the replicates.

        It covers the scan alone (which lines were drawn), not the sample.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Unit vector.

        Returns
        -------
        float or None
            None for one replicate.
        """
        return error_of_mean(axial(self.replicates, axis, self.tensor.space))

    def expected_error(self, axis: npt.ArrayLike, degree: int | None = None) -> float | None:
        """
        The same error from the scatter of the mean lengths about an even polynomial.

        Far less noisy for few replicates, as every axis counts, but it depends on the polynomial:
        good for planning a scan.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Unit vector.
        degree : int, optional
            The direction rule's: what it integrates exactly is no error, so the polynomial has the
            highest even degree, from 4 to 8 (to 16 in a plane), whose product with n⊗n is
            exact.

        Returns
        -------
        float or None
            None if there are too few mean lengths.
        """
        count = len(self.mean_lengths)
        space = self.tensor.space
        even = min(max((degree or 0) // 2 * 2 - 2, 4), MOST_EVEN[space.dimension])
        design = even_polynomials(self.axes.reshape(-1, 3), even, space)
        lengths, terms = self.mean_lengths.ravel(), design.shape[1]
        if len(lengths) < 3 * terms:
            return None
        # with many more lengths than terms the normal equations suffice and are much faster
        fit = np.linalg.lstsq(design.T @ design, design.T @ lengths, rcond=None)[0]
        variance = np.sum((lengths - design @ fit) ** 2) / (len(lengths) - terms)
        # derivative of the axial anisotropy, a ratio of sums over the axes, by each mean length
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
    The void fabric from the sums of a scan.

    In each replicate ℓ(n) is the length of an axis' kept segments divided by their number, over
    all lines of the axis together: a mean of per-line means invents anisotropy.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors of each replicate.
    weights : ndarray, shape (D,)
        The direction rule's weights.
    length : ndarray, shape (R, D)
        Sum of the lengths of the kept segments, dump's length unit.
    segments : ndarray, shape (R, D)
        Number of the kept segments. For the second moment, sums of squared lengths and of lengths
        take the places of these two.
    space : Space, optional
        The plane in which the axes lie, if the grains are discs.

    Returns
    -------
    VoidFabric or None
        None if some axis keeps no segment in all replicates together, or if most axes keep none in
        their replicate: a tensor of directions that were filled in would look isotropic.

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
    # an axis that kept nothing in one replicate takes its mean over the others
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
    The void fabrics of many blocks, or of each without its parts, in R replicates.

    Unlike in :class:`VoidFabric`, an axis that keeps no segment takes the mean length of its block
    in the same replicate. So sums need not be kept axis by axis; those of a thousand blocks would
    be too many. ``(...)`` stands for the shape of the blocks.
    """

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
        return np.asarray((self.filled.mean(axis=0) <= MOST_FILLED_IN_BLOCK) & self.is_met)

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
