"""
The grids of scan lines, and a few lines cut into their solid and void segments.

Each axis has a triad; in a replicate it is turned, and its grid is shifted, at random. Segments are
exact: the chords of a line are sorted.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scanfab.base.arrays import concatenated
from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray, IntArray
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
    """A uniformly distributed rotation matrix; in a plane, a rotation about its normal."""
    # SciPy has this too, but importing it takes as long as a small table
    if space.is_plane:
        half = np.pi * random.random()
        quaternion = np.append(np.sin(half) * space.normal, np.cos(half))
    else:
        quaternion = random.normal(size=4)
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + 2.0 * (w * cross + cross @ cross))


@dataclass(frozen=True, eq=False)
class Segments:
    """Pieces of scan lines; lengths in the dump's unit, positions with the spheres' origin."""

    ends: FloatArray
    """Both end points, shape (K, 2, 3)."""
    void: BoolArray
    """Whether a piece lies outside all solids, shape (K,)."""
    line: IntArray
    """Number of the line that a piece belongs to, shape (K,)."""

    @property
    def length(self) -> FloatArray:
        """Length of each piece, shape (K,)."""
        return np.asarray(np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1))


def cut_lines(
    position: FloatArray,
    radius: FloatArray,
    triad: FloatArray,
    points: FloatArray,
    window: Convex | None = None,
    first: int = 0,
) -> Segments:
    """
    Cut parallel lines into solid and void segments.

    This is for figures of hundreds of lines; a scan cuts millions of lines by kernels.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Centres of the solids; the window, if there is one, lies about the origin.
    radius : ndarray, shape (N,)
        Radii of the solids, dump's length unit.
    triad : ndarray, shape (3, 3)
        Orthonormal rows u, v, n; the lines run along n.
    points : ndarray, shape (L, 2)
        Coordinates u and v of the points where the lines pass the plane through the origin.
    window : Convex, optional
        Window that clips the lines: its surface bounds the first and the last segment. Without a
        window, a line runs from its first to its last solid.
    first : int, optional
        Number of the first line.

    Returns
    -------
    Segments
        Pieces in the order of the lines, and along each line.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import sphere
    >>> from scanfab.scan.lines import cut_lines
    >>> cut_lines(np.zeros((1, 3)), np.ones(1), np.eye(3), np.zeros((1, 2)), sphere(3.0)).length
    array([2., 2., 2.])
    """
    across, depth = position @ triad[:2].T, position @ triad[2]
    pieces, void, line = [np.zeros((0, 2, 3))], [np.zeros(0, bool)], [np.arange(0)]
    if window is not None:
        # along pieces of the lines from before the window to behind it
        way = np.broadcast_to(2.0 * window.reach * triad[2], (len(points), 3))
        ends = np.column_stack(window.cut(points @ triad[:2] - 0.5 * way, way))
        clips = window.reach * (2.0 * ends - 1.0)
    for number, point in enumerate(points):
        square = radius**2 - np.sum((across - point) ** 2, axis=1)
        hit = square > 0
        half = np.sqrt(square[hit])
        clip = None if window is None else clips[number]
        bounds, is_void = _cut(depth[hit] - half, depth[hit] + half, clip)
        places = np.empty((*bounds.shape, 3))
        places[..., :2], places[..., 2] = point, bounds
        pieces.append(places @ triad)
        void.append(is_void)
        line.append(np.full(len(bounds), first + number))
    return Segments(np.concatenate(pieces), np.concatenate(void), np.concatenate(line))


def _cut(
    start: FloatArray, stop: FloatArray, clip: FloatArray | None
) -> tuple[FloatArray, BoolArray]:
    """
    Solid and void pieces of one line, (K, 2) bounds and (K,) flags, from its chords.

    ``clip`` holds where the line enters and leaves a window; it leaves first if it misses it.
    """
    if clip is not None:
        # everything outside the window counts as solid
        start = np.concatenate([[-np.inf, clip[1]], start])
        stop = np.concatenate([[clip[0], np.inf], stop])
    if len(start) == 0 or (clip is not None and clip[0] >= clip[1]):
        return np.zeros((0, 2)), np.zeros(0, bool)
    order = np.argsort(start)
    start, stop = start[order], np.maximum.accumulate(stop[order])
    gap = np.flatnonzero(start[1:] > stop[:-1])
    # solid runs alternate with gaps
    bounds = np.concatenate([start[:1], np.column_stack([stop[gap], start[gap + 1]]).ravel()])
    bounds = np.concatenate([bounds, stop[-1:]])
    if clip is not None:
        bounds = np.clip(bounds, *clip)
    pieces = np.column_stack([bounds[:-1], bounds[1:]])
    is_void = np.arange(len(pieces)) % 2 == 1
    some = pieces[:, 1] > pieces[:, 0]
    return pieces[some], is_void[some]


def grid_points(reach: float, lines: int, space: Space = SPACE) -> FloatArray:
    """
    A square grid of about so many points in a circle of this radius, shape (L, 2).

    In a plane the points lie on a line.
    """
    if space.is_plane:
        steps = reach * (2.0 * (np.arange(lines) + 0.5) / lines - 1.0)
        return np.column_stack([steps, np.zeros(lines)])
    spacing = reach * np.sqrt(np.pi / lines)
    steps = np.arange(-np.floor(reach / spacing), np.floor(reach / spacing) + 1) * spacing
    points = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(points[np.linalg.norm(points, axis=1) < reach])


def sample_segments(
    position: FloatArray,
    radius: FloatArray,
    triads: FloatArray,
    lines: int,
    window: Convex | None = None,
    space: Space = SPACE,
) -> Segments:
    """
    Cut about so many lines, in a grid for each of several line triads (D, 3, 3).

    The parameters are those of :func:`cut_lines`. In a plane its normal is each triad's second row.
    """
    reach = 0.0 if window is None else window.reach
    if window is None and len(position):
        reach = float((np.linalg.norm(position, axis=1) + radius).max())
    points = grid_points(reach, max(lines // len(triads), 1), space) if reach else np.zeros((0, 2))
    parts = [
        cut_lines(position, radius, triad, points, window, k * len(points))
        for k, triad in enumerate(triads)
    ]
    whole: Segments = concatenated(parts)
    return whole
