"""
Invariants of the fabric tensors: F = 15/2 (G - I/3), a = √(3/2 F:F), principal values and axes, b.

For discs F = 4 (G - I/2) and a = √(1/2 F:F), and b does not exist.

F is the second order of the distribution of directions 1/4π (1 + n·F·n) (Kanatani 1984,
doi:10.1016/0020-7225(84)90090-9). The intensity a is never negative, so noise raises it: even in an
isotropic sample it is above 0. The columns ``_bias`` give its expected value there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scanfab.base.column import numbers
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import FABRICS, FabricTensor, of_both

# By dimension: number of independent components of a tensor's deviator, and variance of each of
# these components of n⊗n for a unit vector n of random direction.
COMPONENTS_OF_DEVIATOR = {3: 5, 2: 2}
CONTACT_VARIANCE = {3: 2.0 / 15.0, 2: 0.25}
# b is not given if the largest and smallest principal value differ by less than this over √N
LEAST_ALPHA = 3.0


def bias_of(space: Space) -> float:
    """
    Expected intensity a of an isotropic sample whose tensor components have standard error 1.

    The five components of the deviator have equal variance. The root of the sum of their squares
    follows the chi distribution with five degrees of freedom, whose mean is 2.1277, and a is
    √(3/2) · 15/2 times this root. In a plane there are two components.
    """
    freedom = COMPONENTS_OF_DEVIATOR[space.dimension]
    mean_chi = math.sqrt(2.0) * math.gamma(0.5 * (freedom + 1)) / math.gamma(0.5 * freedom)
    return math.sqrt(space.intensity) * space.second_order * mean_chi


def fabric_deviator(matrix: FloatArray, space: Space = SPACE) -> FloatArray:
    """
    The fabric deviator F = 15/2 (G - I/3), for discs F = 4 (G - I/2).

    Parameters
    ----------
    matrix : ndarray, shape (..., 3, 3)
        Fabric tensors G of trace 1.
    space : Space, optional
        The plane of the tensors, if the grains are discs.

    Returns
    -------
    ndarray, shape (..., 3, 3)

    References
    ----------
    Kanatani (1984), doi:10.1016/0020-7225(84)90090-9.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.invariants import fabric_deviator
    >>> np.round(np.diag(fabric_deviator(np.diag([0.3, 0.3, 0.4]))), 9)
    array([-0.25, -0.25,  0.5 ])
    """
    return space.second_order * (matrix - space.identity / space.dimension)


def intensity(matrix: FloatArray, space: Space = SPACE) -> float:
    """
    The intensity of anisotropy, a = √(3/2 F:F).

    For transverse isotropy about the loading axis, a is 7.5 |alpha_axial|. For discs it is
    a = √(1/2 F:F) = 2 alpha.

    Parameters
    ----------
    matrix : ndarray, shape (3, 3)
        Fabric tensor of trace 1.
    space : Space, optional
        The plane of the tensor, if the grains are discs.

    Returns
    -------
    float
        Dimensionless, 0 or more.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.invariants import intensity
    >>> round(intensity(np.diag([0.3, 0.3, 0.4])), 9)
    0.75
    """
    return float(math.sqrt(space.intensity) * np.linalg.norm(fabric_deviator(matrix, space)))


ERRORS = {"vs": "due to the scan", "c": "for independent contacts"}
BIAS = {"vs": "from the noise of this scan", "c": "with as many independent contacts"}
DISCS = "for discs √(1/2 F:F), F = 4 (G - I/2)"


class Invariants:
    """Columns of the invariants of both fabric tensors."""

    columns = (
        *of_both("f_{0}", f"a = √(3/2 F:F) of the {{1}}, F = 15/2 (G - I/3); {DISCS}"),
        *of_both("f_{0}_bias", "expected value of f_{0} in an isotropic sample {1}", BIAS),
        *numbers(
            {
                f"g{fabric}_{k}": f"principal value of the {what}, {which}"
                for fabric, what in FABRICS.items()
                for k, which in ((1, "the largest"), (2, "the middle one"), (3, "the smallest"))
            }
        ),
        *of_both(
            "b_{0}",
            "(G2 - G3)/(G1 - G3) of the {1}, 0 to 1; empty if G1 - G3 is below 3/√N, and for discs",
        ),
        *numbers(
            {
                f"{name}_se": f"standard error of {name}, {what}"
                for fabric, what in ERRORS.items()
                for name in (f"f_{fabric}", *(f"g{fabric}_{k}" for k in (1, 2, 3)))
            }
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; None for a fabric that does not exist."""
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        space, void, contact = measured.space, measured.void, measured.contact
        if void is not None:
            tensors = void.replicates
            row |= _values("vs", void.tensor, measured.segment_count, tensors)
            if len(tensors) > 1:
                # All replicates have trace 1, so only the deviator scatters. Its independent
                # components share the variance of the mean over the replicates.
                freedom = COMPONENTS_OF_DEVIATOR[space.dimension]
                variance = float(np.sum(np.var(tensors, axis=0, ddof=1))) / freedom / len(tensors)
                row["f_vs_bias"] = bias_of(space) * math.sqrt(variance)
        if contact is not None:
            n, count = measured.normals, len(measured.normals)
            row |= _values("c", contact, count, np.einsum("ci,cj->cij", n, n))
            variance = CONTACT_VARIANCE[space.dimension] / count
            row["f_c_bias"] = bias_of(space) * math.sqrt(variance)
        return row


def _values(
    name: str, tensor: FabricTensor, count: int, each: FloatArray
) -> dict[str, float | None]:
    """
    Intensity, principal values and b of a tensor, with standard errors.

    The tensor G is the mean of the tensors ``each``, shape (M, 3, 3). To first order, a and the
    principal values are linear in G: each has a matrix A so that its change is A:dG. The standard
    error is that of the mean of A:G over ``each``. ``count`` is the number of segments or contacts.
    """
    space, (largest, middle, smallest) = tensor.space, tensor.principal_values.tolist()
    row: dict[str, float | None] = {
        f"f_{name}": intensity(tensor.matrix, space),
        **{f"g{name}_{k}": value for k, value in enumerate((largest, middle, smallest), start=1)},
    }
    alpha = largest - smallest
    if count > 0 and not space.is_plane and alpha >= LEAST_ALPHA / math.sqrt(count):
        row[f"b_{name}"] = (middle - smallest) / alpha
    forms = {
        f"g{name}_{k}": np.outer(axis, axis) for k, axis in enumerate(tensor.principal_axes, 1)
    }
    deviator = fabric_deviator(tensor.matrix, space)
    size = float(np.linalg.norm(deviator))
    if size > 0.0:
        forms[f"f_{name}"] = math.sqrt(space.intensity) * space.second_order * deviator / size
    for of, form in forms.items():
        row[f"{of}_se"] = error_of_mean(np.einsum("cij,ij->c", each, form))
    return row
