"""
Contact fabric: G_c = (1/N_c) Σ n⊗n over the contacts, Eq. 2 of the 2017 paper.

Theocharis, Vairaktaris and Dafalias (2017), Powders and Grains 2017, EPJ Web of
Conferences 140; the tensor is that of Satake (1982) and Oda (1982).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.fabric.errors import error_of_mean
from scanfab.fabric.tensor import FabricTensor


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
