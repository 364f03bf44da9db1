"""
Axial anisotropies without each block of the sample, and the standard errors that follow.

The sample is parted in octants about its centre; discs in quadrants of their plane.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.errors import jackknife_variance, variance_without_noise
from scanfab.fabric.tensor import axial
from scanfab.fabric.void import void_fabric

# octants, and columns of the table; in a plane the first four, which are quadrants
BLOCKS = 8

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


def contact_jackknife(
    normals: FloatArray, blocks: IntArray, axis: FloatArray, space: Space = SPACE
) -> Jackknife | None:
    """
    The contact fabric's axial anisotropy without the contacts of each block.

    Parameters
    ----------
    normals : ndarray, shape (M, 3)
        Unit normals.
    blocks : ndarray of int, shape (M,)
        The block of each contact's point, from 0.
    axis : ndarray, shape (3,)
        Loading axis, a unit vector.
    space : Space, optional
        The plane in which they lie, if the grains are discs.

    Returns
    -------
    Jackknife or None
        None if one block holds all contacts.
    """
    along, count = space.axial((normals @ axis) ** 2), 2**space.dimension
    number = np.bincount(blocks, minlength=count)
    if np.any(number == len(along)):
        return None
    rest = (along.sum() - np.bincount(blocks, along, count)) / (len(along) - number)
    error = math.sqrt(jackknife_variance(rest))
    return Jackknife(rest - along.mean(), error, np.zeros(count))


def void_jackknife(sums: BlockedSums, axis: FloatArray, space: Space = SPACE) -> Jackknife | None:
    """
    The void fabric's axial anisotropy without the segments of each block.

    Parameters
    ----------
    sums : BlockedSums
        Of a scan.
    axis : ndarray, shape (3,)
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
    variance = float(variance_without_noise(values[1:]))
    error = math.sqrt(variance) if variance > 0 else None
    return Jackknife(means[1:] - means[0], error, values[1:, 0] - means[1:])
