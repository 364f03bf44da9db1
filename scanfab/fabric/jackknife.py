"""
The sample's own scatter: delete-one jackknife over blocks of the sample.

Leaving out one of eight blocks in turn, and asking how much the anisotropy moves, says how far
another sample of the same material would differ; the error of the scan says nothing of that. In a
plane there are four.
Efron and Stein (1981), doi:10.1214/aos/1176345462.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.column import Column
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.tensor import axial
from scanfab.fabric.void import void_fabric

if TYPE_CHECKING:
    from scanfab.fabric.measured import Measured


# octants, and columns of the table; in a plane the first four, which are quadrants
BLOCKS = 8
ORDER = (
    " (-x, -y, -z; x counts fastest; for an oblique loading axis the octants are turned so that "
    "one of their axes lies along it)"
)
# the anisotropies, by the names of their columns
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"

Sums = tuple[FloatArray, FloatArray | IntArray]
"""Lengths and numbers of the kept void segments, each of shape (R, D)."""


class BlockedSums(NamedTuple):
    """A scan whose void segments are told apart by the block that their middle is in."""

    axes: FloatArray
    """Unit vectors of each replicate, shape (R, D, 3)."""
    weights: FloatArray
    """Of the direction rule, shape (D,)."""
    full: Sums
    """Of all blocks; the lengths in the dump's length unit."""
    without: list[Sums]
    """Of all but one block, for each of them."""


class Jackknife(NamedTuple):
    """An axial anisotropy without each of the blocks."""

    shift: FloatArray
    """By how much leaving out each block moves the anisotropy, dimensionless."""
    error: float | None
    """The standard error that follows, dimensionless; None if the scan's noise hides it."""
    half: FloatArray
    """
    How far the first replicate's value lies above the mean of all, without each block: of two
    replicates half their difference.

    From these the noise of the scan is known in whatever is made of several frames, such as a
    slope. 0 for contacts, which are counted.
    """


def blocks_of(space: Space) -> int:
    """How many blocks the sample is parted into: octants, or quadrants."""
    return int(2**space.dimension)


def jackknife_error(values: FloatArray) -> float:
    """
    Standard error from the values without each of B blocks: √((B - 1)/B Σ (θ_b - θ̄)²).

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.jackknife import jackknife_error
    >>> x = np.array([1.0, 2.0, 4.0])
    >>> means = (x.sum() - x) / 2
    >>> bool(np.isclose(jackknife_error(means), x.std(ddof=1) / np.sqrt(3)))
    True
    """
    return float(np.sqrt(_variance(np.asarray(values, dtype=np.float64))))


def _variance(values: FloatArray) -> FloatArray:
    """Along the first axis."""
    count = len(values)
    spread: FloatArray = np.sum((values - values.mean(axis=0)) ** 2, axis=0)
    return spread * (count - 1) / count


def contact_jackknife(
    normals: npt.ArrayLike, blocks: npt.ArrayLike, axis: npt.ArrayLike, space: Space = SPACE
) -> Jackknife | None:
    """
    The contact fabric's axial anisotropy without the contacts of each block.

    Parameters
    ----------
    normals : array_like, shape (M, 3)
        Unit normals.
    blocks : array_like of int, shape (M,)
        The block of each contact's point, from 0.
    axis : array_like, shape (3,)
        Loading axis, a unit vector.
    space : Space, optional
        The plane in which they lie, if the grains are discs.

    Returns
    -------
    Jackknife or None
        None if one block holds all contacts.
    """
    along = space.axial((np.asarray(normals, dtype=np.float64) @ np.asarray(axis)) ** 2)
    places, count = np.asarray(blocks, dtype=np.int64), blocks_of(space)
    number = np.bincount(places, minlength=count)
    if np.any(number == len(along)):
        return None
    rest = (along.sum() - np.bincount(places, along, minlength=count)) / (len(along) - number)
    return Jackknife(rest - along.mean(), jackknife_error(rest), np.zeros(count))


