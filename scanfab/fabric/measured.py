"""What fabrics are computed from: the scan and the contacts of one frame, variant and cut-off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.errors import Jackknife, jackknife
from scanfab.fabric.tensor import FabricTensor, axial
from scanfab.fabric.void import VoidFabric, void_fabric

# of √(3/2 s:s), s the stress's deviator, to p, below which the stress has no direction
LEAST_RATIO = 0.02


class ContactForces(NamedTuple):
    """Forces and branches of the contacts of one variant."""

    branch: FloatArray
    """From the first grain's centre to the second's, along the normal; shape (M,), a length."""
    force_n: FloatArray
    """Normal force, compression positive; shape (M,), dump's force unit."""
    force: FloatArray | None
    """On the second grain, shape (M, 3); None where only its normal part is known."""


class BlockedSums(NamedTuple):
    """
    A scan whose void segments are told apart by the block of the sample that their middle is in.

    Sums are lengths (dump's unit) and numbers of the kept segments, each of shape (R, D).
    """

    axes: FloatArray
    """Unit vectors of each replicate, shape (R, D, 3)."""
    weights: FloatArray
    """Of the direction rule, shape (D,)."""
    full: tuple[FloatArray, FloatArray | IntArray]
    """Of all blocks."""
    without: list[tuple[FloatArray, FloatArray | IntArray]]
    """Of all but one block, for each of them."""


class SampleState(NamedTuple):
    """Void ratio, coordination and stress of the sample."""

    void_ratio: float | None
    """Volume of the voids over that of the grains; None without a volume."""
    coordination_mechanical: float | None
    """Mean number of contacts of the grains that have two or more."""
    stress: FloatArray | None
    """Shape (3, 3), compression positive; None without forces, or without a volume."""
    space: Space = SPACE
    """The plane of the sample, if its grains are discs: stress is a force over a length there."""

    @property
    def mean_stress(self) -> float:
        """The pressure p."""
        assert self.stress is not None
        return float(np.trace(self.stress)) / self.space.dimension

    @property
    def direction(self) -> FloatArray | None:
        """The stress deviator over its norm; None for a stress that is nearly isotropic."""
        if self.stress is None:
            return None
        mean = self.mean_stress
        deviator = self.stress - mean * self.space.identity
        size = float(np.linalg.norm(deviator))
        deviatoric = math.sqrt(self.space.dimension / (self.space.dimension - 1.0)) * size
        if mean <= 0.0 or deviatoric < LEAST_RATIO * mean:
            return None
        return deviator / size


@dataclass(frozen=True, eq=False)
class Measured:
    """What fabrics are computed from, and results that several of them share."""

    axis: FloatArray
    """Loading axis, a unit vector, shape (3,)."""
    axes: FloatArray
    """Unit vectors along which each replicate was scanned, shape (R, D, 3)."""
    weights: FloatArray
    """Of the direction rule, shape (D,)."""
    length: FloatArray
    """
    Sum of the lengths of the kept void segments, shape (R, D), dump's length unit.

    For the second moment (option `moment`) the sum of their squares, in that unit squared.
    """
    segments: FloatArray | IntArray
    """
    Number of the kept void segments, shape (R, D).

    For the second moment the sum of their lengths, dump's length unit.
    """
    meets_solids: bool
    """Whether the lines may meet any solid: a window in which there is none has no void fabric."""
    blocked: BlockedSums
    """The same sums of other lines of the frame, without each block of the sample."""
    normals: FloatArray
    """Unit normals of the contacts, shape (M, 3)."""
    points: FloatArray
    """Where these contacts are, shape (M, 3), dump's length unit."""
    blocks: IntArray
    """In which block of the sample each of these contacts is, from 0, shape (M,)."""
    space: Space = SPACE
    """The plane in which all lies, if the grains are discs."""
    segment_count: int = 0
    """Number of the kept void segments of all replicates."""
    forces: ContactForces | None = None
    """Forces of these contacts; None if they are unknown or not asked for."""
    state: SampleState | None = None
    """Stress and void ratio, where they are asked for."""

    @cached_property
    def void(self) -> VoidFabric | None:
        """The void fabric; None if there is none."""
        if not self.meets_solids:
            return None
        return void_fabric(self.axes, self.weights, self.length, self.segments, self.space)

    @cached_property
    def contact(self) -> FabricTensor | None:
        """The contact fabric; None without a contact."""
        return contact_fabric(self.normals, self.space)

    @cached_property
    def void_scatter(self) -> Jackknife | None:
        """The void fabric's anisotropy without each block; None if one lacks a fabric."""
        if self.void is None:
            return None
        axes, weights, full, without = self.blocked
        values = []
        for length, segments in (full, *without):
            fabric = void_fabric(axes, weights, length, segments, self.space)
            if fabric is None:
                return None
            values.append(axial(fabric.replicates, self.axis, self.space))
        return jackknife(np.array(values))

    @cached_property
    def contact_scatter(self) -> Jackknife | None:
        """The contact fabric's anisotropy without each block; None if one has all contacts."""
        count = 2**self.space.dimension
        along = self.space.axial((self.normals @ self.axis) ** 2)
        left = len(along) - np.bincount(self.blocks, minlength=count)
        if np.any(left == 0):
            return None
        rest = (along.sum() - np.bincount(self.blocks, along, count)) / left
        return jackknife(np.array([along.mean(), *rest])[:, None])
