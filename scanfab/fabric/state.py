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
import numpy.typing as npt

from scanfab.base.column import Column, numbers
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import COMPONENTS, FabricTensor


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


# the unit of stresses: force over length squared, as the dump has them
STRESS = "stress"
VOLUMETRIC_STRAIN = Column(
    "volumetric_strain",
    float,
    "",
    "of a cell that repeats along all its vectors, since the first frame: -ln(V/V0), positive in "
    "compression; else empty",
)
FABRICS = {"vs": "void fabric", "c": "contact fabric"}
NO_DIRECTION = "empty for √(3/2 s:s) < 0.02 p"
WITH_TWO = "mean number of contacts of the grains that have two or more"
DIRECTION = "direction of the stress deviator s"
ANGLE = "angle between the major axes of"


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
        *numbers(
            {
                f"acst_{one}": f"A = F:n of the {what} and the {DIRECTION}; {NO_DIRECTION}"
                for one, what in FABRICS.items()
            }
        ),
        *numbers(
            {
                f"angle_{one}_stress": f"{ANGLE} {what} and stress, 0 to 90; {NO_DIRECTION}"
                for one, what in FABRICS.items()
            },
            "degrees",
        ),
        *numbers(
            {
                "acst_vs_se": "standard error of acst_vs, of the scan",
                "acst_c_se": "standard error of acst_c, of contacts, if they were independent",
            }
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
        if state.direction is not None:
            found |= _against_stress(measured, state.stress, state.direction)
        return found


def _against_stress(
    measured: Measured, stress: FloatArray, direction: FloatArray
) -> dict[str, float | None]:
    """How both fabrics stand to the stress and the direction of its deviator."""
    space, n = measured.space, measured.normals
    along = FabricTensor(stress / np.trace(stress), space)
    fabrics: dict[str, tuple[FabricTensor, FloatArray]] = {}
    if measured.void is not None:
        tensors = fabric_deviator(measured.void.replicates, space)
        each = np.einsum("rij,ij->r", tensors, direction)
        fabrics["vs"] = measured.void.tensor, each
    if measured.contact is not None:
        each = space.second_order * np.einsum("ci,ij,cj->c", n, direction, n)
        fabrics["c"] = measured.contact, each
    found: dict[str, float | None] = {}
    for name, (fabric, each) in fabrics.items():
        found[f"acst_{name}"] = float(np.sum(fabric_deviator(fabric.matrix, space) * direction))
        found[f"angle_{name}_stress"] = fabric.angle_to(along)
        found[f"acst_{name}_se"] = error_of_mean(each)
    return found