def void_jackknife(
    sums: BlockedSums, axis: npt.ArrayLike, space: Space = SPACE
) -> Jackknife | None:
    """
    The void fabric's axial anisotropy without the segments of each block.

    Parameters
    ----------
    sums : BlockedSums
        Of a scan.
    axis : array_like, shape (3,)
        Loading axis, a unit vector.
    space : Space, optional
        The plane in which all lies, if the grains are discs.

    Returns
    -------
    Jackknife or None
        None if there is no void fabric without some block. What the scan's own noise adds to the
        scatter between blocks is known from its replicates, and taken off the error; where nothing
        is left, the error is None: too few lines to see it, which is no proof that there is none.
    """
    every = (sums.full, *sums.without)
    fabrics = [void_fabric(sums.axes, sums.weights, *one, space) for one in every]
    found = [axial(fabric.replicates, axis, space) for fabric in fabrics if fabric is not None]
    if len(found) < len(every):
        return None
    values = np.array(found)
    means = values.mean(axis=1)
    variance = variance_without_noise(values[1:])
    error = math.sqrt(variance) if variance > 0 else None
    return Jackknife(means[1:] - means[0], error, values[1:, 0] - means[1:])


def variance_without_noise(values: FloatArray) -> float:
    """
    Jackknife variance of the mean over replicates, without what their own noise adds.

    Parameters
    ----------
    values : ndarray, shape (B, R)
        Without each of B blocks, in each of R replicates, which have the blocks in common.

    Returns
    -------
    float
        Unbiased, so negative at times where the noise is the larger part. With one replicate the
        noise is not known and stays in.
    """
    count = values.shape[1]
    of_mean = float(_variance(values.mean(axis=1)))
    if count == 1:
        return of_mean
    # of one replicate: the sample's scatter, and R times the noise that the mean has
    of_single = float(_variance(values).mean())
    return float((count * of_mean - of_single) / (count - 1))


class Scatter:
    """The columns of the sample's own scatter: its error, and each anisotropy without a block."""

    columns = (
        *(
            Column(
                f"{name}_sample_se",
                float,
                "",
                f"the sample's own scatter of {name}, by a jackknife over eight octants, in a "
                f"plane four quadrants",
            )
            for name in (VOID, CONTACT)
        ),
        *(
            Column(
                f"{name}_without_{block}",
                float,
                "",
                f"{name} without the {what} of octant {block}" + (ORDER if block == 1 else ""),
            )
            for name, what in ((VOID, "segments"), (CONTACT, "contacts"))
            for block in range(1, BLOCKS + 1)
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None where there is no fabric, or none without some block."""
        void, contact, axis = measured.void, measured.contact, measured.axis
        along_void = void.tensor.axial(axis) if void else None
        along_contact = contact.axial(axis) if contact else None
        return {
            **_scatter_values(VOID, along_void, measured.void_scatter),
            **_scatter_values(CONTACT, along_contact, measured.contact_scatter),
        }


def _scatter_values(
    name: str, value: float | None, scatter: Jackknife | None
) -> dict[str, float | None]:
    known = [] if value is None or scatter is None else [value + float(x) for x in scatter.shift]
    return {
        f"{name}_sample_se": None if scatter is None else scatter.error,
        **_by_block(f"{name}_without", known),
    }


def _by_block(name: str, known: Sequence[float]) -> dict[str, float | None]:
    """A column for each block; those of blocks that there are not are empty."""
    values = [*known, *[None] * (BLOCKS - len(known))]
    return {f"{name}_{block}": one for block, one in enumerate(values, start=1)}


class Halves:
    """The columns of what the scan's noise makes of the void fabric without each block."""

    columns = tuple(
        Column(
            f"{VOID}_half_{block}",
            float,
            "",
            f"{VOID}_without_{block} is the mean of two replicates: half their difference, which "
            f"tells compare the scan's noise in a slope",
        )
        for block in range(1, BLOCKS + 1)
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None where there is no void fabric, or none without some block."""
        scatter = measured.void_scatter
        return _by_block(f"{VOID}_half", [] if scatter is None else scatter.half.tolist())
