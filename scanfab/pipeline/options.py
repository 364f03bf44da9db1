"""Every option that is declared, and the words of the command line for them."""

from __future__ import annotations

import re
from pathlib import Path

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import SettingsError
from scanfab.base.option import Option, options_of
from scanfab.io.files import without_temporary
from scanfab.io.options import READING_OPTIONS
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.pipeline.settings import Settings


def _figures() -> list[str]:
    """All that compute draws; those of compare are among them."""
    # what looks for plugins takes a moment to load
    from scanfab.table.plots import figures_of

    return [*figures_of("table"), *figures_of("frames")]


OUTPUT_OPTIONS = (
    Option(
        name="output",
        group="output",
        help="Result file: .csv .tsv .json .jsonl .parquet; - is CSV on standard output (default: "
        "the same, or a readable table on a terminal).",
        kind=Path,
        metavar="FILE",
        spelling="-o",
        first=True,
    ),
    Option(
        name="fields",
        group="output",
        help="Which columns to write, in this order (default: all).",
        meaning="columns of the table, where not all are written",
        metavar="NAME,NAME,...",
    ),
    Option(
        name="digits",
        default=DEFAULT_DIGITS,
        group="output",
        help="Significant digits of written numbers; 17: as short as reads back the same.",
        meaning="significant digits of the numbers of the table",
        kind=int,
        metavar="N",
    ),
    Option(
        name="follow",
        default=False,
        group="reading",
        help="Wait for the frames of a running simulation, each computed once its files are whole; "
        "Ctrl-C or SIGTERM ends it in order, a second one interrupts.",
        kind=bool,
    ),
    Option(
        name="follow_for",
        group="reading",
        help="The same until so long after the last new frame.",
        kind=float,
        metavar="SECONDS",
    ),
    Option(
        name="scheduler",
        group="scan",
        help="Send the frames to the workers of a Dask cluster in place of `workers`; they see the "
        "same files by the same paths.",
        metavar="tcp://HOST:PORT",
    ),
    Option(
        name="scheduler_file",
        group="scan",
        help="The same by the file that dask scheduler, dask-mpi and dask-jobqueue write.",
        kind=Path,
        metavar="FILE",
    ),
    Option(
        name="resume",
        default=False,
        group="output",
        help="Go on with FILE.part of an interrupted run, or add what is missing to a complete "
        "FILE.",
        kind=bool,
    ),
    Option(
        name="manifest",
        group="output",
        help="Settings, seed, versions, inputs with size and hash, as JSON (with `output=FILE` "
        "also FILE.manifest.json without asking).",
        kind=Path,
        metavar="FILE",
    ),
    Option(
        name="vtk",
        group="output",
        help="Write files for ParaView of each frame that is computed now.",
        kind=Path,
        metavar="DIR",
    ),
    Option(
        name="plot",
        group="output",
        help="Draw to a file: .png .svg .pdf.",
        kind=Path,
        metavar="FILE",
    ),
    Option(
        name="figure",
        group="output",
        help="Which figure: of the table evolution, normalised, correlation or columns:NAME,NAME "
        "(default: all on one page); of the first and last frame rose (or rose:30,60,90 for these "
        "polar angles), projection, histogram or cutoffs.",
        metavar="NAME",
        choices=_figures,
    ),
)  # fmt: skip

COMPARING_OPTIONS = (
    Option(
        name="strain_max",
        group="fabric",
        help="Leave frames beyond this strain out of the fits.",
        kind=float,
        metavar="X",
    ),
    Option(
        name="labels",
        group="reading",
        help="Name of a table in place of its source, once a table, in their order.",
        metavar="NAME",
        spelling="--label",
        several=True,
    ),
)

VIEWING_OPTIONS = (
    Option(
        name="screenshot",
        group="output",
        help="Write a picture instead of opening a window; needs no screen.",
        kind=Path,
        metavar="FILE.png",
    ),
)

OPTIONS = {one.name: one for one in (*READING_OPTIONS, *options_of(Settings), *OUTPUT_OPTIONS)}
"""The options of compute by name."""

MAP_OPTIONS = {
    one.name: one
    for one in (*READING_OPTIONS, *options_of(MapSettings), *OUTPUT_OPTIONS)
    if one.name not in ("cutoffs", "figure", "with_")
}
"""Those of map."""

MEANINGS = {name: one.meaning for name, one in OPTIONS.items() if one.meaning}
"""What each option means that decides a result, in the words of the report."""

DECLARED = {
    **MAP_OPTIONS,
    **OPTIONS,
    **{one.name: one for one in (*COMPARING_OPTIONS, *VIEWING_OPTIONS)},
}
"""Those of ``map``, ``compare`` and ``view`` too."""
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
