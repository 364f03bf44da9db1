"""What the blocks of a map tile: the sample or the RV, where it lies in a frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window
from scanfab.pipeline.maps.settings import BLOCK_OPTIONS, MapSettings
from scanfab.scan.blocks import Blocks
from scanfab.scan.lines import line_triads

# of a block's thickness, in mean radii: below the one it holds less than a grain, below the other
# hardly any that its neighbours do not hold a part of
REFUSED_BELOW, DOUBTED_BELOW = 1.0, 4.0
# cosine of the angle between the axis and the normal of the faces that slices are parallel to
MOST_OBLIQUE = 0.8


class MapBlocks(NamedTuple):
    """
    The blocks of a map; lengths in the dump's unit.

    Of the whole sample they tile a parallelepiped: along the vectors of a cell that repeat the
    cell, as it is in each frame, and else what the grains took in the first frame. Of the RV they
    tile its box, wherever the RV is.
    """

    settings: MapSettings
    axes: FloatArray
    """Unit vectors along which blocks lie where nothing repeats, as rows."""
    low: FloatArray
    """From the origin of the axes, where what is tiled begins along each, shape (3,)."""
    high: FloatArray
    """Likewise where it ends."""

    @classmethod
    def of(cls, settings: MapSettings, sample: Sample) -> MapBlocks:
        """
        What the blocks of a map tile, by the first frame that has grains.

        Raises
        ------
        SettingsError
            If the grains are discs in a plane.
        """
        packing = sample.packing
        if packing.space.is_plane:
            raise SettingsError(
                f"a map is of spheres in space, but all grains are discs in the plane "
                f"{packing.space.name}: `compute` has the fabric of RVs, wherever `rv_center` is"
            )
        open_axes = np.eye(3)
        if settings.slices is not None:
            # the loading axis is the last one
            open_axes = line_triads(np.array([settings.axis], dtype=np.float64))[0]
        axes, origin, *_ = _axes(packing.cell, open_axes)
        to_axes = np.linalg.inv(axes)
        places = (packing.position[sample.gathered] - origin) @ to_axes
        # how far a sphere reaches along each, measured between planes of the two others
        radius = packing.radius[sample.gathered, None]
        reach = radius * np.linalg.norm(to_axes, axis=0)
        return cls(settings, open_axes, (places - reach).min(axis=0), (places + reach).max(axis=0))

    def of_whole(self, cell: Cell | None) -> Blocks:
        """Of the whole sample in a frame, in the dump's coordinates."""
        axes, origin, repeats, period = _axes(cell, self.axes)
        low, high = np.where(repeats, 0.0, self.low), np.where(repeats, period, self.high)
        return self._parted(origin + low @ axes, (high - low)[:, None] * axes, repeats)

    def of_window(self, window: Window) -> Blocks:
        """Of the box of an RV, in the dump's coordinates."""
        axes, shape = self.axes, window.shape
        reach = np.array([shape.support(sign * axes) for sign in (-1.0, 1.0)])
        low, high = np.einsum("sij,ij->si", reach, axes)
        if self.settings.shells is not None:
            low, high = np.full(3, -shape.reach), np.full(3, shape.reach)
        edges = (high - low)[:, None] * axes
        return self._parted(window.center + low @ axes, edges, np.zeros(3, bool))

    def _parted(self, corner: FloatArray, edges: FloatArray, repeats: BoolArray) -> Blocks:
        """What is tiled in as many blocks as are asked for."""
        settings, one = self.settings, Blocks(corner, edges, (1, 1, 1), repeats)
        if settings.shells is not None:
            radius = 0.5 * float(one.heights.min())
            return replace(one, radius=radius, shells=settings.shells)
        if settings.grid is not None:
            return replace(one, parts=settings.grid)
        # between the faces that are most nearly normal to the axis
        cosines = np.abs(one.matrix @ np.asarray(settings.axis)) * one.heights
        across = int(np.argmax(cosines))
        if cosines[across] < MOST_OBLIQUE:
            angle = np.degrees(np.arccos(cosines[across]))
            raise SettingsError(
                f"slices: in a periodic cell they lie between its faces, the nearest of which is "
                f"{angle:.0f} degrees off the axis: choose another `axis`, or `grid`"
            )
        return replace(one, parts=tuple(settings.blocks if k == across else 1 for k in range(3)))

    def doubts(self, sample: Sample, window: Window | None, mean: float) -> Iterator[Note]:
        """
        Whether the blocks are large enough; ``mean`` is the mean radius.

        Raises
        ------
        SettingsError
            If they are smaller than a grain.
        """
        every = [self.of_whole(sample.packing.cell)] if {*"ab"} & {*self.settings.variants} else []
        every += [self.of_window(window)] if window is not None else []
        thinnest = float(min(one.heights.min() for one in every))
        name = next(one for one in BLOCK_OPTIONS if getattr(self.settings, one))
        found = f"blocks {thinnest:.4g} thick, {thinnest / mean:.3g} mean radii of the grains"
        least = f"{DOUBTED_BELOW:g} mean radii thick ({DOUBTED_BELOW * mean:.4g})"
        choose = f"choose fewer, so that they are at least {least}"
        if thinnest < REFUSED_BELOW * mean * (1.0 - 1e-9):
            less = "less than a grain says nothing of a fabric"
            raise SettingsError(f"{name}: makes {found}: {less}: {choose}")
        if thinnest < DOUBTED_BELOW * mean * (1.0 - 1e-9):
            unsure = "what a block holds is hardly its own, and errors from its parts are uncertain"
            yield Note("thin_blocks", f"`{name}` makes {found}: {unsure}: {choose}")


def _axes(
    cell: Cell | None, open_axes: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
    """Unit vectors along which the whole is tiled, where they begin, which repeat, and how soon."""
    if cell is None or not cell.is_periodic:
        return open_axes, np.zeros(3), np.zeros(3, bool), np.zeros(3)
    period = np.linalg.norm(cell.vectors, axis=1)
    return cell.vectors / period[:, None], cell.origin, np.array(cell.periodic), period
