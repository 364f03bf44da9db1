"""The grids of scan lines: a triad for each axis, turned and shifted at random in a replicate."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.scan.directions import DirectionRule

__all__ = ["drawn_lines", "line_triads", "turned_triads"]


def line_triads(axes: FloatArray) -> FloatArray:
    """
    Orthonormal triads (rows u, v, n) whose third row is each axis, shape (D, 3, 3).

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.lines import line_triads
    >>> line_triads(np.array([[0.0, 0.0, 1.0]]))[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    u = helper - np.sum(helper * axes, axis=1, keepdims=True) * axes
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(axes, u), axes], axis=1)


def drawn_lines(
    rule: DirectionRule, seed: int, replicates: Iterable[int]
) -> tuple[FloatArray, FloatArray]:
    """Line triads of all replicates, shape (R, D, 3, 3), and shifts of their grids, (R, D, 2)."""
    triads = line_triads(rule.axes)
    drawn = [turned_triads(rule, triads, seed, replicate) for replicate in replicates]
    if not drawn:
        raise SettingsError("replicates: expected at least one")
    turned, offsets = zip(*drawn, strict=True)
    return np.array(turned), np.array(offsets)


def turned_triads(
    rule: DirectionRule, triads: FloatArray, seed: int, replicate: int
) -> tuple[FloatArray, FloatArray]:
    """
    The lines of one replicate.

    Returns the rule's line triads (shape (D, 3, 3)), turned, and the shifts of the grids in units
    of the spacing (shape (D, 2)).
    """
    random = np.random.default_rng([seed, replicate])
    rotation = _random_rotation(random)
    offsets = random.random((len(rule), 2))
    return (triads @ rotation.T if rule.turned else triads), offsets


def _random_rotation(random: np.random.Generator) -> FloatArray:
    """A rotation matrix out of all, each as likely: from a random unit quaternion."""
    # SciPy has this too, but takes as long to import as a small triad to compute
    quaternion = random.normal(size=4)
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
