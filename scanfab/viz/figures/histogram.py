"""The figure histogram: how long the void segments are."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points
from scanfab.viz.figures.figure import OnePanel
from scanfab.viz.figures.style import COLUMN, FRAME_LOOKS

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

LINES = 6_000


class LengthSample(NamedTuple):
    """One frame: void segments, in units of the smallest radius."""

    title: str
    length: FloatArray
    cutoff: float


class Histogram(OnePanel):
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
    size = (COLUMN, 3.2)
    drawn, more = "Lengths of the void segments", "; those below the cut-off are dropped"

    @cached_property
    def samples(self) -> list[LengthSample]:
        """What is drawn of each frame."""
        return [_lengths_of(one) for one in self.chosen(self.data.frames)]

    def paint(self, ax: Axes) -> None:
        """Density of the lengths; those below the cut-off are on grey."""
        longest = max(float(np.quantile(sample.length, 0.999)) for sample in self.samples)
        edges = np.linspace(0, longest, 41)
        for sample, look in zip(self.samples, FRAME_LOOKS, strict=False):
            density, _ = np.histogram(sample.length, edges, density=True)
            dropped = 100 * np.mean(sample.length < sample.cutoff)
            style: dict[str, Any] = {"color": look["color"], "ls": look["ls"], "lw": 1.1}
            label = f"{sample.title}:\n{dropped:.0f} % dropped"
            ax.stairs(density, edges, baseline=None, label=label, **style)
        cutoff = self.samples[-1].cutoff
        ax.axvspan(0, cutoff, color="0.92", zorder=0)
        ax.axvline(cutoff, color="k", lw=0.9, ls=":", label="cut-off")
        ax.set(yscale="log", xlim=(0, longest), ylabel="probability density")
        ax.set(xlabel=r"void segment length / $r_{min}$")


def _lengths_of(frame: ScannedFrame) -> LengthSample:
    """Segments of some tens of thousands on lines in even directions."""
    # compiled kernels, which those who draw something else do without
    from scanfab.scan.lines import line_triads
    from scanfab.scan.segments import sample_segments

    points, _ = direction_points(frame.space)
    some = points[: len(points) // 2 : 5 if frame.space.is_plane else 20]
    triads = line_triads(some, frame.space)
    position, radius, window = frame.spheres
    found = sample_segments(position, radius, triads, LINES, window, frame.space)
    length, cutoff = found.length[found.void], frame.measurement.plan.cutoff
    return LengthSample(frame.title, length / frame.smallest, cutoff / frame.smallest)
