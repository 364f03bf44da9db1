"""The first and the last frame of a series, scanned to be drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.space import Space
from scanfab.base.typing import FloatArray
from scanfab.io.series import Series
from scanfab.packing.packing import Packing
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.frames import Frames
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.settings import Settings
from scanfab.table.curves import spelt_strain, strain_column
from scanfab.table.plots import Plots
from scanfab.table.row import Row, Rows, numbers_of, variant_of


def scan_frames(
    source: Packing | Series, *, table: Iterable[Mapping[str, Any]] | None = None, **options: Any
) -> ScannedFrames:
    """
    Scan the first and the last frame of a series, for figures of single frames.

    Its ``.plot`` draws ``rose``, ``projection``, ``histogram`` and ``cutoffs``, on Axes or, with
    all panels, on a matplotlib Figure. Frames are scanned once, when the first figure needs them.

    Parameters
    ----------
    source : Packing or Series
        One frame, or what :func:`scanfab.read_series` returns.
    table : Table or iterable of mapping, optional
        Their fabric table. Its first and last frame with a void fabric are drawn, and titles have
        its strains. Without it, the first and the last of the chosen ``frames`` are drawn.
    **options
        The options of :func:`scanfab.compute` for the table. The figures show variant c if it is
        among the ``variants``, else the first variant.

    Returns
    -------
    ScannedFrames
        Its ``.plot`` draws the figures.

    Raises
    ------
    ScanfabError
        If the settings do not fit, or there is nothing to draw.
    TypeError
        If there is no such option; the message suggests the nearest name.

    Examples
    --------
    >>> import numpy as np
    >>> from matplotlib.figure import Figure
    >>> import scanfab
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> packing = scanfab.find_contacts(scanfab.Packing(grid, 0.5), tolerance=1e-4)
    >>> frames = scanfab.scan_frames(packing, variants="c", tolerance=0.02)
    >>> frames.plot
    Plots(rose, projection, histogram, cutoffs)
    >>> ax = Figure().subplots()
    >>> frames.plot.histogram(ax=ax).get_ylabel()
    'probability density'
    """
    settings = Settings(**options)
    rows = None if table is None else list(table)
    if rows is not None and len({row["source"] for row in rows}) > 1:
        name = Frames(source, settings).name
        rows = [row for row in rows if row["source"] == name]
    return ScannedFrames(source, settings, rows)


class ScannedFrame:
    """The scan of one frame and variant, with the data that figures draw."""

    def __init__(self, result: FrameResult, variant: str, rv: float | None, title: str) -> None:
        self.result, self.variant, self.title = result, variant, title
        self.number = result.number
        """Number of the frame, as in the table."""
        self.measurement: Measurement = result.measured(variant, rv)
        """Result of the scan."""
        self.space: Space = self.measurement.plan.space
        """The plane of the frame, if its grains are discs."""
        own = (row for row in result.rows if (row["variant"], row.get("rv")) == (variant, rv))
        self.row: Row = next(own)
        """The row of the variant at the first cut-off."""
        sample = result.sample
        self.smallest = float(sample.packing.radius[sample.grains].min())
        """The radius of the smallest grain, dump's unit."""
        self.cutoff = self.measurement.plan.cutoff / self.smallest
        """The cut-off, in units of that radius."""

    @property
    def spheres(self) -> tuple[FloatArray, FloatArray, Convex | None]:
        """Centres and radii of the variant's solids, and the window that clips lines."""
        return self.measurement.spheres_of(VARIANTS[self.variant])

    @property
    def normals(self) -> FloatArray:
        """Normals of the contacts in the contact fabric, shape (M, 3)."""
        sample, window = self.result.sample, self.measurement.plan.window
        return sample.contacts.normal[sample.fabric_contacts(VARIANTS[self.variant], window)]


