"""
Anisotropy of branch lengths and forces, and fabric of strong and weak contacts: `with=forces`.

Rothenburg and Bathurst (1989), doi:10.1680/geot.1989.39.4.601, expand the mean branch length and
the mean forces as functions of the contact direction; Ouadfel and Rothenburg (2001),
doi:10.1016/S0167-6636(00)00057-0, do so in three dimensions. C = 15/2 (G_c - I/3) is the second
order of the density of contacts, and <X> = (1/N_c) Σ X / (1 + n·C·n) is a mean in which all
directions have the same weight. Then

    bn = 15/2 (<b n⊗n> / b0 - I/3),   b0 = tr <b n⊗n>,
    fn = 15/2 (<f_n n⊗n> / f0 - I/3),  f0 = tr <f_n n⊗n>,
    ft = 5 dev sym <f_t⊗n> / f0,

with the branch length b, the normal force f_n and the vector f_t of the tangential force. For discs
all three factors are 4, and I/2 replaces I/3. Strong contacts, whose normal force is above the
mean, and weak contacts have separate fabric tensors (Radjai et al. 1998,
doi:10.1103/PhysRevLett.80.61).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanfab.base.column import numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import COMPONENTS, axial_error, contact_fabric

# tangential forces below this fraction of the mean normal force are rounding in the dump
NO_FRICTION = 1e-4
# differences below this fraction of the largest force are rounding
ROUNDING = 1e-12


class DirectionalMean(NamedTuple):
    """How a mean over contacts depends on their direction: a tensor of trace 0."""

    matrix: FloatArray
    """The tensor, shape (3, 3), dimensionless."""
    axial: float
    """Component along the loading axis minus the mean of the components across it."""
    axial_se: float | None
    """Standard error of ``axial`` for independent contacts; None for fewer than two."""


def directional_mean(
    normals: FloatArray,
    size: FloatArray,
    axis: FloatArray,
    space: Space = SPACE,
    across: FloatArray | None = None,
) -> DirectionalMean | None:
    """
    Anisotropy of branch lengths or forces over the contact directions.

    For branch lengths or normal forces v it is 15/2 (<v n⊗n>/<v> - I/3), and for tangential forces
    t it is 5 dev sym <t⊗n>/<v>; the mean <...> is defined at the top of this module.

    Parameters
    ----------
    normals : ndarray, shape (M, 3)
        Unit normals n, from the first grain to the second.
    size : ndarray, shape (M,)
        Branch lengths, or normal forces with compression positive, v.
    axis : ndarray, shape (3,)
        Loading axis, a unit vector.
    space : Space, optional
        The plane of the contacts, if the grains are discs.
    across : ndarray, shape (M, 3), optional
        Tangential forces t on the second grain; if given, the result is their anisotropy.

    Returns
    -------
    DirectionalMean or None
        None without contacts, if <v> is not above 0, or if so few contacts lie about some direction
        that 1 + n·C·n is not above 0.

    References
    ----------
    Rothenburg and Bathurst (1989), doi:10.1680/geot.1989.39.4.601; Ouadfel and Rothenburg (2001),
    doi:10.1016/S0167-6636(00)00057-0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.forces import directional_mean
    >>> round(directional_mean(np.eye(3), np.array([1.0, 1, 2]), np.eye(3)[2]).axial, 9)
    1.875
    """
    n, count, dimension = normals, len(normals), float(space.dimension)
    weights = _weights(n, space)
    scale = 0.0 if weights is None else float(weights @ size) / count
    if weights is None or scale <= 0.0:
        return None
    vectors, factor = size[:, None] * n, space.second_order
    if across is not None:
        vectors, factor = across, 4.0 if space.is_plane else 5.0
    product = (weights[:, None] * vectors).T @ n / count
    product = 0.5 * (product + product.T)
    matrix = factor / scale * (product - np.trace(product) / dimension * space.identity)
    # A tensor T of trace 0 has 3/2 a·T·a more along the axis a than across it; in a plane 2 a·T·a.
    along = (vectors @ axis) * (n @ axis) - np.einsum("ci,ci->c", vectors, n) / dimension
    less = dimension / (dimension - 1.0)
    ratio = float(weights @ along) / count / scale
    # Influence of each contact on the mean, times the number of contacts. A contact enters the mean
    # directly, and it also changes C and so the weights of all contacts (``through``). Without this
    # second part the error would be several times too large.
    values = along - ratio * size
    through = space.second_order * ((weights**2 * values)[:, None] * n).T @ n / count
    error = error_of_mean(weights * values - np.einsum("ci,ij,cj->c", n, through, n))
    if error is not None:
        error *= less * factor / scale
    return DirectionalMean(matrix, less * factor * ratio, error)


def _weights(normals: FloatArray, space: Space) -> FloatArray | None:
    """Weights 1 / (1 + n·C·n) of the contacts; None if a denominator is not above 0."""
    fabric = contact_fabric(normals, space)
    if fabric is None:
        return None
    deviator = fabric_deviator(fabric.matrix, space)
    density = 1.0 + np.einsum("ci,ij,cj->c", normals, deviator, normals)
    return None if density.min() <= 0.0 else 1.0 / density


TENSORS = {
    "bn": "the tensor of branch lengths, 15/2 (<b n n>/b0 - I/3), for discs 4 (... - I/2)",
    "fn": "the tensor of normal forces, 15/2 (<f_n n n>/f0 - I/3), for discs 4 (... - I/2)",
    "ft": "the tensor of tangential forces, 5 dev sym <f_t n>/f0, for discs 4 dev sym <f_t n>/f0",
    "gc_strong": "the fabric tensor of contacts whose normal force is above the mean, trace 1",
    "gc_weak": "the fabric tensor of the other contacts, trace 1",
}
AXIAL = {
    "bn": "branch lengths, 3/2 a·bn·a, for discs 2 a·bn·a",
    "fn": "normal forces, 3/2 a·fn·a, for discs 2 a·fn·a",
    "ft": "tangential forces, 3/2 a·ft·a, for discs 2 a·ft·a",
    "gc_strong": "the strong contacts",
    "gc_weak": "the weak contacts",
}


class Forces:
    """Columns of branch lengths, forces, and strong and weak contacts."""

    columns = numbers(
        {
            **{f"{name}_{k}": f"{k} of {TENSORS[name]}" for name in TENSORS for k in COMPONENTS},
            **{
                f"alpha_{name}_axial{suffix}": meaning
                for name, what in AXIAL.items()
                for suffix, meaning in (
                    ("", f"signed anisotropy along the loading axis of {what}"),
                    ("_se", "its standard error for independent contacts"),
                )
            },
        }
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; all None without contacts or forces."""
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        normals, axis, space = measured.normals, measured.axis, measured.space
        forces = measured.forces
        if forces is None or not len(normals):
            return row
        means = {
            "bn": directional_mean(normals, forces.branch, axis, space),
            "fn": directional_mean(normals, forces.force_n, axis, space),
        }
        if forces.force is not None:
            across = forces.force - forces.force_n[:, None] * normals
            means["ft"] = directional_mean(normals, forces.force_n, axis, space, across)
        # a force that exceeds the mean by rounding alone is not strong
        rounding = ROUNDING * np.abs(forces.force_n).max()
        strong = forces.force_n > forces.force_n.mean() + rounding
        for name, chosen in (("gc_strong", strong), ("gc_weak", ~strong)):
            tensor = contact_fabric(normals[chosen], space)
            if tensor is not None:
                error = axial_error(normals[chosen], axis, space)
                means[name] = DirectionalMean(tensor.matrix, tensor.axial(axis), error)
        for name, mean in means.items():
            if mean is not None:
                row |= {f"{name}_{part}": float(mean.matrix[at]) for part, at in COMPONENTS.items()}
                row[f"alpha_{name}_axial"] = mean.axial
                row[f"alpha_{name}_axial_se"] = mean.axial_se
        return row


def doubts_of_forces(measured: Measured) -> dict[str, str]:
    """Notes, by code, that say why some of these columns are empty or 0."""
    forces, normals = measured.forces, measured.normals
    texts: dict[str, str] = {}
    if forces is None or not len(normals):
        return texts
    if _weights(normals, measured.space) is None:
        texts["few_contacts"] = (
            "the contacts are so few or so anisotropic that 1 + n·C·n is not above 0 in "
            "some direction: bn, fn and ft are empty"
        )
    elif forces.force_n.sum() <= 0.0:
        texts["tension"] = (
            "the mean normal force is tension, so fn and ft are empty: does the dump list the "
            "forces on the other grain?"
        )
    if forces.force is None:
        text = "the dump has only the normal part of the contact forces: ft is empty"
        return texts | {"no_tangential": text}
    tangential = np.abs(forces.force - forces.force_n[:, None] * normals)
    if tangential.max() <= NO_FRICTION * np.abs(forces.force_n).mean():
        texts["no_tangential"] = (
            "no contact has a tangential force, so ft is 0: are the contacts frictionless, or does "
            "`contact_columns` name only the normal part of the force (LAMMPS: also name tx, ty, "
            "tz)?"
        )
    return texts
