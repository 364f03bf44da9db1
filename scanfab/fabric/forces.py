"""
Fabric of branches and forces, and the contacts that bear much or little: `with=forces`.

Rothenburg and Bathurst (1989), doi:10.1680/geot.1989.39.4.601, expand the mean branch length and
the mean forces of the contacts of a direction; Ouadfel and Rothenburg (2001),
doi:10.1016/S0167-6636(00)00057-0, in three dimensions. With C = 15/2 (G_c - I/3), the second
order of the density of contacts, and <X> = (1/N_c) Σ X / (1 + n·C·n), a mean over all directions
alike,

    bn = 15/2 (<b n⊗n> / b0 - I/3),   b0 = tr <b n⊗n>,
    fn = 15/2 (<f_n n⊗n> / f0 - I/3),  f0 = tr <f_n n⊗n>,
    ft = 5 dev sym <f_t⊗n> / f0,

with the branch length b, the normal force f_n and the vector f_t of the tangential force. Of discs
all three factors are 4, with I/2 in the place of I/3. The
strong contacts, whose normal force is above the mean, and the weak ones have fabric tensors of
their own (Radjai et al. 1998, doi:10.1103/PhysRevLett.80.61).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scanfab.base.column import numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.invariants import fabric_deviator
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import COMPONENTS

# tangential over mean normal force: less than this is rounding of the digits in the dump
NO_FRICTION = 1e-4
# differences below this share of the largest force are rounding
ROUNDING = 1e-12


class DirectionalMean(NamedTuple):
    """How the mean over contacts depends on their direction: a tensor without trace."""

    matrix: FloatArray
    """Shape (3, 3), dimensionless."""
    axial: float
    """Its value along the loading axis less the mean of those across it."""
    axial_se: float | None
    """Standard error of that if contacts were independent; None for fewer than two."""


def directional_mean(
    normals: FloatArray,
    size: FloatArray,
    axis: FloatArray,
    space: Space = SPACE,
    across: FloatArray | None = None,
) -> DirectionalMean | None:
    """
    Anisotropy of branch length or normal force, 15/2 (<v n⊗n>/<v> - I/3), or 5 dev sym <t⊗n>/<v>.

    Parameters
    ----------
    normals : ndarray, shape (M, 3)
        Unit normals n, from the first grain to the second.
    size : ndarray, shape (M,)
        Branch lengths, or normal forces (compression positive), v.
    axis : ndarray, shape (3,)
        Loading axis, a unit vector.
    space : Space, optional
        The plane in which they lie, if the grains are discs.
    across : ndarray, shape (M, 3), optional
        Tangential forces t on the second grain: then the anisotropy is theirs.

    Returns
    -------
    DirectionalMean or None
        None without contacts, where <v> is not above 0, and where so few contacts lie about some
        direction that 1 + n·C·n is not above 0 there.

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
    # 3/2 a·T·a of a tensor without trace: its value along the axis less that across it; 2 a·T·a
    along = (vectors @ axis) * (n @ axis) - np.einsum("ci,ci->c", vectors, n) / dimension
    less = dimension / (dimension - 1.0)
    ratio = float(weights @ along) / count / scale
    # By how much each contact moves the mean, times their number. A contact counts in the mean, and
    # moves C, and so the weights of all: without this second part the error would be several times
    # too large.
    values = along - ratio * size
    through = space.second_order * ((weights**2 * values)[:, None] * n).T @ n / count
    error = error_of_mean(weights * values - np.einsum("ci,ij,cj->c", n, through, n))
    if error is not None:
        error *= less * factor / scale
    return DirectionalMean(matrix, less * factor * ratio, error)


def _weights(normals: FloatArray, space: Space) -> FloatArray | None:
    """1 / (1 + n·C·n) of each contact; None where that is not above 0."""
    fabric = contact_fabric(normals, space)
    if fabric is None:
        return None
    deviator = fabric_deviator(fabric.matrix, space)
    density = 1.0 + np.einsum("ci,ij,cj->c", normals, deviator, normals)
    return None if density.min() <= 0.0 else 1.0 / density


