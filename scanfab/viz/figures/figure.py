"""The base of all figures: a class with data, size, caption and a way to be drawn."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.viz.figures.style import COLUMN, DIRECTIONAL, STYLE, letter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from scanfab.viz.scanned_frames import ScannedFrame, ScannedFrames


class Figure:
    """
    A figure, made of its data.

    A new figure is a subclass in a file of its own that defines ``draw``. A line under the entry
    point ``scanfab.figures`` gives it a name. Then it is drawn by ``table.plot.NAME(ax=ax)`` and
    ``--figure NAME``, on the page of all figures of a table, and in the report. The first paragraph
    of its docstring is its caption, unless ``caption`` is overridden.

    Parameters
    ----------
    data : Table, ScannedFrames or sequence of StepRow
        The data, of the type that ``kind`` names. A subclass may take further options by keyword.

    Examples
    --------
    >>> from matplotlib.figure import Figure as Page
    >>> from scanfab import Table
    >>> from scanfab.viz.figures.figure import Figure
    >>> class Rattlers(Figure):
    ...     '''Rattlers over the frames.'''
    ...     columns = ("frame", "rattlers")
    ...     def draw(self, ax):
    ...         ax.plot(self.data["frame"], self.data["rattlers"])
    >>> figure = Rattlers(Table([dict(frame=0, rattlers=3), dict(frame=1, rattlers=1)]))
    >>> figure.caption
    'Rattlers over the frames.'
    >>> figure.on(Page().subplots()).lines[0].get_ydata().tolist()
    [3, 1]
    """

    kind: ClassVar[Literal["table", "frames", "calibration", "map"]] = "table"
    """Type of the data: a fabric table, scanned frames, the steps of a calibration, or a map."""
    order: ClassVar[int] = 100
    """Figures on a page and in lists are sorted by this number, then by name."""
    columns: ClassVar[tuple[str, ...]] = ()
    """The columns that the table must have."""
    lettered: ClassVar[bool] = True
    """Whether several panels have letters, (a), (b) ...; on a page of several figures they always
    have."""
    slow: ClassVar[bool] = False
    """Whether it scans along further lines, which takes too long for a report."""
    projection: ClassVar[str | None] = None
    """Projection of its Axes, by matplotlib's name."""

    def __init__(self, data: Any) -> None:
        self.data = data

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any] | None:
        """Read the options behind the colon of ``--figure NAME:...``; None if it takes none."""
        return None

    @classmethod
    def suits(cls, data: Any) -> bool:
        """Whether it belongs on the page of all figures of data that have its columns."""
        return True

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, inches."""
        return COLUMN, 2.6

    @property
    def caption(self) -> str:
        """The caption, in whole sentences."""
        return " ".join((self.__doc__ or "").split("\n\n")[0].split())

    def draw(self, ax: Axes) -> None:
        """Draw on one Axes: the main panel, or the one that an option chooses."""
        raise NotImplementedError

    def panels(self, part: FigureBase) -> list[Axes]:
        """Draw all panels on an empty Figure or SubFigure; gives back the panels."""
        axes = part.subplots(subplot_kw={"projection": self.projection})
        self.draw(axes)
        return [axes]

    def on(self, place: Any = None) -> Any:
        """
        Draw on Axes, or all panels on a Figure or SubFigure, and give ``place`` back.

        By default it makes Axes in a new figure of pyplot, in the style of the package.
        """
        if place is None:
            from matplotlib import pyplot

            with pyplot.rc_context(STYLE):
                page = pyplot.figure(layout="constrained")
                return self.on(page.subplots(subplot_kw={"projection": self.projection}))
        if hasattr(place, "subplots"):
            panels = self.panels(place)
            if self.lettered:
                letter(panels)
            return place
        if not hasattr(place, "plot"):
            raise SettingsError(
                f"ax: expected Axes, a Figure or a SubFigure of matplotlib, found {place!r}"
            )
        if self.projection is not None and place.name != self.projection:
            raise SettingsError(
                f"ax: expected {self.projection} Axes, found {place.name}: make them by "
                f'subplots(subplot_kw={{"projection": "{self.projection}"}})'
            )
        self.draw(place)
        return place


class FrameFigure(Figure):
    """
    A figure of the first and the last frame that were scanned.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of one of them, to draw only this frame.

    Raises
    ------
    SettingsError
        If no frame of that number was scanned.
    """

    kind = "frames"
    columns = ("variant", "alpha_vs_axial")
    drawn: ClassVar[str] = ""
    """Start of the caption, which goes on with the variant, the source, and ``more``."""
    more: ClassVar[str] = ""

    def __init__(self, data: ScannedFrames, frame: int | None = None) -> None:
        super().__init__(data)
        self.frame = frame

    @property
    def caption(self) -> str:
        """With the variant and the source, if ``drawn`` is set."""
        return f"{self.drawn}, {self.data.name}{self.more}." if self.drawn else super().caption

    def chosen(self, frames: list[ScannedFrame]) -> list[ScannedFrame]:
        """All of the frames, or the one that the option ``frame`` names."""
        found = [one for one in frames if self.frame in (None, one.number)]
        if not found:
            numbers = " and ".join(str(one.number) for one in frames)
            raise SettingsError(f"frame: expected {numbers}, found {self.frame!r}")
        return found


class DirectionalFigure(FrameFigure):
    """
    Void lengths and contact normals of frames over all directions; subclasses draw the columns.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of a frame, to draw only this frame. On one Axes the default is the last frame.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw only these. On one Axes the default is voids.
    """

    def __init__(
        self, data: ScannedFrames, frame: int | None = None, of: str | None = None
    ) -> None:
        super().__init__(data, frame)
        self.of = one_of(of, tuple(DIRECTIONAL))

    @cached_property
    def frames(self) -> list[ScannedFrame]:
        """The frames that are drawn."""
        return self.chosen(self.data.frames)

    def draw_column(self, column: list[Axes], frames: list[ScannedFrame], kind: str) -> Any:
        """Draw voids or contacts of frames on panels with one scale; gives back the scale."""
        raise NotImplementedError

    def add_legend(self, place: Any, scales: dict[str, Any]) -> None:
        """Add the legend that all panels share; ``scales`` has the scale of each column."""

    def draw(self, ax: Axes) -> None:
        """Draw the last frame, or the one that the option ``frame`` names."""
        self.add_legend(ax, self._draw_grid(np.array([[ax]]), "center"))

    def panels(self, part: FigureBase) -> list[Axes]:
        """A row for each frame, a column each for voids and contacts."""
        polar = {"projection": self.projection}
        shape = len(self.frames), len(self.of)
        panels = part.subplots(*shape, squeeze=False, subplot_kw=polar)
        self.add_legend(part, self._draw_grid(panels, "left"))
        return list(panels.ravel())

    def _draw_grid(self, panels: Any, loc: Any) -> dict[str, Any]:
        frames, scales = self.frames[-len(panels) :], {}
        for kind, column in zip(self.of, panels.T, strict=False):
            scales[kind] = self.draw_column(list(column), frames, kind)
            for axes, one in zip(column, frames, strict=True):
                axes.set_title(f"{DIRECTIONAL[kind]}\n{one.title}", loc=loc)
        return scales


def one_of(which: str | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """The panels to draw: all, or the one that the option ``of`` chooses."""
    if which is None:
        return known
    if which not in known:
        raise SettingsError(f"of: expected {' or '.join(known)}, found {which!r}")
    return (which,)
