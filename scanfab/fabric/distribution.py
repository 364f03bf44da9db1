"""
The directional distribution of a scan: an even function on the sphere fitted to the mean lengths.

For discs it is an even function on the circle of their plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.scan.directions import direction_rule

HIGHEST_DEGREE = 6
# around a circle
POINTS = 180
# how unevenly directions may cover the sphere for a fit: the ratio of largest to smallest
# singular value, 1 for even coverage
WORST_COVERAGE = 5.0


@dataclass(frozen=True, eq=False)
class EvenFunction:
    """f(n) = f(-n) on the unit sphere: even harmonics up to a degree."""

    degree: int
    coefficients: FloatArray
    """Of functions that are orthonormal on the sphere, the mean of whose squares is 1."""
    space: Space = SPACE
    """The plane in whose circle the directions lie, if they do."""

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Values at unit vectors, shape (..., 3) to (...)."""
        flat = np.reshape(np.asarray(directions, dtype=np.float64), (-1, 3))
        orthonormal = _orthonormal(self.degree, self.space)
        values = even_polynomials(flat, self.degree, self.space) @ orthonormal @ self.coefficients
        return np.asarray(values.reshape(np.shape(directions)[:-1]))


def fit_even(
    axes: FloatArray, values: FloatArray, weights: FloatArray, space: Space = SPACE
) -> EvenFunction:
    """
    Weighted least-squares fit of an even function.

    Parameters
    ----------
    axes : ndarray, shape (M, 3)
        Unit vectors.
    values : ndarray, shape (M,)
        In any unit.
    weights : ndarray, shape (M,)
        Proportional to the inverse variance of each value.
    space : Space, optional
        The plane in which the axes lie, if they do.

    Returns
    -------
    EvenFunction
        Of the highest degree, at most 6, that the axes are enough for.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.fabric.distribution import direction_points, fit_even
    >>> n = direction_points()[0]
    >>> f = fit_even(n, 1 + n[:, 2] ** 2, np.ones(len(n)))
    >>> round(float(f([0, 0, 1])), 12)
    2.0
    """
    root = np.sqrt(weights / weights.sum())
    for degree in range(HIGHEST_DEGREE, -1, -2):
        matrix = even_polynomials(axes, degree, space) @ _orthonormal(degree, space)
        matrix *= root[:, None]
        # whether the axes are enough, and even enough
        if len(matrix) >= matrix.shape[1] and np.linalg.cond(matrix) < WORST_COVERAGE:
            break
    return EvenFunction(degree, np.linalg.lstsq(matrix, values * root, rcond=None)[0], space)


def mean_length_function(
    axes: FloatArray,
    length: FloatArray,
    segments: IntArray | FloatArray,
    space: Space = SPACE,
) -> EvenFunction | None:
    """
    ℓ(n), fitted to the sums of a scan.

    Parameters
    ----------
    axes : ndarray, shape (R, D, 3)
        Unit vectors of each replicate.
    length, segments : ndarray, shape (R, D)
        Sum of the lengths (dump's unit) and number of one variant's kept segments. For the second
        moment, sums of squared lengths and of lengths take the places of these two.
    space : Space, optional
        The plane in which the axes lie, if they do.

    Returns
    -------
    EvenFunction or None
        In the dump's length unit; None if no segment is kept.
    """
    kept = segments > 0
    if not kept.any():
        return None
    number = segments[kept].astype(np.float64)
    return fit_even(axes[kept], length[kept] / number, number, space)


@cache
def direction_points(space: Space = SPACE) -> tuple[FloatArray, FloatArray]:
    """
    Points all over the unit sphere, or around the circle of a plane, and their weights of sum 1.

    Shapes (974, 3) and (974,), or (180, 3) and (180,).
    """
    if not space.is_plane:
        rule = direction_rule("lebedev:53")
        return np.concatenate([rule.axes, -rule.axes]), np.tile(0.5 * rule.weights, 2)
    angle = 2.0 * np.pi * np.arange(POINTS) / POINTS
    first, second = (np.eye(3)[k] for k in sorted(space.along))
    points = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    return points, np.full(POINTS, 1.0 / POINTS)


def harmonics_of(degree: int, space: Space) -> int:
    """How many independent harmonics of a degree there are; of degree 2 those of a tensor."""
    return 2 if space.is_plane else 2 * degree + 1


def even_polynomials(axes: FloatArray, degree: int, space: Space) -> FloatArray:
    """
    A basis of the even functions up to a degree, at unit vectors, shape (M, 3) to (M, functions).

    On the sphere the homogeneous polynomials of an even degree are the sums of the even harmonics
    up to that degree, so monomials are enough; around a circle they are cosines and sines.
    """
    if space.is_plane:
        u, v = space.basis[:2] @ axes.T
        orders = np.arange(2, degree + 1, 2)
        angles = np.arctan2(v, u)[:, None] * orders
        return np.column_stack([np.ones(len(axes)), np.cos(angles), np.sin(angles)])
    powers = [(i, j, degree - i - j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    i, j, k = np.array(powers).T
    x, y, z = (np.vander(one, degree + 1, increasing=True) for one in axes.T)
    design: FloatArray = x[:, i] * y[:, j] * z[:, k]
    return design


@cache
def _orthonormal(degree: int, space: Space) -> FloatArray:
    """The matrix that makes the polynomials orthonormal on the sphere."""
    points, weights = direction_points(space)
    design = even_polynomials(points, degree, space) * np.sqrt(weights)[:, None]
    triangle = np.linalg.qr(design, mode="r")
    inverse: FloatArray = np.linalg.inv(triangle)
    return inverse
