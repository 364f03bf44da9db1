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


def _columns() -> set[str]:
    """Those of all tables."""
    from scanfab.base.column import columns_of_fields
    from scanfab.pipeline.calibration import StepRow
    from scanfab.table.columns import MORE_COLUMNS, map_columns, table_columns
    from scanfab.table.compare import FRAMES, SUMMARY

    tables = (table_columns(), MORE_COLUMNS, map_columns((), shells=True), FRAMES, SUMMARY)
    return {one.name for table in (*tables, columns_of_fields(StepRow)) for one in table}


@dataclass
class Output:
    """The options of ``compute`` and ``map`` that are neither of reading nor settings."""

    output: Path | None = running(spelling="-o", first=True)
    """
    Result file: .csv .tsv .json .jsonl .parquet; - is CSV on standard output (default: the same, or
    a readable table on a terminal).
    """
    fields: str | None = option(metavar="NAME,NAME,...", choices=_columns)
    """Which columns to write, in this order (default: all)."""
    digits: int = option(default=DEFAULT_DIGITS)
    """Significant digits of written numbers; 17: as short as reads back the same."""
    follow: bool = running(default=False, group="reading")
    """
    Wait for the frames of a running simulation, each computed once its files are whole; Ctrl-C or
    SIGTERM ends it in order, a second one interrupts.
    """
    follow_for: float | None = running(group="reading", metavar="SECONDS")
    """The same until so long after the last new frame."""
    scheduler: str | None = running(group="scan", metavar="tcp://HOST:PORT")
    """
    Send the frames to the workers of a Dask cluster in place of `workers`; they see the same files
    by the same paths.
    """
    scheduler_file: Path | None = running(group="scan")
    """The same by the file that dask scheduler, dask-mpi and dask-jobqueue write."""
    resume: bool = running(default=False)
    """Go on with FILE.part of an interrupted run, or add what is missing to a complete FILE."""
    manifest: Path | None = running()
    """
    Settings, seed, versions, inputs with size and hash, as JSON (with `output=FILE` also
    FILE.manifest.json without asking).
    """
    vtk: Path | None = running(metavar="DIR")
    """Write files for ParaView of each frame that is computed now."""
    plot: Path | None = running()
    """Draw to a file: .png .svg .pdf."""
    figure: str | None = running(metavar="NAME", choices=_figures)
    """
    Which figure: of the table evolution, normalised, correlation or columns:NAME,NAME (default: all
    on one page); of the first and last frame rose (or rose:30,60,90 for these polar angles),
    projection, histogram or cutoffs.
    """


def _writer_names() -> Iterable[str]:
    from scanfab.io.writer import installed_writers

    return installed_writers()


@dataclass
class Other:
    """Options of commands that compute no table."""

    frame: int = reading(default=0, decides=False, metavar="K")
    """Which frame; negative: from the end."""
    to: str | None = running(metavar="NAME", choices=_writer_names, first=True)
    """Format to write (default: by the suffix of OUT); scanfab formats lists them."""

    strain_max: float | None = running(group="fabric")
    """Leave frames beyond this strain out of the fits."""
    labels: str | None = running(spelling="--label", several=True, metavar="NAME")
    """Name of a table in place of its source, once a table, in their order."""
    screenshot: Path | None = running(metavar="FILE.png")
    """Write a picture instead of opening a window; needs no screen."""


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
    return re.sub(rf"`({NAMES})(?:=([^`]*))?`", _as_option, text)


def _as_option(found: re.Match[str]) -> str:
    name, value = found.groups()
    return DECLARED[name].flag + ("" if value is None else f" {_as_word(value)}")


def _as_word(value: str) -> str:
    """A value in Python as words of a command line: (1, 2) is 1 2, and {"x": "px"} is x=px."""
    if value.startswith("("):
        return value.strip("()").replace(",", "")
    if value.startswith("{"):
        return value.strip("{}").replace('"', "").replace(": ", "=").replace(", ", ",")
    # what a shell takes as it is needs no quotes
    return re.sub(r'^"([\w.:/+-]*)"$', r"\1", value)


MEANINGS = {name: as_options(one.help) for name, one in OPTIONS.items() if one.decides}
"""What each option decides that decides a result, in the words of the report."""
