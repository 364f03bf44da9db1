"""Every option that is declared, and the words of the command line for them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import SettingsError
from scanfab.base.option import option, options_of, reading, running
from scanfab.io.files import without_temporary
from scanfab.io.options import READING_OPTIONS
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.pipeline.settings import Settings


def _figures() -> list[str]:
    """All that compute draws; those of compare are among them."""
    # what looks for plugins takes a moment to load
    from scanfab.table.plots import figures_of

    return [*figures_of("table"), *figures_of("frames")]


def _columns() -> list[str]:
    """The columns of compute and compare."""
    from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS
    from scanfab.table.compare import FRAMES, SUMMARY

    every = (*OWN_COLUMNS, *MORE_COLUMNS, *FRAMES, *SUMMARY)
    return list(dict.fromkeys(one.name for one in every))


@dataclass
class Output:
    """The options of ``compute`` and ``map`` that are neither of reading nor settings."""

    output: Path | None = running(spelling="-o", first=True)
    """
    File for the results: .csv .tsv .json .jsonl .parquet; - is CSV on standard output (default:
    standard output, on a terminal as a readable table).
    """
    fields: str | None = option(metavar="NAME,NAME,...", choices=_columns)
    """Which columns to write, in this order (default: all)."""
    digits: int = option(default=DEFAULT_DIGITS)
    """Significant digits of numbers; 17 writes the shortest form that reads back the same."""
    follow: bool = running(default=False, group="reading")
    """
    Wait for the frames of a running simulation, and compute each once its files are whole. Ctrl-C
    or SIGTERM ends the run in order, a second one interrupts it.
    """
    follow_for: float | None = running(group="reading", metavar="SECONDS")
    """Same as `follow`, until so many seconds have passed without a new frame."""
    scheduler: str | None = running(group="scan", metavar="tcp://HOST:PORT")
    """
    Send the frames to the workers of a Dask cluster, in place of `workers`. They must see the same
    files by the same paths.
    """
    scheduler_file: Path | None = running(group="scan")
    """Same as `scheduler`, by the file that dask scheduler, dask-mpi or dask-jobqueue writes."""
    resume: bool = running(default=False)
    """Go on with the FILE.part of an interrupted run, or add missing frames to a complete FILE."""
    manifest: Path | None = running()
    """
    Write settings, seed, versions, and the size and hash of each input as JSON. With `output=FILE`
    they are always written to FILE.manifest.json.
    """
    vtk: Path | None = running(metavar="DIR")
    """Write files for ParaView of each frame that this run computes."""
    plot: Path | None = running()
    """Draw a figure: .png .svg .pdf."""
    figure: str | None = running(metavar="NAME", choices=_figures)
    """
    Which figure to draw. Of the table: evolution, normalised, correlation or columns:NAME,NAME
    (default: all on one page). Of the first and last frame: rose (rose:30,60,90 for these polar
    angles), projection, histogram or cutoffs.
    """


def _writer_names() -> Iterable[str]:
    from scanfab.io.writer import installed_writers

    return installed_writers()


@dataclass
class Other:
    """Options of commands that compute no table."""

    frame: int = reading(default=0, decides=False, metavar="K")
    """Which frame; a negative number counts from the end."""
    to: str | None = running(metavar="NAME", choices=_writer_names, first=True)
    """Format to write (default: by the suffix of OUT); scanfab formats lists them."""

    strain_max: float | None = running(group="fabric")
    """Leave frames beyond this strain out of the fits."""
    labels: str | None = running(spelling="--label", several=True, metavar="NAME")
    """Name of a table in place of its source; once for each table, in their order."""
    screenshot: Path | None = running(metavar="FILE.png")
    """Write a picture instead of opening a window; this needs no screen."""


OPTIONS = {one.name: one for one in (*READING_OPTIONS, *options_of(Settings), *options_of(Output))}
"""The options of compute by name."""

MAP_OPTIONS = {
    one.name: one
    for one in (*READING_OPTIONS, *options_of(MapSettings), *options_of(Output))
    if one.name not in ("cutoffs", "figure", "with_")
}
"""Those of map."""

DECLARED = {**MAP_OPTIONS, **OPTIONS, **{one.name: one for one in options_of(Other)}}
"""Those of the other commands too."""
NAMES = "|".join(DECLARED)


def as_options(told: str | Exception) -> str:
    """
    What the library tells, which speaks of its arguments, in the words of the command line.

    What came by standard input is called that, and not by the file that it was copied to.
    The argument whose value is wrong stands in front of a SettingsError. Any other text may begin
    with the name of a file, which may be that of an option too.

    Examples
    --------
    >>> from scanfab.pipeline.options import as_options
    >>> as_options('choose another `rv_center`, or name the `cell=(LX, LY, LZ)`')
    'choose another --rv-center, or name the --cell LX LY LZ'
    """
    text = without_temporary(str(told))
    if isinstance(told, SettingsError):
        text = re.sub(rf"^({NAMES}): ", r"`\1`: ", text)
    return re.sub(rf"`({NAMES})(=[^`]*)?`", _as_words, text)


def _as_words(found: re.Match[str]) -> str:
    """An option with its value in Python: `cell=(1, 2)` is --cell 1 2, `x={"a": "b"}` is -x a=b."""
    flag, value = DECLARED[found[1]].flag, (found[2] or "")[1:]
    if value.startswith("("):
        value = value.strip("()").replace(",", "")
    elif value.startswith("{"):
        value = value.strip("{}").replace('"', "").replace(": ", "=").replace(", ", ",")
    # what a shell takes as it is needs no quotes
    return " ".join([flag, re.sub(r'^"([\w.:/+-]*)"$', r"\1", value)]).strip()


MEANINGS = {name: as_options(one.help) for name, one in OPTIONS.items() if one.decides}
"""What each option decides that decides a result, in the words of the report."""
