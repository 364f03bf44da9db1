"""Options that several commands share, and how a wrong value is told."""

from __future__ import annotations

import glob
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

__all__ = [
    "AS_CSV",
    "SourceType",
    "axis_option",
    "check_plot",
    "choosing_options",
    "completed",
    "cutoff_option",
    "excerpt_options",
    "frames_option",
    "output_option",
    "plot_option",
    "reading_options",
    "sample_options",
    "seed_option",
    "sources_argument",
    "usage_errors",
    "window_options",
    "workers_option",
]

Command = Callable[..., Any]
Completion = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

# of the context: -o - asks for CSV on standard output, on a terminal too
AS_CSV = "scanfab.as_csv"


def completed(
    *choices: str, files: bool = False, more: Callable[[], Iterable[str]] = tuple
) -> Completion:
    """
    What a shell offers for an option: these words, those of a function, or files.

    The option takes other words too, or complains of them in words of its own.
    """

    def complete(ctx: click.Context, parameter: click.Parameter, text: str) -> list[CompletionItem]:
        found = [CompletionItem(word) for word in (*choices, *more()) if word.startswith(text)]
        return [*found, CompletionItem(text, type="file")] if files else found

    return complete


@contextmanager
def usage_errors(before: str = "") -> Iterator[None]:
    """Settings that cannot be are wrong usage; ``before`` stands before the message."""
    from scanfab.base.errors import SettingsError, UnknownFormatError

    try:
        yield
    except (SettingsError, UnknownFormatError) as error:
        raise click.UsageError(f"{before}{error}") from None


def together(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Several options as one decorator, in the order of the help."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def _reader_names() -> Iterable[str]:
    from scanfab.io.registry import installed_readers

    return installed_readers()


def _expanded(source: str) -> list[Any]:
    """What a glob names; one that names nothing is a path that does not exist."""
    from scanfab.base.errors import ReadError
    from scanfab.io.grain_files import expanded

    try:
        return [*expanded(source)]
    except ReadError:
        return [source]


class SourceType(click.Path):
    """A path that exists, or a glob in quotes that names some; it stays as it is."""

    def __init__(self) -> None:
        super().__init__(exists=True, allow_dash=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse what does not exist."""
        is_glob = not Path(value).exists() and glob.has_magic(value)
        if self.exists and is_glob and not glob.glob(value):
            self.fail(f"{value!r} matches nothing: there is no file or folder of such a name.")
        for one in _expanded(value):
            super().convert(one, param, ctx)
        return value


def _expand(ctx: click.Context, param: click.Parameter, sources: tuple[str, ...]) -> Any:
    """What the shell would have made of globs that it was not asked to expand."""
    return tuple(one for source in sources for one in _expanded(source))


sources_argument = click.argument(
    "sources", metavar="SOURCE...", nargs=-1, required=True, type=SourceType(), callback=_expand
)

reading_options = together(
    click.option(
        "--format",
        metavar="NAME",
        shell_complete=completed(more=_reader_names),
        help="Reader to use (default: by content).",
    ),
    click.option(
        "--columns",
        metavar="NAMES",
        help='Names of columns that are not the usual ones: "radius=c_rad,x=px".',
    ),
    click.option(
        "--contact-columns",
        metavar="KEYWORDS",
        help='Columns of a dump local: LIGGGHTS keywords "pos id force", '
        'or LAMMPS names "id1=NAME,id2=NAME".',
    ),
    click.option(
        "--radius",
        type=click.FloatRange(min=0, min_open=True),
        metavar="L",
        help="Radius for dumps without one.",
    ),
    click.option(
        "--cell",
        metavar="LX LY LZ [XY XZ YZ]|FILE.csv",
        help="The cell, for formats that do not carry it (periodic in xyz unless --periodic); "
        "FILE.csv has one for each step or frame: step lx ly lz, and xy xz yz if tilted.",
    ),
    click.option("--periodic", metavar="xyz", help="Periodic directions (default: the dump's)."),
    click.option(
        "--contacts",
        default="auto",
        metavar="PATH|file|geometric",
        shell_complete=completed("file", "geometric", files=True),
        help="Contacts: a file, folder or glob matched by step; from the dump's own contact files; "
        "or by geometry (default: file if there is one, else geometric).",
    ),
)

sample_options = together(
    click.option(
        "--contact-tolerance",
        default=0.0,
        show_default=True,
        metavar="X",
        help="Relative: contact if distance < (r1 + r2)(1 + X).",
    ),
    click.option(
        "--boundary",
        multiple=True,
        metavar="EXPR",
        help='Which particles are boundary: "type=2", "mask=3,4", "id>=13723"; repeated: or.',
    ),
    click.option(
        "--min-contacts",
        default=2,
        show_default=True,
        metavar="N",
        help="A grain with fewer contacts is a rattler.",
    ),
)

frames_option = click.option(
    "--frames", metavar="A:B:C", help="Which frames, as a Python slice (default: all)."
)

window_options = together(
    click.option(
        "--rv",
        default=0.7,
        show_default=True,
        metavar="FRACTION",
        help="Radius of the sphere RV, as a fraction of half the smallest extent of the grains.",
    ),
    click.option("--rv-radius", type=float, metavar="L", help="The same in the dump's units."),
    click.option(
        "--rv-center",
        nargs=3,
        type=float,
        metavar="X Y Z",
        help="Centre of the RV (default: middle).",
    ),
)

cutoff_option = click.option(
    "--cutoff",
    default="1rmin",
    show_default=True,
    metavar="L",
    help="Shortest void segment kept: in the dump's units, or with rmin, rmean, rmax.",
)

choosing_options = together(
    click.option(
        "--cutoff",
        type=float,
        metavar="C",
        help="Take the rows of this cut-off from tables of several; in the tables' unit.",
    ),
    click.option(
        "--label",
        "labels",
        multiple=True,
        metavar="NAME",
        help="Name of a table in place of its source, once a table, in their order.",
    ),
)

axis_option = click.option(
    "--axis",
    default="z",
    show_default=True,
    metavar="x|y|z|X,Y,Z",
    shell_complete=completed("x", "y", "z"),
    help="Loading axis.",
)

seed_option = click.option(
    "--seed", default=0, show_default=True, metavar="N", help="Of the random numbers."
)

workers_option = click.option(
    "--workers", type=int, metavar="N", help="Parallel workers (default: all cores)."
)


def _output(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The file; ``-`` is standard output, which gets CSV wherever it goes."""
    if path == Path("-"):
        ctx.meta[AS_CSV] = True
        return None
    return path


output_option = click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path, allow_dash=True),
    callback=_output,
    metavar="FILE",
    help="Result file: .csv .tsv .json .jsonl .parquet; - is CSV on standard output (default: the "
    "same, or a readable table on a terminal).",
)


