"""The figure histogram: how long the void segments are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.viz.figures.figure import FrameFigure
from scanfab.viz.figures.style import COLUMN, FRAME_LOOKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
    from matplotlib.figure import SubFigure

    from scanfab.viz.scanned_frames import ScannedFrame


LINES = 6_000


@dataclass(frozen=True, eq=False)
class LengthSample:
    """One frame: void segments, in units of the smallest radius."""

    title: str
    length: FloatArray
    cutoff: float


class Histogram(FrameFigure):
    """
    Lengths of the void segments, with the cut-off; an outline for each frame.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of a frame, to draw that one alone.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """

    order = 6

    @cached_property
    def samples(self) -> list[LengthSample]:
        """What is drawn of each frame."""
        return [_lengths_of(one) for one in self.chosen(self.data.frames)]

    @property
    def size(self) -> tuple[float, float]:
        """Of one panel, with the legend above it."""
        return COLUMN, 3.2

    @property
    def caption(self) -> str:
        """With the variant and the source."""
        return (
            f"Lengths of the void segments, {self.data.name}; those below the cut-off are dropped."
        )

    def draw(self, ax: Axes) -> None:
        """With the legend in the panel."""
        _outlines(ax, self.samples)
        ax.legend()

    def panels(self, part: Page | SubFigure) -> list[Axes]:
        """With the legend above the panel."""
        axes = part.subplots()
        _outlines(axes, self.samples)
        part.legend(loc="outside upper left", ncols=1)
        return [axes]


def _outlines(axes: Axes, samples: Sequence[LengthSample]) -> None:
    """Density of the lengths; what is dropped is grey."""
    longest = max(float(np.quantile(sample.length, 0.999)) for sample in samples)
    edges = np.linspace(0, longest, 41)
    for sample, look in zip(samples, FRAME_LOOKS, strict=False):
        density, _ = np.histogram(sample.length, edges, density=True)
        dropped = np.mean(sample.length < sample.cutoff)
        axes.stairs(
            density,
            edges,
            color=look["color"],
            ls=look["ls"],
            lw=1.1,
            baseline=None,
            label=f"{sample.title}:\n{100 * dropped:.0f} % dropped",
        )
    cutoff = samples[-1].cutoff
    axes.axvspan(0, cutoff, color="0.92", zorder=0)
    axes.axvline(cutoff, color="k", lw=0.9, ls=":", label="cut-off")
    axes.set(yscale="log", xlim=(0, longest), ylabel="probability density")
    axes.set(xlabel=r"void segment length / $r_{min}$")


def _lengths_of(frame: ScannedFrame) -> LengthSample:
    """Segments of some tens of thousands on lines in even directions."""
    # compiled kernels, which those who draw something else do without
    from scanfab.scan.lines import line_triads
    from scanfab.scan.segments import sample_segments

    position, radius, window = frame.spheres
    points, _ = direction_points(frame.space)
    some = points[: len(points) // 2 : 5 if frame.space.is_plane else 20]
    triads = line_triads(some, frame.space)
    found = sample_segments(position, radius, triads, LINES, window, frame.space)
    length, cutoff = found.length[found.void], frame.measurement.plan.cutoff
    return LengthSample(frame.title, length / frame.smallest, cutoff / frame.smallest)
