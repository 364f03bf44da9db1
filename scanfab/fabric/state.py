"""
The state of a sample, and how its fabric stands to the stress: `with=state`.

Stress by Love and Weber, σ = (1/V) Σ f⊗b over contacts, compression positive (Love 1892; Weber
1966; Bagi 1996, doi:10.1016/0167-6636(95)00044-5); void ratio (1 - ν)/ν, with the volumes of the
grains summed up, as DEM papers have it, so that overlaps count twice. A = F:n_L is the fabric
anisotropy variable of anisotropic critical state theory (Li and Dafalias 2012,
doi:10.1061/(ASCE)EM.1943-7889.0000324) with the direction n_L = s/√(s:s) of the stress deviator.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scanfab.base.column import Column, numbers
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.measured import Measured, SampleState
from scanfab.fabric.tensor import COMPONENTS, FabricTensor, of_both


def love_weber(force: FloatArray, branch: FloatArray, volume: float) -> FloatArray:
    """
    The mean stress of a volume: (1/V) Σ f⊗b, made symmetric, compression positive.

    Parameters
    ----------
    force : ndarray, shape (M, 3)
        On one grain of each contact.
    branch : ndarray, shape (M, 3)
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
    >>> import numpy as np
    >>> from scanfab.fabric.state import love_weber
    >>> love_weber(np.array([[2.0, 0, 0]]), np.array([[1.5, 0, 0]]), 10.0)[0, 0]
    np.float64(0.3)
    """
    product: FloatArray = force.T @ branch / volume
    return 0.5 * (product + product.T)


# the unit of stresses: force over length squared, as the dump has them
STRESS = "stress"
VOLUMETRIC_STRAIN = Column(
    "volumetric_strain",
    float,
    "",
    "of a cell that repeats along all its vectors, since the first frame: -ln(V/V0), positive in "
    "compression; else empty",
)
WITH_TWO = "mean number of contacts of the grains that have two or more"
NO_DIRECTION = "empty for √(3/2 s:s) < 0.02 p"
DIRECTION = f"of the stress deviator s; {NO_DIRECTION}"
ANGLE = "angle between the major axes of {1} and stress, 0 to 90"
ERRORS = {"vs": "the scan", "c": "contacts, if they were independent"}


class State:
    """The columns of void ratio, stress and what follows."""

    columns = (
        *numbers({"void_ratio": "volume of voids over that of grains, rattlers too"}),
        *numbers(
            {
                **{f"stress_{k}": f"{k} of the stress, compression positive" for k in COMPONENTS},
                "p": "mean stress, a third of the trace, of discs half of it",
                "q": "stress along the loading axis less the mean across it",
            },
            STRESS,
        ),
        VOLUMETRIC_STRAIN,
        *numbers({"coordination_mechanical": WITH_TWO}),
        *of_both("acst_{0}", f"A = F:n of the {{1}} and the direction {DIRECTION}"),
        *of_both("angle_{0}_stress", f"{ANGLE}; {NO_DIRECTION}", unit="degrees"),
        *of_both("acst_{0}_se", "standard error of acst_{0}, of {1}", ERRORS),
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
        if state.stress is not None:
            along = float(measured.axis @ state.stress @ measured.axis)
            less = state.space.dimension / (state.space.dimension - 1.0)
            found |= {f"stress_{one}": float(state.stress[at]) for one, at in COMPONENTS.items()}
            found |= {"p": state.mean_stress, "q": less * (along - state.mean_stress)}
        return found | _against_stress(measured, state)


def _against_stress(measured: Measured, state: SampleState) -> dict[str, float | None]:
    """How both fabrics stand to the stress and the direction of its deviator, if it has one."""
    space, n, along = state.space, measured.normals, state.direction
    found: dict[str, float | None] = {}
    if state.stress is None or along is None:
        return found
    stress = FabricTensor(state.stress / np.trace(state.stress), space)
    fabrics: dict[str, tuple[FabricTensor, FloatArray]] = {}
    # with each tensor the F:n of what it is the mean of
    if measured.void is not None:
        tensors = fabric_deviator(measured.void.replicates, space)
        fabrics["vs"] = measured.void.tensor, np.einsum("rij,ij->r", tensors, along)
    if measured.contact is not None:
        each = space.second_order * np.einsum("ci,ij,cj->c", n, along, n)
        fabrics["c"] = measured.contact, each
    for name, (fabric, each) in fabrics.items():
        found[f"acst_{name}"] = float(np.sum(fabric_deviator(fabric.matrix, space) * along))
        found[f"angle_{name}_stress"] = fabric.angle_to(stress)
        found[f"acst_{name}_se"] = error_of_mean(each)
    return found
