"""The window of a whole sample in which all grains are known: an ellipsoid within its outermost."""

from __future__ import annotations

import numpy as np

from scanfab.base.shapes import ellipse, ellipsoid
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.packing.window import Window


def inner_ellipsoid(position: FloatArray, largest: float, space: Space = SPACE) -> Window | None:
    """
    The ellipsoid of a sample's shape that lies a largest radius within the hull of its centres.

    With σ_k the standard deviations of the centres along their principal axes, and facets of their
    convex hull with normals n and distances d from the mean, its semi-axes are σ_k times the
    smallest of (d - r_max) / √(Σ σ_k² n_k²): then it touches the hull moved inwards by r_max, and
    each grain that reaches into it has its centre in the hull.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Centres.
    largest : float
        Radius of the largest grain.
    space : Space, optional
        The plane in which the centres lie, if they do: then it is an ellipse there.

    Returns
    -------
    Window or None
        None of a sample that is flat, or too small to hold any.

    Examples
    --------
    A cube of 11 x 11 x 11 grains, 10 from centre to centre, has the sphere of radius 5 - 0.5:

    >>> import numpy as np
    >>> from scanfab.packing.inner import inner_ellipsoid
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(11.0)]), axis=-1).reshape(-1, 3)
    >>> round(inner_ellipsoid(grid, 0.5).radius, 9)
    4.5
    """
    # loaded here, as few scans need it
    from scipy.spatial import ConvexHull, QhullError

    if not len(position):
        return None
    along = list(space.along)
    center = position.mean(axis=0)
    if space.across is not None:
        center[space.across] = position[0, space.across]
    branch = (position - center)[:, along]
    try:
        facets = ConvexHull(branch).equations
    except (QhullError, ValueError):
        return None
    variance, axes = np.linalg.eigh(np.cov(branch.T))
    normals, distance = facets[:, :-1] @ axes, -facets[:, -1]
    scale = float(np.min((distance - largest) / np.sqrt(normals**2 @ variance)))
    if scale <= 0.0:
        return None
    semi_axes = scale * np.sqrt(variance)
    if space.is_plane:
        return Window(center, ellipse(semi_axes, space, axes.T @ space.basis[:2]))
    return Window(center, ellipsoid(semi_axes, axes.T))
