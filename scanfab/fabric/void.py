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

from scanfab.fabric.tensor import FabricTensor, axial
from scanfab.scan import ScanSums

__all__ = ["VoidFabric", "void_fabric"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VoidFabric:
    """Void fabric of one variant, with the scan's standard error."""

    tensor: FabricTensor
    """Mean over the replicates."""
    mean_length: float
    """Σ w·sum / Σ w·count, dump's length unit."""
    replicates: FloatArray
    """The tensor of each replicate, shape (R, 3, 3)."""
    filled: float
    """Fraction of a replicate's axes without any kept segment, given the mean of the others."""

    def axial_error(self, axis: npt.ArrayLike) -> float | None:
        """
        Standard error of the axial anisotropy, from the scatter of the replicates.

        It covers the scan alone (which lines were drawn), not the sample; None for one replicate.
        """
        count = len(self.replicates)
        if count < 2:
            return None
        return float(np.std(axial(self.replicates, axis), ddof=1) / np.sqrt(count))


def void_fabric(sums: ScanSums, weights: FloatArray, variant: str) -> VoidFabric | None:
    """
    The void fabric of one variant of a scan.

    In each replicate ℓ(n) is the length of an axis' kept segments divided by their number, over
    all lines of the axis together: a mean of per-line means invents anisotropy.

    Parameters
    ----------
    sums : ScanSums
        Of all replicates.
    weights : ndarray, shape (D,)
        The direction rule's weights.
    variant : str
        One of a, b, c, d.

    Returns
    -------
    VoidFabric or None
        None if some axis keeps no segment in all replicates together.
    """
    which = "abcd".index(variant)
    length, segments = sums.length[:, which], sums.segments[:, which]
    total_length, total_segments = length.sum(axis=0), segments.sum(axis=0)
    if np.any(total_segments == 0):
        return None
    empty = segments == 0
    # an axis that kept nothing in one replicate takes its mean over the others
    mean = np.where(empty, total_length / total_segments, length / np.where(empty, 1, segments))
    weighted = weights * mean
    tensors = np.einsum("rd,rdi,rdj->rij", weighted, sums.axes, sums.axes)
    tensors /= weighted.sum(axis=1)[:, None, None]
    return VoidFabric(
        tensor=FabricTensor(tensors.mean(axis=0)),
        mean_length=float((weights @ total_length) / (weights @ total_segments)),
        replicates=tensors,
        filled=float(empty.mean()),
    )
