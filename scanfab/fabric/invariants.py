"""
Invariants of the fabric tensors: F = 15/2 (G - I/3), a = √(3/2 F:F), principal values and axes, b.

Of discs F = 4 (G - I/2), a = √(1/2 F:F), and there is no b.

Kanatani (1984), doi:10.1016/0020-7225(84)90090-9: F is the second order of the distribution of
directions 1/4π (1 + n·F·n). a is never negative: in an isotropic sample it is what the scatter of
its few contacts or segments makes it, and the columns ``_bias`` say how much that is.
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

# By dimension: components of a tensor's deviator, and the variance of each of n⊗n, of a unit vector
# n that has any direction alike.
COMPONENTS_OF_DEVIATOR = {3: 5, 2: 2}
CONTACT_VARIANCE = {3: 2.0 / 15.0, 2: 0.25}
# b says nothing where largest and smallest principal value differ by less, over √N
LEAST_ALPHA = 3.0


def bias_of(space: Space) -> float:
    """
    What components of a standard deviation of 1 make of a in an isotropic sample.

    They are of equal variance, so that a is √(3/2) · 15/2 times the root of the sum of their
    squares, which is the mean of chi with five degrees of freedom, 2.1277; in a plane with two.
    """
    freedom = COMPONENTS_OF_DEVIATOR[space.dimension]
    mean_chi = math.sqrt(2.0) * math.gamma(0.5 * (freedom + 1)) / math.gamma(0.5 * freedom)
    return math.sqrt(space.intensity) * space.second_order * mean_chi


def fabric_deviator(matrix: FloatArray, space: Space = SPACE) -> FloatArray:
    """
    F = 15/2 (G - I/3), of discs 4 (G - I/2).

    Parameters
    ----------
    matrix : ndarray, shape (..., 3, 3)
        Fabric tensors of trace 1.
    space : Space, optional
        The plane that they are of, if they are.

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
    a = √(3/2 F:F), which is 7.5 |alpha_axial| for transverse isotropy about the axis.

    Of discs a = √(1/2 F:F), which is 2 alpha.

    Parameters
    ----------
    matrix : ndarray, shape (3, 3)
        Fabric tensor of trace 1.
    space : Space, optional
        The plane that it is of, if it is.

    Returns
    -------
    float
        0 or more.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.invariants import intensity
    >>> round(intensity(np.diag([0.3, 0.3, 0.4])), 9)
    0.75
    """
    return float(math.sqrt(space.intensity) * np.linalg.norm(fabric_deviator(matrix, space)))


ERRORS = {"vs": "of the scan", "c": "if contacts were independent"}
BIAS = {"vs": "the noise of this scan", "c": "as many independent contacts"}
DISCS = "of discs √(1/2 F:F), F = 4 (G - I/2)"


class Invariants:
    """The columns of the invariants."""

    columns = (
        *of_both("f_{0}", f"a = √(3/2 F:F) of the {{1}}, F = 15/2 (G - I/3); {DISCS}"),
        *of_both("f_{0}_bias", "what {1} would give f_{0} in the mean", BIAS),
        *numbers(
            {
                f"g{one}_{k}": f"principal value of the {what}, {which}"
                for one, what in FABRICS.items()
                for k, which in ((1, "the largest"), (2, "the middle one"), (3, "the smallest"))
            }
        ),
        *of_both(
            "b_{0}",
            "(G2 - G3)/(G1 - G3) of the {1}, 0 to 1; empty where G1 - G3 is below 3/√N, and of "
            "discs",
        ),
        *numbers(
            {
                f"{name}_se": f"standard error of {name}, {what}"
                for one, what in ERRORS.items()
                for name in (f"f_{one}", *(f"g{one}_{k}" for k in (1, 2, 3)))
            }
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None of a fabric that does not exist."""
        found: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        space, void, contact = measured.space, measured.void, measured.contact
        if void is not None:
            tensors = void.replicates
            found |= _values("vs", void.tensor, measured.segment_count, tensors)
            if len(tensors) > 1:
                # all are of trace 1, so the components of the deviator share what there is of
                # variance in the mean of the replicates
                freedom = COMPONENTS_OF_DEVIATOR[space.dimension]
                variance = float(np.sum(np.var(tensors, axis=0, ddof=1))) / freedom / len(tensors)
                found["f_vs_bias"] = bias_of(space) * math.sqrt(variance)
        if contact is not None:
            n, count = measured.normals, len(measured.normals)
            found |= _values("c", contact, count, np.einsum("ci,cj->cij", n, n))
            variance = CONTACT_VARIANCE[space.dimension] / count
            found["f_c_bias"] = bias_of(space) * math.sqrt(variance)
        return found


def _values(
    name: str, tensor: FabricTensor, count: int, each: FloatArray
) -> dict[str, float | None]:
    """
    a, the principal values and b with their errors.

    G is the mean of each tensor, shape (M, 3, 3), and to first order a and the principal values are
    linear in G: values of a form A, A:G. ``count`` is the number of segments or contacts.
    """
    space, (largest, middle, smallest) = tensor.space, tensor.principal_values.tolist()
    found: dict[str, float | None] = {
        f"f_{name}": intensity(tensor.matrix, space),
        **{f"g{name}_{k}": one for k, one in enumerate((largest, middle, smallest), start=1)},
    }
    alpha = largest - smallest
    if count > 0 and not space.is_plane and alpha >= LEAST_ALPHA / math.sqrt(count):
        found[f"b_{name}"] = (middle - smallest) / alpha
    forms = {f"g{name}_{k}": np.outer(one, one) for k, one in enumerate(tensor.principal_axes, 1)}
    deviator = fabric_deviator(tensor.matrix, space)
    size = float(np.linalg.norm(deviator))
    if size > 0.0:
        forms[f"f_{name}"] = math.sqrt(space.intensity) * space.second_order * deviator / size
    for of, form in forms.items():
        found[f"{of}_se"] = error_of_mean(np.einsum("cij,ij->c", each, form))
    return found
