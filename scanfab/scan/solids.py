"""What lines meet: the spheres, the window that cuts the lines, and how many lines that makes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import PackingError, SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import CLIP
from scanfab.scan.kernels.cells import Cells
from scanfab.scan.kernels.grid import Bounds, CellGrains
from scanfab.scan.kernels.strips import FAR

Int32Array = npt.NDArray[np.int32]

# most lines of one axis and replicate: more would take minutes, even if they meet nothing
MAX_LINES = 50_000_000
# a gap below this fraction of the smallest radius is rounding between surfaces that coincide
SHORTEST = 1e-9
# Margin in mean radii. With a wider margin more chords are swept, and fewer segments are followed.
MARGIN = 5.0

# a ray that meets nothing along so many periods and mean free paths stays in a channel
MOST_PERIODS, MOST_FREE_PATHS = 64.0, 20.0
# most cells per grain, in the grid that grains are sorted into
MOST_CELLS = 4.0


class Inner(NamedTuple):
    """A window for the whole of an open sample."""

    shape: Convex
    center: FloatArray
    """Its centre in the coordinates of the solids, shape (3,)."""


@dataclass(frozen=True, eq=False)
class Solids:
    """
    The spheres and the window that lines meet; lengths in the dump's unit.

    The origin of positions is the origin of the window, such as the centre of a sphere.

    Parameters
    ----------
    position : array_like, shape (N, 3)
        Centres, from the window's origin.
    radius : array_like, shape (N,)
        Radii.
    removed : array_like of bool, shape (N,)
        Spheres that the variants b and d leave out.
    window : Convex, optional
        The window that clips the lines of c and d; None if these are not scanned.
    medium : CellGrains, optional
        The grains of a periodic packing, each once, if its whole is scanned, which has no edge.
    origin : array_like, optional
        The origin of the positions in the dump's coordinates, shape (3,).
    edge : {"clip", "start", "ends"}, optional
        The edge rule: what counts at the window's surface, see :mod:`scanfab.scan.edges`.
    around : CellGrains, optional
        For the rule ``start``: all grains, each once, and the vectors along which they repeat.
        ``position`` then holds all spheres within the margin of the window.
    inner : Inner, optional
        For the rule ``ends``: the window of an open whole, in which all grains are known.
    space : Space, optional
        For discs: their plane. All positions are then 0 across it, and the cell's third vector is
        normal to it.

    Raises
    ------
    PackingError
        If the shapes do not fit.

    Examples
    --------
    >>> from scanfab import Solids, sphere
    >>> Solids([[0, 0, 0], [2, 0, 0]], [1, 1], [False, True], window=sphere(3.0))
    Solids: 2 spheres, 1 of them void in b and d, window of radius 3
    """

    position: FloatArray
    radius: FloatArray
    removed: BoolArray
    window: Convex | None = None
    medium: CellGrains | None = None
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    edge: str = CLIP
    around: CellGrains | None = None
    inner: Inner | None = None
    space: Space = SPACE
    _near: dict[tuple[Any, ...], BoolArray] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Cast without a copy; PackingError if the shapes do not fit."""
        count = np.size(self.radius)
        kinds: dict[str, tuple[type, tuple[int, ...]]] = {
            "position": (np.float64, (count, 3)),
            "radius": (np.float64, (count,)),
            "removed": (np.bool_, (count,)),
            "origin": (np.float64, (3,)),
        }
        for name, (kind, shape) in kinds.items():
            array: npt.NDArray[Any] = np.asarray(getattr(self, name), kind)
            if array.shape != shape:
                raise PackingError(f"solids: {name}: expected shape {shape}, found {array.shape}")
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        removed = int(np.sum(self.removed))
        what = [counted(len(self.radius), "disc" if self.space.is_plane else "sphere")]
        what += [f"{removed} of them void in b and d"] if removed else []
        if self.medium is not None:
            what.append(f"a periodic whole of {counted(len(self.medium.radius), 'grain')}")
        what.append("no window" if self.window is None else f"window of {self.window}")
        return f"Solids: {', '.join(what)}"

    @cached_property
    def bounds(self) -> Bounds:
        """A box, and a ball about the origin, that hold all spheres."""
        position, radius = self.position, self.radius
        if not len(radius):
            return Bounds(np.zeros(3), np.zeros(3), 0.0)
        low = (position - radius[:, None]).min(axis=0)
        high = (position + radius[:, None]).max(axis=0)
        reach = float((np.sqrt(np.einsum("ij,ij->i", position, position)) + radius).max())
        return Bounds(0.5 * (low + high), 0.5 * (high - low), reach)

    @cached_property
    def cells(self) -> Cells:
        """The grains around the window, sorted into cells."""
        assert self.around is not None
        return cells_of(self.around, 1.0)

    @cached_property
    def medium_cells(self) -> Cells:
        """The grains of the periodic whole, sorted into wide cells, as few lines are followed."""
        assert self.medium is not None
        return cells_of(self.medium, 3.0)

    def near(self, window: Convex, center: FloatArray | float, margin: float) -> BoolArray:
        """
        Which spheres may lie within a margin of a window.

        Parameters
        ----------
        window : Convex
            The window.
        center : ndarray or float
            Its centre, from the origin of the positions.
        margin : float
            How far beyond the window a sphere may lie, dump's length unit.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        # kept for the other jobs of a scan
        key = window, margin, *np.ravel(center)
        if key not in self._near:
            self._near[key] = window.may_meet(self.position - center, self.radius + margin)
        return self._near[key]

    @property
    def reach(self) -> float:
        """Radius of the ball about the origin that holds the window; 0 without one."""
        return 0.0 if self.window is None else self.window.reach

    @property
    def grain_radius(self) -> FloatArray:
        """
        Radii of the grains that lines may meet, each once if the whole is periodic.

        In a periodic packing without a window, ``radius`` holds hardly any.
        """
        return self.radius if self.medium is None else self.medium.radius

    def chords(self, spacing: float) -> float:
        """
        Expected number of chords that the spheres cut from the lines of one axis.

        Parameters
        ----------
        spacing : float
            Distance between neighbouring lines, dump's length unit.

        Returns
        -------
        float
        """
        of_medium = 0.0 if self.medium is None else self.space.shadow(self.medium.radius)
        return self.space.lines(self.space.shadow(self.radius) + of_medium, spacing)


def margin_of(grains: CellGrains) -> float:
    """How far beyond a window grains are listed, dump's length unit."""
    return MARGIN * float(grains.radius.mean()) if len(grains.radius) else 0.0


