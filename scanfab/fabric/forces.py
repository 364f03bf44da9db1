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

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.column import Column
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import axial_error, contact_fabric
from scanfab.fabric.tensor import COMPONENTS, FabricTensor

if TYPE_CHECKING:
    from scanfab.fabric.measured import Measured


# of a tangential to the mean normal force: what remains of it where only digits are left
NO_FRICTION = 1e-4
# of the largest force: what differs by less is equal
ROUNDING = 1e-12


class ContactForces(NamedTuple):
    """What the contacts of one variant bear, and what they span."""

    branch: FloatArray
    """From the first grain's centre to the second's, along the normal; shape (M,), a length."""
    force_n: FloatArray
    """Normal force, compression positive; shape (M,), dump's force unit."""
    force: FloatArray | None
    """On the second grain, shape (M, 3); None where only its normal part is known."""


@dataclass(frozen=True, eq=False)
class DirectionalMean:
    """
    How a mean over the contacts of a direction depends on that: a tensor without trace.

    Attributes
    ----------
    matrix : ndarray
        Shape (3, 3), dimensionless.
    axial : float
        Its value along the loading axis less the mean of those across it.
    axial_se : float or None
        Standard error of that if contacts were independent; None for fewer than two.
    """

    matrix: FloatArray
    axial: float
    axial_se: float | None


def branch_fabric(
    normals: npt.ArrayLike, branch: npt.ArrayLike, axis: npt.ArrayLike, space: Space = SPACE
) -> DirectionalMean | None:
    """
    Anisotropy of the branch length: 15/2 (<b n⊗n>/b0 - I/3).

    Parameters
    ----------
    normals : array_like, shape (M, 3)
        Unit normals.
    branch : array_like, shape (M,)
        Branch lengths.
    axis : array_like, shape (3,)
        Loading axis, a unit vector.

    Returns
    -------
    DirectionalMean or None
        None without contacts, and where so few of them lie about some direction that
        1 + n·C·n is not above 0 there.

    References
    ----------
    Rothenburg and Bathurst (1989), doi:10.1680/geot.1989.39.4.601.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.forces import branch_fabric
    >>> found = branch_fabric(np.eye(3), [1.0, 1.0, 2.0], [0, 0, 1])
    >>> round(found.axial, 9)
    1.875
    """
    vectors = np.asarray(branch, dtype=np.float64)[:, None] * np.asarray(normals)
    return _mean_by_direction(normals, vectors, np.asarray(branch), space.second_order, axis, space)


def normal_force_fabric(
    normals: npt.ArrayLike, force_n: npt.ArrayLike, axis: npt.ArrayLike, space: Space = SPACE
) -> DirectionalMean | None:
    """
    Anisotropy of the normal force: 15/2 (<f_n n⊗n>/f0 - I/3).

    Parameters
    ----------
    normals : array_like, shape (M, 3)
        Unit normals.
    force_n : array_like, shape (M,)
        Normal forces, compression positive.
    axis : array_like, shape (3,)
        Loading axis, a unit vector.

    Returns
    -------
    DirectionalMean or None
        As :func:`branch_fabric`; None also if f0 is not compression.

    References
    ----------
    Ouadfel and Rothenburg (2001), doi:10.1016/S0167-6636(00)00057-0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.forces import normal_force_fabric
    >>> round(normal_force_fabric(np.eye(3), [1.0, 1.0, 2.0], [0, 0, 1]).axial, 9)
    1.875
    """
    vectors = np.asarray(force_n, dtype=np.float64)[:, None] * np.asarray(normals)
    size = np.asarray(force_n)
    return _mean_by_direction(normals, vectors, size, space.second_order, axis, space)


def tangential_force_fabric(
    normals: npt.ArrayLike, force: npt.ArrayLike, axis: npt.ArrayLike, space: Space = SPACE
) -> DirectionalMean | None:
    """
    Anisotropy of the tangential force: 5 dev sym <f_t⊗n> / f0.

    Parameters
    ----------
    normals : array_like, shape (M, 3)
        Unit normals from the first grain to the second.
    force : array_like, shape (M, 3)
        Forces on the second grain.
    axis : array_like, shape (3,)
        Loading axis, a unit vector.

    Returns
    -------
    DirectionalMean or None
        As :func:`normal_force_fabric`.

    References
    ----------
    Ouadfel and Rothenburg (2001), doi:10.1016/S0167-6636(00)00057-0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.forces import tangential_force_fabric
    >>> n = np.eye(3)
    >>> found = tangential_force_fabric(n, n, [0, 0, 1])  # normal forces alone
    >>> np.abs(found.matrix).max()
    np.float64(0.0)
    """
    n, f = np.asarray(normals, dtype=np.float64), np.asarray(force, dtype=np.float64)
    force_n = np.einsum("ci,ci->c", f, n)
    factor = 4.0 if space.is_plane else 5.0
    return _mean_by_direction(n, f - force_n[:, None] * n, force_n, factor, axis, space)


