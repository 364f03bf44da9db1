"""Fabric tensors: symmetric second-order tensors of trace 1, such as that of contact normals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from scanfab.base.column import Column, numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import spelt_place
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import error_of_mean

FABRICS = {"vs": "void fabric", "c": "contact fabric"}
COMPONENTS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def axial(tensor: npt.NDArray[np.float64], axis: npt.ArrayLike, space: Space = SPACE) -> FloatArray:
    """
    Signed anisotropy along an axis: a·G·a - (1 - a·G·a)/2, in a plane a·G·a - b·G·b.

    It is linear in G and so nearly unbiased for small anisotropy: plot and correlate this value. If
    the principal axes turn away from the axis, it is less than the intensity. In a plane, b is the
    unit vector normal to a.

    Parameters
    ----------
    tensor : ndarray, shape (..., 3, 3)
        Fabric tensors G of trace 1, dimensionless.
    axis : array_like, shape (3,)
        Unit vector a.
    space : Space, optional
        The plane of the tensors, if the grains are discs.

    Returns
    -------
    ndarray, shape (...)
        Dimensionless.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.tensor import axial
    >>> float(axial(np.diag([0.25, 0.25, 0.5]), (0, 0, 1)))
    0.25
    """
    unit = np.asarray(axis, dtype=np.float64)
    along: FloatArray = np.asarray(space.axial(np.asarray(tensor @ unit @ unit)))
    return along


def weighted_tensors(axes: FloatArray, lengths: FloatArray) -> FloatArray:
    """
    Fabric tensors Σ w ℓ n⊗n / Σ w ℓ, with sums over the axes of each replicate.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors n.
    lengths : ndarray, shape (R, D, ...)
        Weighted mean lengths w ℓ of one or several regions along the axes.

    Returns
    -------
    ndarray, shape (R, ..., 3, 3)
        Dimensionless tensors of trace 1.
    """
    tensors = np.einsum("rd...,rdi,rdj->r...ij", lengths, axes, axes)
    tensors /= lengths.sum(axis=1)[..., None, None]
    return np.asarray(tensors)


@dataclass(frozen=True, eq=False)
class FabricTensor:
    """
    A fabric tensor G, dimensionless.

    Parameters
    ----------
    matrix : ndarray, shape (3, 3)
        Components, with trace 1.
    space : Space, optional
        The plane of the tensor, if the grains are discs; components normal to it are 0.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import FabricTensor
    >>> round(FabricTensor(np.diag([0.3, 0.3, 0.4])).alpha, 12)
    0.1
    """

    matrix: FloatArray
    space: Space = SPACE

    def __repr__(self) -> str:
        values = ", ".join(f"{x:.4g}" for x in self.principal_values[: self.space.dimension])
        return (
            f"FabricTensor: alpha {self.alpha:.3g}, principal values {values}, major axis "
            f"{spelt_place(np.round(self.major_axis, 4))}"
        )

    @cached_property
    def _eigen(self) -> tuple[FloatArray, FloatArray]:
        values, vectors = np.linalg.eigh(self.matrix)
        return values[::-1], vectors.T[::-1]

    @property
    def principal_values(self) -> FloatArray:
        """Principal values, largest first, shape (3,); in a plane the last is 0."""
        return self._eigen[0]

    @property
    def principal_axes(self) -> FloatArray:
        """Unit vectors as rows, in the order of the principal values, shape (3, 3)."""
        return self._eigen[1]

    @property
    def major_axis(self) -> FloatArray:
        """Unit vector of the largest principal value, shape (3,); of n and -n, the upper."""
        axis = self.principal_axes[0]
        leading = axis[np.flatnonzero(np.abs(axis) > 1e-12)[-1]]
        upper: FloatArray = axis * np.sign(leading)
        return upper

    def angle_to(self, other: FabricTensor) -> float:
        """
        Angle between the major axes of two tensors.

        Parameters
        ----------
        other : FabricTensor
            The second tensor.

        Returns
        -------
        float
            0 to 90 degrees.
        """
        cosine = abs(float(self.major_axis @ other.major_axis))
        return float(np.degrees(np.arccos(min(cosine, 1.0))))

    @property
    def alpha(self) -> float:
        """
        α: largest minus smallest principal value.

        It is never negative, so noise raises it. In a plane, only its two principal values count.
        """
        return float(self.principal_values[0] - self.principal_values[self.space.dimension - 1])

    def axial(self, axis: npt.ArrayLike) -> float:
        """
        Signed anisotropy along an axis: a·G·a - (1 - a·G·a)/2, in a plane a·G·a - b·G·b.

        It is linear in G and so nearly unbiased for small anisotropy: plot and correlate this
        value.

        Parameters
        ----------
        axis : array_like, shape (3,)
            Unit vector a.

        Returns
        -------
        float
        """
        return float(axial(self.matrix, axis, self.space))

    def components(self) -> dict[str, float]:
        """
        The six components by name, ``xx`` to ``yz``.

        Returns
        -------
        dict of str to float
        """
        return {name: float(self.matrix[place]) for name, place in COMPONENTS.items()}


def contact_fabric(normals: npt.ArrayLike, space: Space = SPACE) -> FabricTensor | None:
    """
    The fabric tensor of contact normals: G_c = (1/N_c) Σ n⊗n.

    Parameters
    ----------
    normals : array_like, shape (M, 3)
        Unit normals, dimensionless; their signs do not matter.
    space : Space, optional
        The plane of the normals, if the grains are discs.

    Returns
    -------
    FabricTensor or None
        None without contacts.

    References
    ----------
    Satake (1982) and Oda (1982); Eq. 2 of Theocharis, Vairaktaris and Dafalias, 3D scan line method
    for identifying void fabric of granular materials, Powders and Grains 2017, EPJ Web of
    Conferences 140.

    Examples
    --------
    >>> from scanfab import contact_fabric
    >>> contact_fabric([[0, 0, 1], [0, 0, -1]]).matrix[2, 2]
    np.float64(1.0)
    """
    vectors = np.asarray(normals, dtype=np.float64)
    if len(vectors) == 0:
        return None
    return FabricTensor(vectors.T @ vectors / len(vectors), space)


def axial_error(normals: npt.ArrayLike, axis: npt.ArrayLike, space: Space = SPACE) -> float | None:
    """
    Standard error of the contact fabric's axial anisotropy, for independent contacts.

    It is the standard deviation of (3(a·n)² - 1)/2 over the contacts, in a plane of 2(a·n)² - 1,
    divided by √N_c. Dimensionless; None for fewer than two contacts.
    """
    cosine = np.asarray(normals, dtype=np.float64) @ np.asarray(axis, dtype=np.float64)
    return error_of_mean(space.axial(cosine**2))


def of_both(
    name: str, meaning: str, of: Mapping[str, str] = FABRICS, unit: str = ""
) -> tuple[Column, ...]:
    """
    Two columns: one of the void fabric and one of the contact fabric.

    In name and meaning, {0} is replaced by ``vs`` or ``c``, and {1} by its words in ``of``.

    Examples
    --------
    >>> from scanfab.fabric.tensor import of_both
    >>> [(column.name, column.meaning) for column in of_both("f_{0}", "a of the {1}")]
    [('f_vs', 'a of the void fabric'), ('f_c', 'a of the contact fabric')]
    """
    return numbers({name.format(*words): meaning.format(*words) for words in of.items()}, unit)


def tensor_columns(name: str, what: str) -> tuple[Column, ...]:
    """
    The columns of a tensor: its six components, α and the signed anisotropy.

    Examples
    --------
    >>> from scanfab.fabric.tensor import tensor_columns
    >>> [column.name for column in tensor_columns("c", "contact fabric")][4:]
    ['gc_xz', 'gc_yz', 'alpha_c', 'alpha_c_axial']
    """
    components = {f"g{name}_{k}": f"{k} of the {what} tensor, whose trace is 1" for k in COMPONENTS}
    return numbers(
        {
            **components,
            f"alpha_{name}": f"largest minus smallest principal value of the {what}",
            f"alpha_{name}_axial": f"signed anisotropy of the {what} along the loading axis",
        }
    )


def tensor_values(
    name: str, tensor: FabricTensor | None, axis: npt.ArrayLike
) -> dict[str, float | None]:
    """Values of the columns of :func:`tensor_columns`; all None without a tensor."""
    if tensor is None:
        return dict.fromkeys(column.name for column in tensor_columns(name, ""))
    return {
        **{f"g{name}_{place}": value for place, value in tensor.components().items()},
        f"alpha_{name}": tensor.alpha,
        f"alpha_{name}_axial": tensor.axial(axis),
    }