def shortest_gap(solids: Solids) -> float:
    """Length below which a gap is rounding, dump's length unit."""
    radius = solids.grain_radius
    return SHORTEST * float(radius.min()) if len(radius) else 0.0


def most_lines(solids: Solids, spacing: float) -> float:
    """Upper bound for the lines of one axis and replicate, with those that meet nothing."""
    reach = solids.reach
    if solids.medium is not None:
        # along an axis that is not periodic, the extent of the grains
        edges = np.linalg.norm(solids.medium.vectors[solids.medium.periodic], axis=1)
        across = solids.medium.position - solids.medium.position.mean(axis=0)
        extent = float((np.linalg.norm(across, axis=1) + solids.medium.radius).max(initial=0.0))
        reach = max(reach, float(edges.max(initial=0.0)), extent if len(edges) < 3 else 0.0)
    return (2.0 * max(reach, solids.bounds.reach) / spacing + 1.0) ** (solids.space.dimension - 1)


def check_lines(solids: Solids, rule: DirectionRule, spacing: float) -> None:
    """Raise SettingsError if lines lie in another plane, or are too many for a reasonable time."""
    if rule.space != solids.space:
        raise SettingsError(
            f"directions: the solids lie in {solids.space}, the axes of {rule.name} in {rule.space}"
        )
    if not spacing > 0.0:
        raise SettingsError(f"spacing: expected a length above 0, found {spacing:g}")
    lines = most_lines(solids, spacing)
    if lines > MAX_LINES:
        raise SettingsError(
            f"spacing: {spacing:g} between lines of one direction and replicate makes "
            f"{lines:.2g} of them, more than {MAX_LINES:.0e}: choose a wider spacing, or leave out "
            f"grains that are far away from all others"
        )