def _mean_by_direction(
    normals: npt.ArrayLike,
    vectors: FloatArray,
    size: FloatArray,
    factor: float,
    axis: npt.ArrayLike,
    space: Space,
) -> DirectionalMean | None:
    """``factor`` dev sym <v⊗n> / <size>, and its axial value with the error of that."""
    n, a = np.asarray(normals, dtype=np.float64), np.asarray(axis, dtype=np.float64)
    weights, dimension = _weights(n, space), float(space.dimension)
    if weights is None:
        return None
    count = len(n)
    scale = float(weights @ size) / count
    if scale <= 0.0:
        return None
    product = (weights[:, None] * vectors).T @ n / count
    product = 0.5 * (product + product.T)
    matrix = factor / scale * (product - np.trace(product) / dimension * space.identity)
    # 3/2 a·T·a of a tensor without trace: its value along the axis less that across it; 2 a·T·a
    along = (vectors @ a) * (n @ a) - np.einsum("ci,ci->c", vectors, n) / dimension
    less = dimension / (dimension - 1.0)
    ratio = float(weights @ along) / count / scale
    # By how much each contact moves the mean, times their number. A contact counts in the mean, and
    # moves C, and so the weights of all: without this second part the error would be several times
    # too large.
    values = along - ratio * size
    through = space.second_order * ((weights**2 * values)[:, None] * n).T @ n / count
    moved = weights * values - np.einsum("ci,ij,cj->c", n, through, n)
    error = less * factor / scale * np.std(moved, ddof=1) / np.sqrt(count) if count > 1 else None
    return DirectionalMean(matrix, less * factor * ratio, None if error is None else float(error))


def _weights(normals: FloatArray, space: Space) -> FloatArray | None:
    """1 / (1 + n·C·n) of each contact; None where that is not above 0."""
    fabric = contact_fabric(normals, space)
    if fabric is None:
        return None
    deviator = space.second_order * (fabric.matrix - space.identity / space.dimension)
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
    "bn": "anisotropy of branch lengths, 3/2 a·bn·a, of discs 2 a·bn·a",
    "fn": "anisotropy of normal forces, 3/2 a·fn·a, of discs 2 a·fn·a",
    "ft": "anisotropy of tangential forces, 3/2 a·ft·a, of discs 2 a·ft·a",
    "gc_strong": "anisotropy of the strong contacts",
    "gc_weak": "anisotropy of the weak contacts",
}


class Forces:
    """The columns of branches, forces, and strong and weak contacts."""

    columns = (
        *(
            Column(f"{name}_{one}", float, "", f"{one} of {what}")
            for name, what in TENSORS.items()
            for one in COMPONENTS
        ),
        *(
            Column(f"alpha_{name}_axial{suffix}", float, "", meaning)
            for name, what in AXIAL.items()
            for suffix, meaning in (
                ("", f"{what}, signed, along the loading axis"),
                ("_se", "its standard error if contacts were independent"),
            )
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None without contacts."""
        found: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        normals, axis, forces = measured.normals, measured.axis, measured.forces
        space = measured.space
        if forces is None:
            return found
        found |= _mean_values("bn", branch_fabric(normals, forces.branch, axis, space))
        found |= _mean_values("fn", normal_force_fabric(normals, forces.force_n, axis, space))
        if forces.force is not None:
            mean = tangential_force_fabric(normals, forces.force, axis, space)
            found |= _mean_values("ft", mean)
        if len(normals):
            # what differs from the mean by rounding alone is equal to it
            strong = (
                forces.force_n > forces.force_n.mean() + ROUNDING * np.abs(forces.force_n).max()
            )
            found |= _contact_values("gc_strong", normals[strong], axis, space)
            found |= _contact_values("gc_weak", normals[~strong], axis, space)
        return found


def _mean_values(name: str, mean: DirectionalMean | None) -> dict[str, float | None]:
    if mean is None:
        return {}
    components = {f"{name}_{one}": float(mean.matrix[place]) for one, place in COMPONENTS.items()}
    return {
        **components,
        f"alpha_{name}_axial": mean.axial,
        f"alpha_{name}_axial_se": mean.axial_se,
    }


def _contact_values(
    name: str, normals: FloatArray, axis: FloatArray, space: Space
) -> dict[str, float | None]:
    tensor: FabricTensor | None = contact_fabric(normals, space)
    if tensor is None:
        return {}
    return {
        **{f"{name}_{one}": value for one, value in tensor.components().items()},
        f"alpha_{name}_axial": tensor.axial(axis),
        f"alpha_{name}_axial_se": axial_error(normals, axis, space),
    }


def doubts_of_forces(measured: Measured) -> dict[str, str]:
    """Why some of these columns are empty, or 0, by the code of a note."""
    forces = measured.forces
    if forces is None or not len(measured.normals):
        return {}
    texts = {}
    normal = forces.force_n
    if _weights(measured.normals, measured.space) is None:
        texts["few_contacts"] = (
            "the contacts are so few, or so anisotropic, that 1 + n·C·n is not above 0 in "
            "some direction: bn, fn and ft are empty"
        )
    elif normal.sum() <= 0.0:
        texts["tension"] = (
            "the contacts pull in the mean, so fn and ft are empty: is the force in the dump "
            "that on the other grain?"
        )
    if forces.force is None:
        texts["no_tangential"] = (
            "the dump has the normal part of the contact forces only: ft is empty"
        )
    elif (
        np.abs(forces.force - normal[:, None] * measured.normals).max()
        <= NO_FRICTION * np.abs(normal).mean()
    ):
        # all forces are along the normals, but for the digits of the dump
        texts["no_tangential"] = (
            "no contact has a tangential force, so ft is 0: are the contacts without friction, "
            "or is the force of `contact_columns` its normal part only (LAMMPS: name tx, ty, "
            "tz too)?"
        )
    return texts