class ScannedFrames:
    """
    The first and the last frame of a table that have a void fabric, for one variant.

    They are scanned once, when a figure needs them, also if the table comes from a scan.

    Parameters
    ----------
    source : Packing or Series
        The frames.
    settings : Settings
        The settings of the table. The figures show variant c if the settings have it, else the
        first variant, and the largest of several RVs.
    rows : sequence of mapping, optional
        The rows of this source in the table; by default the first and the last frame of the
        settings are scanned.

    Raises
    ------
    SettingsError
        If no frame has a void fabric of that variant.

    Examples
    --------
    >>> import scanfab
    >>> frames = scanfab.scan_frames(scanfab.Packing([[0.0, 0.0, 0.0]], 0.5), variants="a")
    >>> frames
    ScannedFrames(variant a, frame 0)
    """

    def __init__(
        self, source: Packing | Series, settings: Settings, rows: Rows | None = None
    ) -> None:
        self.source, self.settings = source, settings
        self.variant = "c" if "c" in settings.variants else settings.variants[0]
        in_window = VARIANTS[self.variant].in_window
        self.rv = settings.rvs[-1] if len(settings.rvs) > 1 and in_window else None
        # rows of one variant differ by the size of the RV if there are several RVs
        self._kind = variant_of({"variant": self.variant, "rv": self.rv})
        self.rows: Rows | None = None if rows is None else self._own(rows)

    @property
    def name(self) -> str:
        """Name of the variant, and of the source if it has a name."""
        source = self.rows[0]["source"] if self.rows else Frames(self.source, self.settings).name
        return f"variant {self._kind}{f' of {source}' if source else ''}"

    @property
    def plot(self) -> Plots:
        """The figures of the frames: ``frames.plot.rose(ax=ax)`` draws one on its Axes."""
        return Plots(self, "frames")

    @cached_property
    def frames(self) -> list[ScannedFrame]:
        """The frames, scanned along the lines of the table, which a and b share, or c and d."""
        group = "cd" if VARIANTS[self.variant].in_window else "ab"
        variants = "".join(name for name in self.settings.variants if name in group)
        first, last = self._ends
        chosen = slice(first, last + 1, max(last - first, 1))
        settings = replace(self.settings, variants=variants, frames=chosen, cutoffs=())
        results: list[FrameResult] = []
        # frames of a part have their numbers in the whole series
        whole = self.source.whole if isinstance(self.source, Series) else self.source
        rows = self._own(list(compute_rows(whole, settings, observe=results.append)))
        # titles have the strains of the table, as a strain file may have changed since
        told = self.rows or rows
        column, told_of = strain_column(told), {row["frame"]: row for row in told}
        result_of, found = {one.number: one for one in results}, []
        for number in [row["frame"] for row in rows if row["alpha_vs_axial"] is not None]:
            strain = spelt_strain(told_of[number], column, symbol=True)
            title = ", ".join(filter(None, [f"variant {self._kind}", f"frame {number}", strain]))
            found.append(ScannedFrame(result_of[number], self.variant, self.rv, title))
        return found

    @cached_property
    def _ends(self) -> tuple[int, int]:
        """The numbers of both frames."""
        if self.rows is None:
            numbers = [number for number, _ in Frames(self.source, self.settings).due()]
        else:
            numbers = [row["frame"] for row in self.rows if numbers_of([row], "alpha_vs_axial")]
        return min(numbers), max(numbers)

    def _own(self, rows: Rows) -> Rows:
        """The rows of the variant; SettingsError if there is nothing to draw."""
        own = [row for row in rows if variant_of(row) == self._kind]
        if not numbers_of(own, "alpha_vs_axial"):
            none = f"no frame has a void fabric of variant {self._kind}"
            raise SettingsError(f"there is nothing to draw: {none}")
        return own

    def __repr__(self) -> str:
        first, last = self._ends
        numbers = f"frame {first}" if first == last else f"frames {first} and {last}"
        return f"ScannedFrames({self.name}, {numbers})"
