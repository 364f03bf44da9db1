"""What a figure is: a class with its data, its size, its caption, and how it is drawn."""

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

    The next one is a subclass in a file of its own, with a line under the entry point
    ``scanfab.figures`` that gives it its name. It needs ``draw``; it is found then as
    ``table.plot.NAME(ax=ax)`` and as ``--figure NAME``, on the page of all figures of a table, and
    in the report. The first paragraph of its docstring is its caption, unless it has another.

    Parameters
    ----------
    data : Table, ScannedFrames or sequence of StepRow
        As ``kind`` says. A subclass may take options besides, by keyword.

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
    """What it is drawn of: a fabric table, scanned frames, the steps of a calibration, a map."""
    order: ClassVar[int] = 100
    """Where it stands among the others, on a page and in lists; of equals, by name."""
    columns: ClassVar[tuple[str, ...]] = ()
    """The columns of the table without which it cannot be drawn."""
    lettered: ClassVar[bool] = False
    """Whether its panels have letters, (a), (b) ..., also where it stands alone."""
    slow: ClassVar[bool] = False
    """Whether it scans along further lines, which is too long to wait for in a report."""
    projection: ClassVar[str | None] = None
    """Of the Axes that it draws on, as matplotlib names it."""

    def __init__(self, data: Any) -> None:
        self.data = data

    @classmethod
    def parse(cls, argument: str) -> dict[str, Any] | None:
        """The options behind the colon of ``--figure NAME:...``; None if it takes none."""
        return None

    @classmethod
    def suits(cls, data: Any) -> bool:
        """Whether it is drawn, unasked, with the others of some data that have its columns."""
        return True

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, inches."""
        return COLUMN, 2.6

    @property
    def caption(self) -> str:
        """What is drawn, in whole sentences."""
        return " ".join((self.__doc__ or "").split("\n\n")[0].split())

    def draw(self, ax: Axes) -> None:
        """Draw on one Axes; of several panels the one that says most, or that is chosen."""
        raise NotImplementedError

    def panels(self, part: FigureBase) -> list[Axes]:
        """Draw on an empty Figure or SubFigure; the panels, to be lettered before their titles."""
        axes = part.subplots(subplot_kw={"projection": self.projection})
        self.draw(axes)
        return [axes]

    def on(self, place: Any = None) -> Any:
        """
        Draw on Axes, or all panels on a Figure or SubFigure; gives back what it has drawn on.

        By default that is an Axes in a new figure of pyplot, in the style of the package.
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
        The number of one of them, to draw that one alone.

    Raises
    ------
    SettingsError
        If no frame of that number was scanned.
    """

    kind = "frames"
    columns = ("variant", "alpha_vs_axial")
    drawn: ClassVar[str] = ""
    """What is drawn: the caption goes on with the variant and the source, and ``more``."""
    more: ClassVar[str] = ""

    def __init__(self, data: ScannedFrames, frame: int | None = None) -> None:
        super().__init__(data)
        self.frame = frame

    @property
    def caption(self) -> str:
        """With the variant and the source; without ``drawn`` as in other figures."""
        return f"{self.drawn}, {self.data.name}{self.more}." if self.drawn else super().caption

    def chosen(self, frames: list[ScannedFrame]) -> list[ScannedFrame]:
        """All of the frames, or the one that is asked for."""
        found = [one for one in frames if self.frame in (None, one.number)]
        if not found:
            numbers = " and ".join(str(one.number) for one in frames)
            raise SettingsError(f"frame: expected {numbers}, found {self.frame!r}")
        return found


class DirectionalFigure(FrameFigure):
    """
    Void lengths and contact normals of frames over all directions; needs ``draw_column``.

    Parameters
    ----------
    data : ScannedFrames
        Of :func:`scanfab.scan_frames`.
    frame : int, optional
        The number of a frame, to draw that one alone; on one Axes the last by default.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.
    """

    lettered = True

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
        """Draw voids or contacts of frames on panels with one scale; gives back that scale."""
        raise NotImplementedError

    def add_legend(self, place: Any, scales: dict[str, Any]) -> None:
        """Add what all panels of the Axes or the Figure share; ``scales`` are those of columns."""

    def draw(self, ax: Axes) -> None:
        """Of the last frame, unless another one is asked for."""
        self.add_legend(ax, self._draw_grid(np.array([[ax]]), "center"))

    def panels(self, part: FigureBase) -> list[Axes]:
        """A row for each frame, a column for each of both."""
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
