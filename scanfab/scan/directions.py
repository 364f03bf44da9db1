"""Scan directions: unit axes with quadrature weights; every rule knows its degree and its bias."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray

LARGEST_PRODUCT = 999
# equal steps of a plane
MOST_STEPS = 100_000
# degree of the largest design in designs.csv that is in use
FINEST = 21
# Directions of an auto scan: nearly equal weights and few axes, since the random turns of the
# replicates do the rest; in a plane, the number of equal steps.
AUTO_RULE, AUTO_STEPS = "icosahedral:9", 16
# SciPy has rules of degree 13, 25 and 27, too. Their negative weights would amplify noise.
LEBEDEV_DEGREES = (*range(3, 12, 2), *range(15, 24, 2), 29, 31, *range(35, 132, 6))


@dataclass(frozen=True, eq=False)
class DirectionRule:
    """
    A set of axes with weights that sum to 1: a quadrature rule for even functions on the sphere.

    A line runs along n and -n, so an axis stands for both.

    Parameters
    ----------
    name : str
        The name that users write, for instance ``lebedev:11``.
    axes : ndarray
        Unit vectors, shape (D, 3), dimensionless.
    weights : ndarray
        Weights, shape (D,), sum 1, dimensionless.
    degree : int or None
        The rule is exact for polynomials up to this degree; None if it is exact for none.
    turned : bool, optional
        Whether replicates turn the rule at random; a literal grid is only shifted.
    space : Space, optional
        Space of the axes; in a plane, replicates turn them about its normal.
    asked : int, optional
        The number of axes that the user gave, if the user named no rule.

    Examples
    --------
    >>> from scanfab import direction_rule
    >>> rule = direction_rule("lebedev:11")
    >>> rule
    DirectionRule lebedev:11: 25 axes, exact to degree 11
    >>> rule.axes.shape, round(float(rule.weights.sum()), 12)
    ((25, 3), 1.0)
    """

    name: str
    axes: FloatArray
    weights: FloatArray
    degree: int | None
    turned: bool = True
    space: Space = SPACE
    asked: int | None = None

    def __len__(self) -> int:
        return len(self.axes)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DirectionRule) and (
            (self.name, self.degree, self.turned, self.space)
            == (other.name, other.degree, other.turned, other.space)
            and np.array_equal(self.axes, other.axes)
            and np.array_equal(self.weights, other.weights)
        )

    def __repr__(self) -> str:
        degree = "of no degree" if self.degree is None else f"exact to degree {self.degree}"
        bias = f", bias {self.bias:.2g}" if self.bias else ""
        return f"DirectionRule {self.name}: {counted(len(self), 'axis', 'axes')}, {degree}{bias}"

    @property
    def asked_as(self) -> str:
        """What the user wrote: the name of the rule, or a number of axes."""
        return self.name if self.asked is None else str(self.asked)

    @cached_property
    def isotropic_tensor(self) -> FloatArray:
        """The fabric tensor that the rule gives for a mean length equal in all directions."""
        return np.asarray(np.einsum("d,di,dj->ij", self.weights, self.axes, self.axes))

    @property
    def bias(self) -> float:
        """Anisotropy α of the isotropic tensor to 12 decimal places, which is 0 for a good rule."""
        values = np.linalg.eigvalsh(self.isotropic_tensor)
        return round(float(values[-1] - values[-self.space.dimension]), 12)

    @property
    def is_flat(self) -> bool:
        """Whether all axes lie in one plane (for axes in a plane: along one line)."""
        return bool(np.linalg.eigvalsh(self.isotropic_tensor)[-self.space.dimension] < 1e-9)


def direction_rule(text: str | int) -> DirectionRule:
    """
    The rule that a user names.

    Parameters
    ----------
    text : str or int
        A number of axes N, rounded up to the next Lebedev rule with positive weights, or one of
        ``lebedev:DEGREE``, ``design:DEGREE``, ``icosahedral:DEGREE``, ``product:DEGREE``,
        ``fibonacci:N``,
        ``equal-angle:STEP`` (the printed ranges of Eq. 1 of the 2017 paper, unit weights),
        ``equal-angle-full:STEP`` (the half sphere, unit weights); steps in degrees.

    Returns
    -------
    DirectionRule
        The axes, their weights, and the degree up to which the rule is exact.

    Raises
    ------
    SettingsError
        If there is no such rule.

    Notes
    -----
    Designs are antipodal, with equal weights, and computed for this package. A degree without a
    rule is rounded up to the next that has one.

    References
    ----------
    Lebedev rules, from SciPy: V. I. Lebedev and D. N. Laikov, A quadrature formula for the sphere
    of the 131st algebraic order of accuracy, Doklady Mathematics 59(3), 477-481, 1999.

    Designs: R. S. Womersley, Efficient spherical designs with good geometric properties, 2018,
    doi:10.1007/978-3-319-72456-0_57.

    Equal angles: Theocharis, Vairaktaris and Dafalias, 3D scan line method for identifying void
    fabric of granular materials, Powders and Grains 2017, EPJ Web of Conferences 140.

    Examples
    --------
    >>> from scanfab.scan.directions import direction_rule
    >>> rule = direction_rule("lebedev:11")
    >>> len(rule), rule.degree
    (25, 11)
    """
    text = str(text)
    if re.fullmatch(r"\d+", text):
        return replace(_at_least(int(text)), asked=int(text))
    name, _, argument = text.partition(":")
    if name not in RULES:
        raise SettingsError(
            f"directions: no rule is called {text!r}; expected a number or one of "
            + ", ".join(f"{rule}:{what}" for rule, (_, what, *_) in RULES.items())
        )
    make, what, least, most = RULES[name]
    try:
        value = float(argument) if what == "STEP" else int(argument)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise SettingsError(
            f"directions: expected {name}:{what} with a number from {least:g} to {most:g}, "
            f"found {text!r}"
        )
    return make(value)


def plane_rule(count: int, plane: Space) -> DirectionRule:
    """
    The rule of N equal steps over the half circle of a plane.

    Parameters
    ----------
    count : int
        Number N of axes. The rule is exact to degree 2 N - 2, so two axes give an isotropic tensor
        for an isotropic mean length.
    plane : Space
        Plane of the axes.

    Returns
    -------
    DirectionRule
        A rule whose name is the number N, as users write it.

    Raises
    ------
    SettingsError
        If N is less than 2, or above 100,000.

    Examples
    --------
    >>> from scanfab.base.space import Space
    >>> from scanfab.scan.directions import plane_rule
    >>> plane_rule(6, Space(2))
    DirectionRule 6: 6 axes, exact to degree 10
    """
    if not 2 <= count <= MOST_STEPS:
        raise SettingsError(
            f"directions: expected 2 to {MOST_STEPS} axes in {plane}, found {count}: one axis "
            f"measures nothing across it"
        )
    angle = np.pi * (np.arange(count) + 0.5) / count
    axes = np.column_stack([np.cos(angle), np.sin(angle)]) @ plane.basis[:2]
    weights = np.full(count, 1.0 / count)
    return DirectionRule(str(count), axes, weights, 2 * count - 2, space=plane, asked=count)


def usual_rule(space: Space) -> DirectionRule:
    """The first rule of an auto scan."""
    return plane_rule(AUTO_STEPS, space) if space.is_plane else direction_rule(AUTO_RULE)


def rule_of(count: int, space: Space) -> DirectionRule:
    """The smallest rule that has at least so many axes."""
    return plane_rule(max(count, 2), space) if space.is_plane else direction_rule(count)


def _at_least(count: int) -> DirectionRule:
    """The smallest Lebedev rule with ``count`` axes, or a product rule beyond the largest."""
    if count < 1:
        raise SettingsError("directions: at least one axis is needed, found 0")
    for degree in LEBEDEV_DEGREES:
        rule = lebedev(degree)
        if len(rule) >= count:
            return rule
    # a product rule of odd degree t has ((t + 1) / 2)(t + 1) / 2 axes
    degree = 2 * math.ceil(math.sqrt(count)) - 1
    if degree > LARGEST_PRODUCT:
        raise SettingsError(
            f"directions: at most {(LARGEST_PRODUCT + 1) ** 2 // 4} axes, found {count}"
        )
    return product(degree)


def lebedev(degree: float) -> DirectionRule:
    """Lebedev's rule of this degree, or of the next degree with positive weights in SciPy."""
    from scipy.integrate import lebedev_rule

    found = next(d for d in LEBEDEV_DEGREES if d >= degree)
    points, weights = lebedev_rule(found)
    half = _upper_half(points.T)
    return _normalised(f"lebedev:{found}", points.T[half], weights[half], found)


