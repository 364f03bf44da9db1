"""
The state of a sample, and how its fabric stands to the stress: `with=state`.

Stress by Love and Weber, σ = (1/V) Σ f⊗b over contacts, compression positive (Love 1892; Weber
1966; Bagi 1996, doi:10.1016/0167-6636(95)00044-5); void ratio (1 - ν)/ν, with the volumes of the
grains summed up, as DEM papers have it, so that overlaps count twice. A = F:n_L is the fabric
anisotropy variable of anisotropic critical state theory (Li and Dafalias 2012,
doi:10.1061/(ASCE)EM.1943-7889.0000324) with the direction n_L = s/√(s:s) of the stress deviator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.column import Column
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.tensor import COMPONENTS, FabricTensor, error_of_mean

if TYPE_CHECKING:
    from scanfab.fabric.measured import Measured


# of √(3/2 s:s), s the stress's deviator, to p, below which the stress has no direction
LEAST_RATIO = 0.02


def love_weber(force: npt.ArrayLike, branch: npt.ArrayLike, volume: float) -> FloatArray:
    """
    The mean stress of a volume: (1/V) Σ f⊗b, made symmetric, compression positive.

    Parameters
    ----------
    force : array_like, shape (M, 3)
        On one grain of each contact.
    branch : array_like, shape (M, 3)
        From the other grain's place to that one's; the part of it that lies in the volume.
    volume : float
        Of the grains and the voids.

    Returns
    -------
    ndarray, shape (3, 3)
        In the dump's unit of force over length squared.

    References
    ----------
    Love, A treatise on the mathematical theory of elasticity (1892); Weber, Recherches concernant
    les contraintes intergranulaires dans les milieux pulvérulents, Bull. Liaison Ponts et Chaussées
    20 (1966).

    Examples
    --------
    >>> from scanfab.fabric.state import love_weber
    >>> love_weber([[2.0, 0, 0]], [[1.5, 0, 0]], 10.0)[0, 0]
    np.float64(0.3)
    """
    product = np.asarray(force, np.float64).T @ np.asarray(branch, np.float64) / volume
    return np.asarray(0.5 * (product + product.T))


@dataclass(frozen=True, eq=False)
class SampleState:
    """What is known of the sample beside its fabric."""

    void_ratio: float | None
    """Volume of the voids over that of the grains; None without a volume."""
    coordination_mechanical: float | None
    """Mean number of contacts of the grains that have two or more."""
    stress: FloatArray | None
    """Shape (3, 3), compression positive; None without forces, or without a volume."""
    space: Space = SPACE
    """The plane of the sample, if its grains are discs: stress is a force over a length there."""

    @cached_property
    def mean_stress(self) -> float:
        """The pressure p."""
        assert self.stress is not None
        return float(np.trace(self.stress)) / self.space.dimension

    @cached_property
    def direction(self) -> FloatArray | None:
        """The stress deviator over its norm; None for a stress that is nearly isotropic."""
        if self.stress is None:
            return None
        deviator = self.stress - self.mean_stress * self.space.identity
        size = float(np.linalg.norm(deviator))
        deviatoric = math.sqrt(self.space.dimension / (self.space.dimension - 1.0)) * size
        if self.mean_stress <= 0.0 or deviatoric < LEAST_RATIO * self.mean_stress:
            return None
        return deviator / size


# the unit of stresses: force over length squared, as the dump has them
STRESS = "stress"

VOLUMETRIC_STRAIN = Column(
    "volumetric_strain",
    float,
    "",
    "of a cell that repeats along all its vectors, since the first frame: -ln(V/V0), positive in "
    "compression; else empty",
)


class State:
    """The columns of void ratio, stress and what follows."""

    columns = (
        Column("void_ratio", float, "", "volume of voids over that of grains, rattlers too"),
        *(
            Column(f"stress_{one}", float, STRESS, f"{one} of the stress, compression positive")
            for one in COMPONENTS
        ),
        Column("p", float, STRESS, "mean stress, a third of the trace, of discs half of it"),
        Column("q", float, STRESS, "stress along the loading axis less the mean across it"),
        VOLUMETRIC_STRAIN,
        Column(
            "coordination_mechanical",
            float,
            "",
            "mean number of contacts of the grains that have two or more",
        ),
        *(
            Column(
                f"acst_{one}",
                float,
                "",
                f"A = F:n of the {what} and the direction of the stress deviator s; empty for "
                "√(3/2 s:s) < 0.02 p",
            )
            for one, what in (("vs", "void fabric"), ("c", "contact fabric"))
        ),
        *(
            Column(
                f"angle_{one}_stress",
                float,
                "degrees",
                f"angle between the major axes of {what} and stress, 0 to 90; empty for "
                "√(3/2 s:s) < 0.02 p",
            )
            for one, what in (("vs", "void fabric"), ("c", "contact fabric"))
        ),
        Column("acst_vs_se", float, "", "standard error of acst_vs, of the scan"),
        Column(
            "acst_c_se",
            float,
            "",
            "standard error of acst_c, of contacts, if they were independent",
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All but the strain, which is that of the frame."""
        names = [column.name for column in self.columns if column is not VOLUMETRIC_STRAIN]
        found: dict[str, Any] = dict.fromkeys(names)
        state = measured.state
        if state is None:
            return found
        found["void_ratio"] = state.void_ratio
        found["coordination_mechanical"] = state.coordination_mechanical
        if state.stress is None:
            return found
        along = float(measured.axis @ state.stress @ measured.axis)
        less = state.space.dimension / (state.space.dimension - 1.0)
        found |= {f"stress_{one}": float(state.stress[at]) for one, at in COMPONENTS.items()}
        found |= {"p": state.mean_stress, "q": less * (along - state.mean_stress)}
        return found | _against_stress(measured, state)


def _against_stress(measured: Measured, state: SampleState) -> dict[str, float | None]:
    """How both fabrics stand to the direction of the stress."""
    direction = state.direction
    if direction is None:
        return {}
    assert state.stress is not None
    space = state.space
    stress = FabricTensor(state.stress / np.trace(state.stress), space)
    found: dict[str, float | None] = {}
    if measured.void is not None:
        each = np.einsum("rij,ij->r", fabric_deviator(measured.void.replicates, space), direction)
        found |= _values("vs", measured.void.tensor, direction, stress, each)
    if measured.contact is not None:
        n = measured.normals
        each = space.second_order * np.einsum("ci,ij,cj->c", n, direction, n)
        found |= _values("c", measured.contact, direction, stress, each)
    return found


def _values(
    name: str, fabric: FabricTensor, direction: FloatArray, stress: FabricTensor, each: FloatArray
) -> dict[str, float | None]:
    return {
        f"acst_{name}": float(np.sum(fabric_deviator(fabric.matrix, fabric.space) * direction)),
        f"angle_{name}_stress": fabric.angle_to(stress),
        f"acst_{name}_se": error_of_mean(each),
    }
