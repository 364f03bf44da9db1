"""
State of a sample, and orientation of its fabric relative to the stress: `with=state`.

The stress is that of Love and Weber, σ = (1/V) Σ f⊗b over contacts, compression positive (Love
1892; Weber 1966; Bagi 1996, doi:10.1016/0167-6636(95)00044-5). The void ratio is (1 - ν)/ν; as
usual in DEM papers, the solid fraction ν sums the volumes of the grains, so overlaps count twice.
A = F:n_L is the fabric anisotropy variable of anisotropic critical state theory (Li and Dafalias
2012, doi:10.1061/(ASCE)EM.1943-7889.0000324), with the direction n_L = s/√(s:s) of the stress
deviator s.
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
    The average stress in a volume: the symmetric part of (1/V) Σ f⊗b, compression positive.

    Parameters
    ----------
    force : ndarray, shape (M, 3)
        Force f on one grain of each contact.
    branch : ndarray, shape (M, 3)
        Vector b from the centre of the other grain to the centre of this grain; if it leaves the
        volume, only its part inside.
    volume : float
        Volume V of grains and voids.

    Returns
    -------
    ndarray, shape (3, 3)
        Stress in the dump's unit of force over length squared.

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


# unit of stresses: force over length squared, in the units of the dump
STRESS = "stress"
VOLUMETRIC_STRAIN = Column(
    "volumetric_strain",
    float,
    "",
    "-ln(V/V0) since the reference frame, positive in compression; empty unless the cell is "
    "periodic along all its vectors",
)
WITH_TWO = "mean number of contacts of the grains with two or more contacts"
NO_DIRECTION = "empty if √(3/2 s:s) < 0.02 p"
DIRECTION = f"of the stress deviator s; {NO_DIRECTION}"
ANGLE = "angle between the major axes of {1} and stress, 0 to 90"
ERRORS = {"vs": "due to the scan", "c": "for independent contacts"}


class State:
    """Columns of void ratio, stress, and fabric relative to the stress."""

    columns = (
        *numbers({"void_ratio": "volume of voids over volume of grains, rattlers included"}),
        *numbers(
            {
                **{f"stress_{k}": f"{k} of the stress, compression positive" for k in COMPONENTS},
                "p": "mean stress, a third of the trace, for discs half of it",
                "q": "stress along the loading axis minus the mean stress across it",
            },
            STRESS,
        ),
        VOLUMETRIC_STRAIN,
        *numbers({"coordination_mechanical": WITH_TWO}),
        *of_both("acst_{0}", f"A = F:n of the {{1}} and the direction n {DIRECTION}"),
        *of_both("angle_{0}_stress", f"{ANGLE}; {NO_DIRECTION}", unit="degrees"),
        *of_both("acst_{0}_se", "standard error of acst_{0} {1}", ERRORS),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column, without the volumetric strain, which belongs to the frame."""
        names = [column.name for column in self.columns if column is not VOLUMETRIC_STRAIN]
        row: dict[str, Any] = dict.fromkeys(names)
        state = measured.state
        if state is None:
            return row
        row["void_ratio"] = state.void_ratio
        row["coordination_mechanical"] = state.coordination_mechanical
        if state.stress is not None:
            along = float(measured.axis @ state.stress @ measured.axis)
            less = state.space.dimension / (state.space.dimension - 1.0)
            row |= {f"stress_{part}": float(state.stress[at]) for part, at in COMPONENTS.items()}
            row |= {"p": state.mean_stress, "q": less * (along - state.mean_stress)}
        return row | _against_stress(measured, state)


def _against_stress(measured: Measured, state: SampleState) -> dict[str, float | None]:
    """Values of both fabrics relative to the stress; none if it is unknown or isotropic."""
    space, n, along = state.space, measured.normals, state.direction
    row: dict[str, float | None] = {}
    if state.stress is None or along is None:
        return row
    stress = FabricTensor(state.stress / np.trace(state.stress), space)
    fabrics: dict[str, tuple[FabricTensor, FloatArray]] = {}
    # each tensor with the values of F:n whose mean is its A
    if measured.void is not None:
        tensors = fabric_deviator(measured.void.replicates, space)
        fabrics["vs"] = measured.void.tensor, np.einsum("rij,ij->r", tensors, along)
    if measured.contact is not None:
        each = space.second_order * np.einsum("ci,ij,cj->c", n, along, n)
        fabrics["c"] = measured.contact, each
    for name, (fabric, each) in fabrics.items():
        row[f"acst_{name}"] = float(np.sum(fabric_deviator(fabric.matrix, space) * along))
        row[f"angle_{name}_stress"] = fabric.angle_to(stress)
        row[f"acst_{name}_se"] = error_of_mean(each)
    return row
