"""All declared options, and warnings and notes as the command line spells them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import ScanfabNote, ScanfabWarning, SettingsError, SkippedFrameWarning
from scanfab.base.option import option, options_of, reading, running
from scanfab.io.files import without_temporary
from scanfab.io.reader import READING_OPTIONS
from scanfab.io.writer import installed_writers
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.settings import Settings


def _figures() -> list[str]:
    """Names of the figures that compute and compare draw."""
    # imported here because looking for plugins takes a moment
    from scanfab.table.plots import figures_of

    return [*figures_of("table"), *figures_of("frames")]


def _columns() -> list[str]:
    """Names of the columns of compute and compare."""
    from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS
    from scanfab.table.compare import FRAMES, SUMMARY

    columns = (*OWN_COLUMNS, *MORE_COLUMNS, *FRAMES, *SUMMARY)
    return list(dict.fromkeys(column.name for column in columns))


@dataclass
class Output:
    """Options of ``compute`` and ``map`` about output and the run, not about the result."""

    output: Path | None = running(spelling="-o", first=True)
    """
    File for the results: .csv .tsv .json .jsonl .parquet; - is CSV on standard output (default:
    standard output, on a terminal as a readable table).
    """
    fields: str | None = option(form="NAME,NAME,...", words=_columns)
    """Which columns to write, in this order (default: all)."""
    digits: int = option(default=DEFAULT_DIGITS)
    """Significant digits of numbers; 17: the shortest text that reads back to the same number."""
    follow: bool = running(default=False, group="reading")
    """
    Wait for the frames of a running simulation, and compute each frame when its files are complete.
    Ctrl-C or SIGTERM finishes the frames under way and ends the run; a second signal interrupts it.
    """
    follow_for: float | None = running(group="reading", form="SECONDS")
    """Same as `follow`, but stop after this many seconds without a new frame."""
    scheduler: str | None = running(group="scan", form="tcp://HOST:PORT")
    """
    Send the frames to the workers of a Dask cluster, in place of `workers`. The workers must find
    the same files at the same paths.
    """
    scheduler_file: Path | None = running(group="scan")
    """Same as `scheduler`, from the file that dask scheduler, dask-mpi or dask-jobqueue writes."""
    resume: bool = running(default=False)
    """Continue the FILE.part of an interrupted run, or add missing frames to a complete FILE."""
    manifest: Path | None = running()
    """
    Write settings, seed, versions, and the size and hash of each input as JSON. With `output=FILE`
    they are always written to FILE.manifest.json.
    """
    vtk: Path | None = running(form="DIR")
    """Write files for ParaView into this folder, for each frame that this run computes."""
    plot: Path | None = running()
    """Draw a figure: .png .svg .pdf."""
    figure: str | None = running(form="NAME", words=_figures)
    """
    Which figure to draw. Of the table: evolution, normalised, correlation or columns:NAME,NAME
    (default: all on one page). Of the first and last frame: rose (rose:30,60,90 for these polar
    angles), projection, histogram or cutoffs.
    """


@dataclass
class Other:
    """Options of the other commands, which compute no table."""

    frame: int = reading(default=0, decides=False, form="K")
    """Which frame; a negative number counts from the end."""
    to: str | None = running(form="NAME", words=installed_writers, first=True)
    """Format to write (default: from the suffix of OUT); scanfab formats lists all formats."""

    strain_max: float | None = running(group="fabric")
    """Leave frames beyond this strain out of the fits."""
    labels: str | None = running(spelling="--label", several=True, form="NAME")
    """Name of a table, in place of its source. Repeat the option for each table, in order."""
    screenshot: Path | None = running(form="FILE.png")
    """Write a picture in place of opening a window; this needs no screen."""


OPTIONS = {
    option.name: option for option in (*options_of(Output), *options_of(Settings), *READING_OPTIONS)
}
"""Options of compute, by name."""

MAP_OPTIONS = {
    option.name: option
    for option in (*options_of(Output), *options_of(MapSettings), *READING_OPTIONS)
    if option.name not in ("cutoffs", "figure", "with_")
}
"""Options of map, by name."""

DECLARED = {**MAP_OPTIONS, **OPTIONS, **{option.name: option for option in options_of(Other)}}
"""Options of all commands, by name."""
NAMES = "|".join(DECLARED)


def as_options(message: str | Exception) -> str:
    """
    Rewrite a message of the library, which names Python arguments, for the command line.

    The name of the temporary file that holds standard input is replaced as well. A SettingsError
    begins with the argument that is wrong. Other messages may begin with the name of a file, which
    may look like an option, so their first word stays.

    Examples
    --------
    >>> from scanfab.pipeline.options import as_options
    >>> as_options('choose another `rv_center`, or name the `cell=(LX, LY, LZ)`')
    'choose another --rv-center, or name the --cell LX LY LZ'
    """
    text = without_temporary(str(message))
    if isinstance(message, SettingsError):
        text = re.sub(rf"^({NAMES}): ", r"`\1`: ", text)
    return re.sub(rf"`({NAMES})(=[^`]*)?`", _as_words, text)


def _as_words(match: re.Match[str]) -> str:
    """Spell an option with a Python value: `cell=(1, 2)` is --cell 1 2, `x={"a": "b"}` -x a=b."""
    flag, value = DECLARED[match[1]].flag, (match[2] or "")[1:]
    if value.startswith("("):
        value = value.strip("()").replace(",", "")
    elif value.startswith("{"):
        value = value.strip("{}").replace('"', "").replace(": ", "=").replace(", ", ",")
    # quotes are dropped if a shell does not need them
    return " ".join([flag, re.sub(r'^"([\w.:/+-]*)"$', r"\1", value)]).strip()


MEANINGS = {name: as_options(option.help) for name, option in DECLARED.items() if option.decides}
"""For the report: the help of each option that decides a result, by name."""


@dataclass
class Told:
    """Warnings and notes as manifests list them: each text once, spelt as on the command line."""

    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    skipped: int = 0
    """Number of frames that were skipped."""


@contextmanager
def listening(show: Callable[[Warning], object] | None = None) -> Iterator[Told]:
    """
    Keep the warnings and notes of scanfab inside the block, whatever the filters of the caller say.

    Each new text is shown at once by ``show``. Without ``show`` the texts are issued again after
    the block, as warnings at the line that calls the function of the block; there the filters of
    the caller show them, hide them or raise them. Warnings of other packages pass unchanged.
    """
    told, later = Told(), list[Warning]()
    try:
        with warnings.catch_warnings():
            others: Any = warnings.showwarning

            def hear(message: Any, category: type[Warning], *place: Any, **more: Any) -> None:
                if not issubclass(category, ScanfabWarning | ScanfabNote):
                    others(message, category, *place, **more)
                    return
                told.skipped += category is SkippedFrameWarning
                known = told.notes if category is ScanfabNote else told.warnings
                if (text := as_options(str(message))) not in known:
                    known.append(text)
                    (show or later.append)(message)

            for kind in (ScanfabWarning, ScanfabNote):
                warnings.simplefilter("always", kind)
            warnings.showwarning = hear
            yield told
    finally:
        for message in later:
            warnings.warn(message, stacklevel=4)
