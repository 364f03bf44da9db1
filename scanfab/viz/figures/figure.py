"""The base of all figures, and figures found by name, one or several on a page or in a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.files import whole_file
from scanfab.base.option import one_of
from scanfab.table.plots import figures_of
from scanfab.table.table import Table
from scanfab.viz.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Page
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
    data : Table, ScannedFrames or steps of a calibration
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
        return style.COLUMN, 2.6

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

            with pyplot.rc_context(style.STYLE):
                page = pyplot.figure(layout="constrained")
                return self.on(page.subplots(subplot_kw={"projection": self.projection}))
        if hasattr(place, "subplots"):
            style.letter(self.panels(place))
            return place
        if not hasattr(place, "plot"):
            expected = "Axes, a Figure or a SubFigure of matplotlib"
            raise SettingsError(f"ax: expected {expected}, found {place!r}")
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

    @cached_property
    def frames(self) -> list[ScannedFrame]:
        """The frames that are drawn."""
        return self.chosen(self.data.frames)

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

    def __init__(self, data: Any, frame: int | None = None, of: str | None = None) -> None:
        super().__init__(data, frame)
        self.of = shown_of(of, tuple(style.DIRECTIONAL))

    def draw_column(self, column: list[Axes], frames: list[ScannedFrame], kind: str) -> None:
        """Draw voids or contacts of frames on panels with one scale."""
        raise NotImplementedError

    def add_legend(self, place: Any, panels: Any) -> None:
        """Add the legend that all panels share, shape (frames, columns)."""

    def draw(self, ax: Axes) -> None:
        """Draw the last frame, or the one that the option ``frame`` names."""
        self._draw_grid(ax, np.array([[ax]]), "center")

    def panels(self, part: FigureBase) -> list[Axes]:
        """A row for each frame, a column each for voids and contacts."""
        polar = {"projection": self.projection}
        panels = part.subplots(len(self.frames), len(self.of), squeeze=False, subplot_kw=polar)
        self._draw_grid(part, panels, "left")
        return list(panels.ravel())

    def _draw_grid(self, place: Any, panels: Any, loc: Any) -> None:
        frames = self.frames[-len(panels) :]
        for kind, column in zip(self.of, panels.T, strict=False):
            self.draw_column(list(column), frames, kind)
            for axes, one in zip(column, frames, strict=True):
                axes.set_title(f"{style.DIRECTIONAL[kind]}\n{one.title}", loc=loc)
        self.add_legend(place, panels)


def shown_of(of: str | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """The panels to draw: all, or the one that the option ``of`` chooses."""
    return known if of is None else (one_of(*known)("of", of),)


def find_figure(text: str, *kinds: str) -> tuple[type[Figure], dict[str, Any]]:
    """
    A figure by its name, and the options that stand behind a colon.

    Parameters
    ----------
    text : str
        Name and options, for instance ``rose:30,60,90``.
    *kinds : str
        Kinds of data to search: ``table``, ``frames``, ``calibration``, ``map``.

    Raises
    ------
    SettingsError
        If there is no such figure. The message lists the figures.

    Examples
    --------
    >>> from scanfab.viz.figures.figure import find_figure
    >>> figure, options = find_figure("rose:45,90", "table", "frames")
    >>> figure.kind, options
    ('frames', {'angles': (45.0, 90.0)})
    """
    name, colon, argument = text.partition(":")
    offered = {name: one for kind in kinds for name, one in figures_of(kind).items()}
    found: type[Figure] | None = offered.get(name)
    options = {} if found is None or not colon else found.parse(argument)
    if found is None or options is None:
        raise SettingsError(f"figure: expected {', '.join(offered)}, found {text!r}")
    return found, options


def make_figures(data: Any, kind: str, text: str | None = None, **offered: Any) -> list[Figure]:
    """
    The figure of a name, or all of a kind.

    Parameters
    ----------
    data : Table, rows of one, ScannedFrames or steps of a calibration
        The data to be drawn.
    kind : str
        ``table``, ``frames``, ``calibration`` or ``map``.
    text : str, optional
        See :func:`find_figure`. By default all figures whose columns the table has.
    **offered
        Options, which are given to the figures that take them.

    Raises
    ------
    SettingsError
        If there is no such figure, it needs a column that the table lacks, or there is nothing to
        draw.
    """
    if kind == "table" and not isinstance(data, Table):
        data = Table(data)

    def lacking(figure: Any) -> list[str]:
        needed = figure.columns if isinstance(data, Table) else ()
        return [name for name in needed if name not in data.names]

    chosen: list[Any]
    if text is None:
        every = figures_of(kind).values()
        chosen = [(one, {}) for one in every if not lacking(one) and one.suits(data)]
    else:
        chosen = [find_figure(text, kind)]
        if names := ", ".join(lacking(chosen[0][0])):
            raise SettingsError(f"figure: {text} needs {names}, which the table does not have")
    made = []
    for figure, options in chosen:
        known = {k: v for k, v in offered.items() if k in signature(figure).parameters}
        made.append(figure(data, **{**known, **options}))
    return made


def save_figures(path: Path, figures: Sequence[Figure]) -> None:
    """
    Draw figures to a file, all on one page.

    Parameters
    ----------
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    figures : sequence of Figure
        See :func:`make_figures`.

    Raises
    ------
    SettingsError
        If the file has another suffix.
    """
    style.check_plot_file(path)
    # drawn in memory first, as the PDF writer fails with an unclear error on a full disk
    with drawn_page(figures) as page:
        drawn = style.figure_bytes(page, path.suffix.lower().lstrip("."))
    with whole_file(path) as part:
        part.write_bytes(drawn)


@contextmanager
def drawn_page(figures: Sequence[Figure]) -> Iterator[Page]:
    """Figures below one another, lettered through, in the style of the package."""
    widths, heights = zip(*(one.size for one in figures), strict=True)
    with style.new_figure(max(widths), sum(heights)) as page:
        parts: Any = [page]
        if len(figures) > 1:
            parts = page.subfigures(len(figures), 1, height_ratios=heights)
        every = [one.panels(part) for part, one in zip(parts, figures, strict=True)]
        style.letter([axes for panels in every for axes in panels])
        yield page