def cells_of(grains: CellGrains, width: float) -> Cells:
    """
    Sort grains into the cells of a grid, for rays that look for the next grain.

    ``width`` is the approximate width of a cell in mean diameters; wide cells take less memory.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan.solids import CellGrains, cells_of
    >>> position, one = np.array([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5]]), np.full(2, 0.5)
    >>> cells_of(CellGrains(position, one, one < 0, np.eye(3), np.zeros(3, bool)), 1.0).parts
    array([3, 1, 1])
    """
    vectors: FloatArray = grains.vectors.astype(np.float64)
    corner = np.zeros(3)
    once = np.linalg.inv(vectors)
    along = grains.position @ once
    reach = grains.radius[:, None] * np.linalg.norm(once, axis=0)
    fixed = ~grains.periodic
    for k in np.flatnonzero(fixed):
        # the grid begins and ends with the surfaces of the grains
        low, high = (along - reach)[:, k].min(), (along + reach)[:, k].max()
        corner = corner + low * vectors[k]
        vectors[k] *= high - low
    inverse = np.linalg.inv(vectors).astype(np.float64)
    per_length = np.linalg.norm(inverse, axis=0)
    volume = abs(float(np.linalg.det(vectors)))
    most = volume / (MOST_CELLS * len(grains.radius))
    wide = max(2.0 * width * float(grains.radius.mean()), most ** (1 / 3))
    parts = np.maximum(np.rint(1.0 / (per_length * wide)), 1.0).astype(np.int64)
    middle = (grains.position - corner) @ inverse * parts
    reach = grains.radius[:, None] * per_length * parts
    low, high = (np.floor(edge).astype(np.int32) for edge in (middle - reach, middle + reach))
    # the last face of the box belongs to the last cell
    low, high = (
        np.where(grains.periodic, x, np.clip(x, 0, parts - 1)).astype(np.int32) for x in (low, high)
    )
    start, grain, image = _by_cell(low, high, parts)
    sphere = np.column_stack([grains.position[grain] - image @ vectors, grains.radius[grain]])
    farthest = [_farthest(grains, volume, solid) for solid in (slice(None), ~grains.removed)]
    return Cells(
        sphere, grains.removed[grain], vectors, inverse, corner, grains.periodic, parts, start,
        *farthest,
    )  # fmt: skip


def _by_cell(
    low: Int32Array, high: Int32Array, parts: IntArray
) -> tuple[IntArray, Int32Array, Int32Array]:
    """
    List each grain in all cells from its first to its last, shapes (N, 3), also beyond the periods.

    Returns the first entry of each cell, with the number of entries behind them; and of each entry
    its grain, and how many periods its cell lies beyond the grid, shape (K, 3).
    """
    width = high - low + 1
    cells = np.prod(width, axis=1, dtype=np.int32)
    grain = np.repeat(np.arange(len(cells), dtype=np.int32), cells)
    # the number of an entry among those of its grain, as steps along the three edges
    step = np.arange(len(grain), dtype=np.int32) - np.repeat(np.cumsum(cells) - cells, cells)
    over, along = np.divmod(step, width[grain, 0])
    beside = np.stack([along, *np.divmod(over, width[grain, 1])[::-1]], axis=1)
    image, cell = np.divmod(beside + low[grain], parts.astype(np.int32))
    number = cell @ np.cumprod([1, *parts[:2]])
    start = np.cumsum(np.bincount(number + 1, minlength=np.prod(parts) + 1))
    order = np.argsort(number)
    return start, grain[order], image[order]


def _farthest(grains: CellGrains, volume: float, solid: BoolArray | slice) -> float:
    """How far to follow a ray that meets nothing: FAR leaves an open sample."""
    radius = grains.radius[solid]
    if not len(radius):
        return 0.0
    if not grains.periodic.any():
        return FAR
    periods = float(np.linalg.norm(grains.vectors[grains.periodic], axis=1).sum())
    free_path = volume / (np.pi * float(np.sum(radius**2)))
    return MOST_PERIODS * periods + MOST_FREE_PATHS * free_path
