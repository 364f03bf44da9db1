"""The grids of scan lines: a triad for each axis, turned and shifted at random in a replicate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.scan.directions import DirectionRule


def line_triads(axes: FloatArray, space: Space = SPACE) -> FloatArray:
    """
    Orthonormal triads (rows u, v, n) whose third row is each axis, shape (D, 3, 3).

    Axes in a plane have its normal as v, so that their lines lie side by side along u.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.lines import line_triads
    >>> line_triads(np.array([[0.0, 0.0, 1.0]]))[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    if space.is_plane:
        v = np.broadcast_to(space.normal, axes.shape)
        return np.stack([np.cross(v, axes), v, axes], axis=1)
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    u = helper - np.sum(helper * axes, axis=1, keepdims=True) * axes
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(axes, u), axes], axis=1)


def drawn_lines(
    rule: DirectionRule, seed: int, replicates: Iterable[int]
) -> tuple[FloatArray, FloatArray]:
    """
    Draw the line triads of all replicates, shape (R, D, 3, 3), and the shifts of their grids.

    The shifts have the shape (R, D, 2), or (R, D, 1) in a plane.
    """
    triads = line_triads(rule.axes, rule.space)
    drawn = [turned_triads(rule, triads, seed, replicate) for replicate in replicates]
    if not drawn:
        raise SettingsError("replicates: expected at least one")
    turned, offsets = zip(*drawn, strict=True)
    return np.array(turned), np.array(offsets)


def turned_triads(
    rule: DirectionRule, triads: FloatArray, seed: int, replicate: int
) -> tuple[FloatArray, FloatArray]:
    """
    Draw the lines of one replicate.

    Returns the rule's line triads, turned at random, shape (D, 3, 3), and the shifts of the grids
    in units of the spacing, shape (D, 2), or (D, 1) in a plane.
    """
    random = np.random.default_rng([seed, replicate])
    rotation = _random_turn(random, rule.space)
    offsets = random.random((len(rule), rule.space.dimension - 1))
    return (triads @ rotation.T if rule.turned else triads), offsets


def _random_turn(random: np.random.Generator, space: Space) -> FloatArray:
    """A random rotation matrix; in a plane, a rotation about its normal."""
    if not space.is_plane:
        return _random_rotation(random)
    angle = 2.0 * np.pi * random.random()
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rotation = np.eye(3)
    rotation[np.ix_(space.along, space.along)] = turn
    return rotation


def _random_rotation(random: np.random.Generator) -> FloatArray:
    """A uniformly distributed rotation matrix, from a random unit quaternion."""
    # SciPy has this too, but importing it takes as long as a small table
    quaternion = random.normal(size=4)
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