def _complete_fields(
    ctx: click.Context, parameter: click.Parameter, text: str
) -> list[CompletionItem]:
    """The columns of what a command writes, behind those that are named already."""
    from dataclasses import fields

    from scanfab.pipeline.ladders import StepRow
    from scanfab.table.comparison import FrameRow, SummaryRow
    from scanfab.table.table import Row

    of_compare = SummaryRow if ctx.params.get("summary") else FrameRow
    kind: type = {"calibrate": StepRow, "compare": of_compare}.get(str(ctx.command.name), Row)
    before, comma, last = text.rpartition(",")
    names = [one.name for one in fields(kind) if one.name not in before.split(",")]
    return [CompletionItem(before + comma + name) for name in names if name.startswith(last)]


excerpt_options = together(
    click.option(
        "--fields",
        metavar="NAME,NAME,...",
        shell_complete=_complete_fields,
        help="Which columns to write, in this order (default: all).",
    ),
    click.option(
        "--digits",
        default=17,
        show_default=True,
        metavar="N",
        help="Significant digits of written numbers; 17: as short as reads back the same.",
    ),
)


plot_option = click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw to a file: .png .svg .pdf.",
)


def check_plot(plot: Path | None, figure: str | None, figures: Iterable[str]) -> None:
    """A usage error if no such figure can be drawn to such a file."""
    from scanfab.viz.figures.style import check_plot_file

    if plot is None:
        if figure is not None:
            raise click.UsageError("--figure goes with --plot FILE")
        return
    name = "rose" if figure is not None and figure.startswith("rose:") else figure
    if name is not None and name not in figures:
        raise click.UsageError(f"--figure: expected {', '.join(figures)}, found {figure!r}")
    with usage_errors("--plot: "):
        check_plot_file(plot)
