"""What the blocks of a map tile: the sample or the RV, where it lies in a frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads

# of a block's thickness, in mean radii: below the one it holds less than a grain, below the other
# hardly any that its neighbours do not hold a part of
REFUSED_BELOW, DOUBTED_BELOW = 1.0, 4.0
# cosine of the angle between the axis and the normal of the faces that slices are parallel to
MOST_OBLIQUE = 0.8


@dataclass(frozen=True, eq=False)
class MapBlocks:
    """
    The blocks of a map; lengths in the dump's unit.

    Of the whole sample they tile a parallelepiped: along the vectors of a cell that repeat the
    cell, as it is in each frame, and else what the grains took in the first frame. Of the RV they
    tile its box, wherever the RV is.
    """

    settings: MapSettings
    low: FloatArray
    """From the origin of the axes, where what is tiled begins along each, shape (3,)."""
    high: FloatArray
    """Likewise where it ends."""
    axes: FloatArray
    """Unit vectors, as rows, of an open sample."""

    def of_whole(self, cell: Cell | None) -> Blocks:
        """Of the whole sample in a frame, in the dump's coordinates."""
        axes, origin, repeats = _axes(cell, self.axes)
        length = np.where(repeats, np.linalg.norm(_vectors(cell), axis=1), self.high - self.low)
        corner = origin + np.where(repeats, 0.0, self.low) @ axes
        return self._parted(Blocks.of_edges(length[:, None] * axes, corner, (1, 1, 1), repeats))

    def of_window(self, window: Window) -> Blocks:
        """Of the box of an RV, in the dump's coordinates."""
        axes = _open_axes(self.settings)
        shape = window.shape
        reach = np.array([shape.support(sign * axes) for sign in (-1.0, 1.0)])
        low, high = np.einsum("sij,ij->si", reach, axes)
        if self.settings.shells is not None:
            low, high = np.full(3, -shape.reach), np.full(3, shape.reach)
        corner = window.center + low @ axes
        return self._parted(Blocks.of_edges((high - low)[:, None] * axes, corner, (1, 1, 1)))

    def _parted(self, one: Blocks) -> Blocks:
        """What is tiled in as many blocks as are asked for."""
        settings = self.settings
        if settings.shells is not None:
            return one.with_shells(settings.shells, 0.5 * float(one.heights.min()))
        parts = settings.grid or _parts_along(one, settings)
        corner, edges = one.corner_edges
        return Blocks.of_edges(edges, corner, parts, one.repeats)

    def doubts(self, sample: Sample, window: Window | None, mean: float) -> Iterator[Note]:
        """
        Whether the blocks are large enough; ``mean`` is the mean radius.

        Raises
        ------
        SettingsError
            If they are smaller than a grain.
        """
        every = [self.of_whole(sample.packing.cell)] * bool({*"ab"} & {*self.settings.variants})
        every += [self.of_window(window)] if window is not None else []
        thinnest = float(min(one.heights.min() for one in every))
        name = next(one for one in ("grid", "slices", "shells") if getattr(self.settings, one))
        found = f"blocks {thinnest:.4g} thick, {thinnest / mean:.3g} mean radii of the grains"
        if thinnest < REFUSED_BELOW * mean * (1.0 - 1e-9):
            raise SettingsError(
                f"{name}: makes {found}: less than a grain says nothing of a fabric: choose fewer, "
                f"so that they are at least {DOUBTED_BELOW:g} mean radii thick "
                f"({DOUBTED_BELOW * mean:.4g})"
            )
        if thinnest < DOUBTED_BELOW * mean * (1.0 - 1e-9):
            text = (
                f"`{name}` makes {found}: what a block holds is hardly its own, and errors from "
                f"its parts are uncertain: choose fewer, at least {DOUBTED_BELOW:g} mean radii "
                f"thick ({DOUBTED_BELOW * mean:.4g})"
            )
            yield Note("thin_blocks", text)


def map_blocks(settings: MapSettings, sample: Sample) -> MapBlocks:
    """
    What the blocks of a map tile, by the first frame that has grains.

    Raises
    ------
    SettingsError
        If the grains are discs in a plane.
    """
    packing, cell = sample.packing, sample.packing.cell
    if packing.space.is_plane:
        raise SettingsError(
            f"a map is of spheres in space, but all grains are discs in the plane "
            f"{packing.space.name}: `compute` has the fabric of RVs, wherever `rv_center` is"
        )
    position, radius = packing.position[sample.gathered], packing.radius[sample.gathered]
    open_axes = _open_axes(settings)
    axes, origin, _ = _axes(cell, open_axes)
    to_axes = np.linalg.inv(axes)
    places = (position - origin) @ to_axes
    # how far a sphere reaches along each, measured between planes of the two others
    reach = radius[:, None] * np.linalg.norm(to_axes, axis=0)
    return MapBlocks(
        settings, (places - reach).min(axis=0), (places + reach).max(axis=0), open_axes
    )


def splits_of(blocks: Blocks) -> tuple[int, int, int]:
    """In how many parts along each axis a block is split in eight, its longest edge first."""
    if blocks.edges is not None:
        return 2, 2, 2
    _, edges = blocks.corner_edges
    length = np.linalg.norm(edges, axis=1) / np.array(blocks.parts)
    splits = np.ones(3, np.int64)
    for _ in range(3):
        # of edges that are equal but for rounding the first
        left = length / splits
        splits[np.argmax(left > 0.999 * left.max())] *= 2
    first, second, third = splits.tolist()
    return first, second, third


def _open_axes(settings: MapSettings) -> FloatArray:
    """Along which blocks lie where nothing repeats; slices have the loading axis as the last."""
    if settings.slices is None:
        return np.eye(3)
    triad: FloatArray = line_triads(np.array([settings.axis], dtype=np.float64))[0]
    return triad


def _vectors(cell: Cell | None) -> FloatArray:
    vectors: FloatArray = np.eye(3) if cell is None else cell.vectors
    return vectors


def _axes(cell: Cell | None, open_axes: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Unit vectors along which the whole is tiled, where they begin, and which repeat."""
    if cell is None or not cell.is_periodic:
        return open_axes, np.zeros(3), np.zeros(3, bool)
    axes = cell.vectors / np.linalg.norm(cell.vectors, axis=1, keepdims=True)
    return axes, cell.origin, np.array(cell.periodic)


def _parts_along(one: Blocks, settings: MapSettings) -> tuple[int, int, int]:
    """
    Slices between the faces that are most nearly normal to the loading axis.

    Raises
    ------
    SettingsError
        If none are.
    """
    normals = one.matrix / np.linalg.norm(one.matrix, axis=1, keepdims=True)
    cosines = np.abs(normals @ np.asarray(settings.axis))
    across = int(np.argmax(cosines))
    if cosines[across] < MOST_OBLIQUE:
        angle = np.degrees(np.arccos(cosines[across]))
        raise SettingsError(
            f"slices: in a periodic cell they lie between its faces, the nearest of which is "
            f"{angle:.0f} degrees off the axis: choose another `axis`, or `grid`"
        )
    parts = [1, 1, 1]
    parts[across] = settings.slices or 1
    return parts[0], parts[1], parts[2]
