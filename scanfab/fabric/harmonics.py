"""
Harmonics of orders 2 and 4 of void lengths and contact normals, and their fourth-order tensors.

The harmonics are a_l = (2l + 1) <P_l(a·n)> about the loading axis a, with the Legendre polynomials
P_l. They are coefficients of the distribution E(n) = 1/4π (1 + a_2 P_2 + a_4 P_4 + ...). For discs,
with θ the angle to the axis, a_l = 2 <cos lθ> and E = 1/2π (1 + a_2 cos 2θ + ...). The mean <...>
runs over the contacts, or for voids over all directions with the weight ℓ(n). Source for the
tensors: Kanatani (1984), doi:10.1016/0020-7225(84)90090-9.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scanfab.base.column import Column, numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import harmonics_of
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.measured import Measured

ORDERS = (2, 4)
FOURTH = "81 numbers, of which the last index changes fastest; in JSON and Parquet only"


def harmonic(order: int, cosine: FloatArray, space: Space = SPACE) -> FloatArray:
    """
    The function that a harmonic averages: the Legendre polynomial P_l, for discs cos lθ.

    Parameters
    ----------
    order : int
        Order l, 2 or 4.
    cosine : ndarray
        Cosine of the angle between direction and axis, of any shape.
    space : Space, optional
        The plane of the directions, if the grains are discs.

    Returns
    -------
    ndarray
        Values, in the shape of the cosines.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.base.space import Space
    >>> from scanfab.fabric.harmonics import harmonic
    >>> harmonic(2, np.zeros(1)), harmonic(2, np.zeros(1), Space(2))
    (array([-0.5]), array([-1.]))
    """
    square = cosine**2
    # P_2, or in a plane cos 2θ
    second: FloatArray = space.axial(square)
    if order == 4 and space.is_plane:
        return 2.0 * second**2 - 1.0
    return second if order == 2 else (35.0 * square**2 - 30.0 * square + 3.0) / 8.0


def tensor4(vectors: FloatArray, weights: FloatArray) -> FloatArray:
    """
    The weighted mean of n⊗n⊗n⊗n.

    Parameters
    ----------
    vectors : ndarray, shape (M, 3)
        Unit vectors.
    weights : ndarray, shape (M,)
        Weights with any sum above 0.

    Returns
    -------
    ndarray, shape (3, 3, 3, 3)
        Symmetric in all indices; the trace over both pairs of indices is 1.

    References
    ----------
    Kanatani, Distribution of directional data and fabric tensors, Int. J. Eng. Sci. 22 (1984),
    doi:10.1016/0020-7225(84)90090-9: N of rank 4.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.harmonics import tensor4
    >>> tensor4(np.eye(3)[1:], np.ones(2))[2, 2, 2, 2]
    np.float64(0.5)
    """
    pairs = np.einsum("ci,cj->cij", vectors, vectors).reshape(-1, 9)
    tensor: FloatArray = (weights[:, None] * pairs).T @ pairs / weights.sum()
    return tensor.reshape(3, 3, 3, 3)


class Harmonics:
    """Columns of the harmonics, and of the tensors, which CSV and TSV cannot hold."""

    columns = (
        *numbers(
            {
                f"{name}_a{order}{suffix}": meaning
                for name, what in (("vs", "the mean void lengths"), ("c", "the contact normals"))
                for order in ORDERS
                for suffix, meaning in (
                    ("", f"harmonic of order {order} of {what} about the loading axis"),
                    ("_se", "its standard error"),
                )
            }
        ),
        Column("vs_tensor4", list, "", f"fourth-order void fabric Σ w ℓ nnnn / Σ w ℓ: {FOURTH}"),
        Column("c_tensor4", list, "", f"fourth-order contact fabric (1/N_c) Σ nnnn: {FOURTH}"),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; None for a fabric that does not exist."""
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        void, axis, space, normals = measured.void, measured.axis, measured.space, measured.normals
        # values whose mean is a harmonic, by the name of its column
        each: dict[str, FloatArray] = {}
        if void is not None:
            weights = void.weights * void.mean_lengths
            weights = weights / weights.sum(axis=1, keepdims=True)
            for order in ORDERS:
                # in a plane, a rule of too few angles mixes this order with others
                if not space.is_plane or void.axes.shape[1] >= order // 2 + 2:
                    # the error follows from the scatter of the replicates, as for the tensor
                    means = np.sum(weights * harmonic(order, void.axes @ axis, space), axis=1)
                    each[f"vs_a{order}"] = harmonics_of(order, space) * means
            tensor = tensor4(void.axes.reshape(-1, 3), weights.ravel())
            row["vs_tensor4"] = tensor.ravel().tolist()
        if len(normals):
            for order in ORDERS:
                # the error is that of the mean over independent contacts
                values = harmonic(order, normals @ axis, space)
                each[f"c_a{order}"] = harmonics_of(order, space) * values
            row["c_tensor4"] = tensor4(normals, np.ones(len(normals))).ravel().tolist()
        for name, values in each.items():
            row |= {name: float(values.mean()), f"{name}_se": error_of_mean(values)}
        return row