def design_of(axes: float, space: Space = SPACE) -> DirectionRule:
    """A rule of equal weights and about so many axes: a spherical design, or equal steps."""
    if space.is_plane:
        return plane_rule(min(math.ceil(axes), MOST_STEPS), space)
    # a design of odd degree t has about ((t + 1) / 2)² axes
    return direction_rule(f"design:{min(2 * math.ceil(math.sqrt(axes)) - 1, FINEST)}")


def design(degree: float) -> DirectionRule:
    """The antipodal spherical design of this degree, or of the next degree in designs.csv."""
    table = np.loadtxt(str(files("scanfab.scan") / "designs.csv"), delimiter=",", comments="#")
    chosen = int(table[table[:, 0] >= degree, 0].min())
    axes = table[table[:, 0] == chosen, 1:]
    return _normalised(f"design:{chosen}", axes, np.ones(len(axes)), chosen)


def icosahedral(degree: float) -> DirectionRule:
    """The corners of an icosahedron and of its dual, which together are exact to degree 9."""
    golden = (1 + math.sqrt(5)) / 2
    kinds = [[0, 1, golden], [0, 1, -golden]], [[0, golden, 1 / golden], [0, golden, -1 / golden]]
    turned = np.stack([np.roll(kinds, k, axis=-1) for k in range(3)], axis=1).reshape(12, 3)
    axes = np.concatenate([turned, [[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    weights = np.repeat([5 / 168, 9 / 280], [6, 10])
    return _normalised("icosahedral:9", axes, weights, 9)


def product(degree: float) -> DirectionRule:
    """Gauss-Legendre in cos φ times even steps in θ, both exact to the degree."""
    degree = int(degree)
    heights, height_weights = np.polynomial.legendre.leggauss(degree // 2 + 1)
    azimuths = degree + 1 + (degree + 1) % 2
    theta = 2 * np.pi * (np.arange(azimuths) + 0.5) / azimuths
    z, azimuth = (grid.ravel() for grid in np.meshgrid(heights, theta, indexing="ij"))
    weights = np.repeat(height_weights, azimuths)
    flat = np.sqrt(1 - z**2)
    points = np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z])
    half = _upper_half(points)
    return _normalised(f"product:{degree}", points[half], weights[half], degree)


def fibonacci(count: float) -> DirectionRule:
    """A Fibonacci lattice of N axes on the half sphere, equal weights."""
    number = np.arange(int(count))
    z = (number + 0.5) / count
    theta = np.pi * (3 - np.sqrt(5)) * number
    flat = np.sqrt(1 - z**2)
    axes = np.column_stack([flat * np.cos(theta), flat * np.sin(theta), z])
    return _normalised(f"fibonacci:{int(count)}", axes, np.ones(len(axes)), None)


def angle_grid(name: str, end: float, step: float) -> DirectionRule:
    """Equal steps over θ in (-end, end], φ in (0°, 90°], unit weights; degrees."""
    if abs(90 / step - round(90 / step)) > 1e-9:
        raise SettingsError(f"directions: {name}: expected a step that divides 90 degrees")
    phi = np.radians(step * np.arange(1, round(90 / step) + 1))
    turns = round(end / step)
    theta = np.radians(step * np.arange(1 - turns, turns + 1))
    polar, azimuth = (grid.ravel() for grid in np.meshgrid(phi, theta, indexing="ij"))
    axes = np.column_stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    return _normalised(f"{name}:{step:g}", axes, np.ones(len(axes)), None, turned=False)


# For each rule: the function that makes it, what its argument is, and the argument's range. Eq. 1
# of the paper, as printed, has the ranges of `equal-angle`.
RULES: dict[str, tuple[Callable[[float], DirectionRule], str, float, float]] = {
    "lebedev": (lebedev, "DEGREE", 1, LEBEDEV_DEGREES[-1]),
    "design": (design, "DEGREE", 1, FINEST),
    "icosahedral": (icosahedral, "DEGREE", 1, 9),
    "product": (product, "DEGREE", 1, LARGEST_PRODUCT),
    "fibonacci": (fibonacci, "N", 1, 1_000_000),
    "equal-angle": (partial(angle_grid, "equal-angle", 90.0), "STEP", 0.5, 90),
    "equal-angle-full": (partial(angle_grid, "equal-angle-full", 180.0), "STEP", 0.5, 90),
}


def _upper_half(points: FloatArray) -> npt.NDArray[np.bool_]:
    """Which points of an antipodal set to keep, so that n and -n occur once."""
    x, y, z = np.where(np.abs(points) < 1e-12, 0.0, points).T
    half: npt.NDArray[np.bool_] = (z > 0) | ((z == 0) & (y > 0)) | ((z == 0) & (y == 0) & (x > 0))
    return half


def _normalised(
    name: str, axes: FloatArray, weights: FloatArray, degree: int | None, turned: bool = True
) -> DirectionRule:
    return DirectionRule(name, np.ascontiguousarray(axes), weights / weights.sum(), degree, turned)