TENSORS = {
    "bn": "the tensor of branch lengths, 15/2 (<b n n>/b0 - I/3), of discs 4 (... - I/2)",
    "fn": "the tensor of normal forces, 15/2 (<f_n n n>/f0 - I/3), of discs 4 (... - I/2)",
    "ft": "the tensor of tangential forces, 5 dev sym <f_t n>/f0, of discs 4 dev sym <f_t n>/f0",
    "gc_strong": "the fabric tensor of contacts whose normal force is above the mean, trace 1",
    "gc_weak": "the fabric tensor of the other contacts, trace 1",
}
AXIAL = {
    "bn": "branch lengths, 3/2 a·bn·a, of discs 2 a·bn·a",
    "fn": "normal forces, 3/2 a·fn·a, of discs 2 a·fn·a",
    "ft": "tangential forces, 3/2 a·ft·a, of discs 2 a·ft·a",
    "gc_strong": "the strong contacts",
    "gc_weak": "the weak contacts",
}


class Forces:
    """The columns of branches, forces, and strong and weak contacts."""

    columns = numbers(
        {
            **{f"{name}_{k}": f"{k} of {TENSORS[name]}" for name in TENSORS for k in COMPONENTS},
            **{
                f"alpha_{name}_axial{suffix}": meaning
                for name, what in AXIAL.items()
                for suffix, meaning in (
                    ("", f"anisotropy of {what}, signed, along the loading axis"),
                    ("_se", "its standard error if contacts were independent"),
                )
            },
        }
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None without contacts."""
        found: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        normals, axis, space = measured.normals, measured.axis, measured.space
        forces = measured.forces
        if forces is None or not len(normals):
            return found
        means = {
            "bn": directional_mean(normals, forces.branch, axis, space),
            "fn": directional_mean(normals, forces.force_n, axis, space),
        }
        if forces.force is not None:
            size = np.einsum("ci,ci->c", forces.force, normals)
            across = forces.force - size[:, None] * normals
            means["ft"] = directional_mean(normals, size, axis, space, across)
        # what differs from the mean by rounding alone is equal to it
        rounding = ROUNDING * np.abs(forces.force_n).max()
        strong = forces.force_n > forces.force_n.mean() + rounding
        for name, chosen in (("gc_strong", strong), ("gc_weak", ~strong)):
            tensor = contact_fabric(normals[chosen], space)
            if tensor is not None:
                error = axial_error(normals[chosen], axis, space)
                means[name] = DirectionalMean(tensor.matrix, tensor.axial(axis), error)
        for name, mean in means.items():
            if mean is not None:
                found |= {f"{name}_{one}": float(mean.matrix[at]) for one, at in COMPONENTS.items()}
                found[f"alpha_{name}_axial"] = mean.axial
                found[f"alpha_{name}_axial_se"] = mean.axial_se
        return found


def doubts_of_forces(measured: Measured) -> dict[str, str]:
    """Why some of these columns are empty, or 0, by the code of a note."""
    forces, normals = measured.forces, measured.normals
    texts: dict[str, str] = {}
    if forces is None or not len(normals):
        return texts
    if _weights(normals, measured.space) is None:
        texts["few_contacts"] = (
            "the contacts are so few, or so anisotropic, that 1 + n·C·n is not above 0 in "
            "some direction: bn, fn and ft are empty"
        )
    elif forces.force_n.sum() <= 0.0:
        texts["tension"] = (
            "the contacts pull in the mean, so fn and ft are empty: is the force in the dump "
            "that on the other grain?"
        )
    if forces.force is None:
        text = "the dump has the normal part of the contact forces only: ft is empty"
        return texts | {"no_tangential": text}
    tangential = np.abs(forces.force - forces.force_n[:, None] * normals)
    if tangential.max() <= NO_FRICTION * np.abs(forces.force_n).mean():
        texts["no_tangential"] = (
            "no contact has a tangential force, so ft is 0: are the contacts without friction, "
            "or is the force of `contact_columns` its normal part only (LAMMPS: name tx, ty, "
            "tz too)?"
        )
    return texts
