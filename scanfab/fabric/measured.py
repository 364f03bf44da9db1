"""Input of all fabrics: scan and contacts of one frame, variant and cut-off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.fabric.errors import Jackknife, jackknife
from scanfab.fabric.tensor import FabricTensor, axial, contact_fabric
from scanfab.fabric.void import VoidFabric, void_fabric
from scanfab.scan.scan import GapSums

# A stress with √(3/2 s:s) below this fraction of p, s its deviator, counts as isotropic.
LEAST_RATIO = 0.02


class ContactForces(NamedTuple):
    """Forces and branches of the contacts of one variant."""

    branch: FloatArray
    """Distance between the two grain centres along the normal, dump's length unit, shape (M,)."""
    force_n: FloatArray
    """Normal force, compression positive, dump's force unit, shape (M,)."""
    force: FloatArray | None
    """Force on the second grain, shape (M, 3); None if the dump has only the normal part."""


class SampleState(NamedTuple):
    """Void ratio, coordination and stress of the sample."""

    void_ratio: float | None
    """Volume of the voids over volume of the grains; None if the volume is unknown."""
    coordination_mechanical: float | None
    """Mean number of contacts of the grains with two or more contacts."""
    stress: FloatArray | None
    """Stress, compression positive, shape (3, 3); None without forces or a volume."""
    space: Space = SPACE
    """The plane of the sample if its grains are discs; there stress is a force over a length."""

    @property
    def mean_stress(self) -> float:
        """The mean stress p."""
        assert self.stress is not None
        return float(np.trace(self.stress)) / self.space.dimension

    @property
    def direction(self) -> FloatArray | None:
        """The stress deviator over its norm, shape (3, 3); None if it is nearly isotropic."""
        if self.stress is None:
            return None
        mean = self.mean_stress
        deviator = self.stress - mean * self.space.identity
        size = float(np.linalg.norm(deviator))
        deviatoric = math.sqrt(self.space.dimension / (self.space.dimension - 1.0)) * size
        if mean <= 0.0 or deviatoric < LEAST_RATIO * mean:
            return None
        return deviator / size


def void_scatter(
    gaps: GapSums,
    variant: str,
    axis: npt.ArrayLike,
    space: Space = SPACE,
    cutoff: int = 0,
    moment: int = 1,
) -> Jackknife | None:
    """
    Axial anisotropy of the void fabric without each octant; None if any does not exist.

    A void segment belongs to the octant (in a plane, quadrant) that its middle lies in. ``cutoff``
    is the number of a cut-off of the scan.
    """
    values = []
    for left_out in (None, *range(2**space.dimension)):
        sums = gaps.kept(variant, cutoff, moment, left_out)
        fabric = void_fabric(gaps.axes, gaps.weights, *sums, space)
        if fabric is None:
            return None
        values.append(axial(fabric.replicates, axis, space))
    return jackknife(np.array(values))


@dataclass(frozen=True, eq=False)
class Measured:
    """Input of all fabrics, and results that several fabrics share."""

    axis: FloatArray
    """Loading axis, a unit vector, shape (3,)."""
    axes: FloatArray
    """Unit vectors of the scan in each replicate, shape (R, D, 3)."""
    weights: FloatArray
    """Weights of the direction rule, shape (D,)."""
    length: FloatArray
    """
    Total length of the kept void segments, shape (R, D), dump's length unit.

    For the second moment (option `moment`), the sum of squared lengths, in that unit squared.
    """
    segments: FloatArray | IntArray
    """
    Number of the kept void segments, shape (R, D).

    For the second moment, the sum of their lengths, dump's length unit.
    """
    meets_solids: bool
    """Whether any solid lies where the lines run; without a solid there is no void fabric."""
    normals: FloatArray
    """Unit normals of the contacts, shape (M, 3)."""
    blocks: IntArray
    """Block of the sample that each contact point lies in, from 0, shape (M,)."""
    void_scatter: Jackknife | None = None
    """
    Axial anisotropy of the void fabric without each block, from other lines in the same frame.

    None if any of these fabrics does not exist.
    """
    space: Space = SPACE
    """The plane of the sample, if the grains are discs."""
    segment_count: int = 0
    """Number of the kept void segments of all replicates."""
    forces: ContactForces | None = None
    """Forces of the contacts; None if they are unknown or not needed."""
    state: SampleState | None = None
    """Stress and void ratio; None if they are not needed."""

    @cached_property
    def void(self) -> VoidFabric | None:
        """The void fabric; None if the lines meet no solid or some axis keeps no segment."""
        if not self.meets_solids:
            return None
        return void_fabric(self.axes, self.weights, self.length, self.segments, self.space)

    @cached_property
    def contact(self) -> FabricTensor | None:
        """The contact fabric; None without contacts."""
        return contact_fabric(self.normals, self.space)

    @cached_property
    def contact_scatter(self) -> Jackknife | None:
        """Axial anisotropy of contacts without each block; None if a block has all contacts."""
        count = 2**self.space.dimension
        along = self.space.axial((self.normals @ self.axis) ** 2)
        left = len(along) - np.bincount(self.blocks, minlength=count)
        if np.any(left == 0):
            return None
        rest = (along.sum() - np.bincount(self.blocks, along, count)) / left
        return jackknife(np.array([along.mean(), *rest])[:, None])
