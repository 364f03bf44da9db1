"""Figures found by name, one or several on a page, and their files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scanfab.base.errors import SettingsError
from scanfab.base.files import whole_file
from scanfab.table.plots import figures_of
from scanfab.table.table import Table
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.style import DPI, check_plot_file, figure_bytes, letter, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Page


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
    >>> from scanfab.viz.figures.page import find_figure
    >>> figure, options = find_figure("rose:45,90", "table", "frames")
    >>> figure.kind, options
    ('frames', {'angles': (45.0, 90.0)})
    """
    name, colon, argument = text.partition(":")
    offered = {name: one for kind in kinds for name, one in figures_of(kind).items()}
    found: type[Figure] | None = offered.get(name)
    options: dict[str, Any] | None = {}
    if found is not None and colon:
        options = found.parse(argument)
    if found is None or options is None:
        raise SettingsError(f"figure: expected {', '.join(offered)}, found {text!r}")
    return found, options


def make_figures(data: Any, kind: str, text: str | None = None, **offered: Any) -> list[Figure]:
    """
    The figure of a name, or all of a kind.

    Parameters
    ----------
    data : Table, rows of one, ScannedFrames or sequence of StepRow
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
    chosen: list[Any] = [(one, {}) for one in figures_of(kind).values()]
    if text is not None:
        chosen = [find_figure(text, kind)]
    found = []
    for figure, options in chosen:
        names = data.names if isinstance(data, Table) else figure.columns
        lacking = [name for name in figure.columns if name not in names]
        if lacking and text is not None:
            raise SettingsError(
                f"figure: {text} needs {', '.join(lacking)}, which the table does not have"
            )
        if text is not None or (not lacking and figure.suits(data)):
            taken = signature(figure).parameters
            more = {**offered, **options}
            found.append(figure(data, **{name: more[name] for name in more if name in taken}))
    return found


def save_figures(path: Path, figures: Sequence[Figure], dpi: int = DPI) -> None:
    """
    Draw figures to a file, all on one page.

    Parameters
    ----------
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    figures : sequence of Figure
        See :func:`make_figures`.
    dpi : int, optional
        Pixels an inch.

    Raises
    ------
    SettingsError
        If the file has another suffix.
    """
    check_plot_file(path)
    # drawn in memory first, as the PDF writer fails with an unclear error on a full disk
    with drawn_page(figures) as page:
        drawn = figure_bytes(page, path.suffix.lower().lstrip("."), dpi)
    with whole_file(path) as part:
        part.write_bytes(drawn)


@contextmanager
def drawn_page(figures: Sequence[Figure]) -> Iterator[Page]:
    """Figures below one another, lettered through, in the style of the package."""
    widths, heights = zip(*(one.size for one in figures), strict=True)
    with new_figure(max(widths), sum(heights)) as page:
        parts: Any = [page]
        if len(figures) > 1:
            parts = page.subfigures(len(figures), 1, height_ratios=heights)
        every = [one.panels(part) for part, one in zip(parts, figures, strict=True)]
        if len(figures) > 1 or figures[0].lettered:
            letter([axes for panels in every for axes in panels])
        yield page
