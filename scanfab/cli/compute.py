"""scanfab compute: the fabric table."""

from __future__ import annotations

import json
import sys
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import check_plot, options, sources_argument, usage_errors
from scanfab.cli.running import Run
from scanfab.cli.settings_file import SettingsFile, fill_from_file
from scanfab.cli.sources import SourceCommand, open_series, reading_arguments
from scanfab.cli.talk import talk_options, tell_inputs
from scanfab.pipeline.options import OPTIONS, OUTPUT_OPTIONS

if TYPE_CHECKING:
    from scanfab.cli.console import Told
    from scanfab.table.result_file import ResultFile
    from scanfab.table.writing import Excerpt

__all__ = ["OF_THE_LINE", "compute"]

# in the order of the help
ORDER = ("output", "sample", "reading", "window", "scan", "fabric")
# what a settings file says nothing of: what is read, where results go, and what is told
OF_THE_LINE = (
    "sources", "quiet", "verbose", "help", *(one.name for one in OUTPUT_OPTIONS if not one.meaning)
)  # fmt: skip

# of directions
RULES = (
    "lebedev", "design", "icosahedral", "product", "fibonacci", "equal-angle", "equal-angle-full",
)  # fmt: skip


@click.command(cls=SourceCommand)
@sources_argument
@options(*(one.name for group in ORDER for one in OPTIONS.values() if one.group == group))
@talk_options
@click.pass_context
def compute(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    output: Path | None,
    resume: bool,
    manifest_path: Path | None,
    vtk_folder: Path | None,
    plot: Path | None,
    figure: str | None,
    **chosen: Any,
) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input; what is
    named twice counts once.

    \b
    A folder:       scanfab compute dumps/ --boundary type=2 -o fabric.csv
    Several files:  scanfab compute dumps/*.vtk --variants cd --tolerance 1e-3
    A pipe:         zcat dump.gz | scanfab compute - --format liggghts

    Variants: a whole sample; b whole sample, rattlers removed; c representative volume (RV); d RV,
    rattlers removed. Lengths are in the dump's own units.
    """
    from scanfab.base.files import check_folder
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.pipeline.manifest import asked_for
    from scanfab.pipeline.settings import Settings
    from scanfab.table.columns import table_columns
    from scanfab.table.result_file import ResultFile
    from scanfab.table.writing import Excerpt

    if resume and output is None:
        raise click.UsageError("--resume goes with -o FILE")
    _check_figure(plot, figure)
    with reported_warnings() as told:
        chosen, settings_file = fill_from_file(ctx, sources, chosen)
        if chosen.get("cutoffs") and (vtk_folder is not None or plot is not None):
            raise click.UsageError("--vtk and --plot are of one cut-off: leave out --cutoffs")
        with settings_file.named_errors():
            reading = reading_arguments(chosen)
            fields, digits = chosen.pop("fields"), int(chosen.pop("digits"))
            settings = Settings(**chosen)
            columns = table_columns(settings.more_columns)
            excerpt = Excerpt.make(columns, fields, digits)
            result = None if output is None else ResultFile(output, columns, excerpt)
            if manifest_path is not None:
                check_folder(manifest_path)
        asked = {**asked_for(sources, reading, settings), **excerpt.asked()}
        series = open_series(sources, reading)
        if figure is not None and _is_of_frames(figure) and len(series) > 1:
            raise click.UsageError(f"--figure {figure} draws one series: name one source")
        tell_inputs(series, settings.workers)
        announce_compiling()
        run = Run(series, settings, vtk_folder, resume, keep=plot is not None)
        with nullcontext() if result is None else result.alone():
            if resume and result is not None:
                with usage_errors():
                    asked = run.go_on(result, asked)
                    if plot is not None and run.table is not None:
                        run.table.check_columns(_columns_drawn(figure))
            _write_or_say(run, asked, result, excerpt)
        for path in _manifests(output, manifest_path):
            _write_manifest(path, asked, run, told, settings_file)
        if plot is not None:
            _draw(plot, figure, run)
    return 0 if run.found and not told.skipped and not run.skipped else 1


def _note_replaced(output: Path) -> None:
    from scanfab.base.errors import ScanfabNote

    warnings.warn(
        f"{output}: the table that is there will be replaced at the end of this run; --resume "
        f"would go on with it",
        ScanfabNote,
        stacklevel=3,
    )


def _check_figure(plot: Path | None, figure: str | None) -> None:
    if plot is None and figure is None:
        return
    from scanfab.viz.figures.fitted import TABLE_FIGURES
    from scanfab.viz.figures.scanned import FRAME_FIGURES, parse_figure

    check_plot(plot, figure, [*TABLE_FIGURES, *FRAME_FIGURES])
    if figure is not None and _is_of_frames(figure):
        with usage_errors():
            parse_figure(figure)


def _is_of_frames(figure: str) -> bool:
    from scanfab.viz.figures.fitted import TABLE_FIGURES

    return figure not in TABLE_FIGURES


def _columns_drawn(figure: str | None) -> tuple[str, ...]:
    """The columns of the table without which a figure cannot be."""
    of_curves = ("strain", "alpha_c_axial")
    needed = () if figure is not None and _is_of_frames(figure) else of_curves
    return ("variant", "alpha_vs_axial", *needed)


def _draw(plot: Path, figure: str | None, run: Run) -> None:
    from scanfab.viz.figures.fitted import plot_rows
    from scanfab.viz.figures.scanned import plot_frames

    if not run.found:
        click.echo(f"scanfab: {plot} is not drawn: no row has a void fabric", err=True)
    elif figure is not None and _is_of_frames(figure):
        plot_frames(plot, run.series[0], run.settings, run.kept, figure)
    else:
        plot_rows(plot, run.kept, figure)


def _write_or_say(
    run: Run, asked: dict[str, Any], result: ResultFile | None, excerpt: Excerpt
) -> None:
    """Write the rows; where that is interrupted or fails, say how far it is and how to go on."""
    from scanfab.base.errors import ScanfabError
    from scanfab.cli.console import is_readable
    from scanfab.cli.signals import telling

    printed = not is_readable()

    def standing() -> str:
        return _standing(run, result, printed)

    try:
        with telling(standing):
            _write(run, asked, result, excerpt)
    except (ScanfabError, OSError):
        if result is not None and (run.is_over or 0 < run.done < run.frames()):
            click.echo(f"scanfab: stopped {standing()}", err=True)
        raise


def _standing(run: Run, result: ResultFile | None, printed: bool) -> str:
    """How far a run is, and how to go on."""
    if not run.done and run.table is not None and result is not None:
        return (
            f"before the first new frame was finished: {result.path} is as it was; the same "
            f"command goes on"
        )
    if not run.done:
        return "before the first frame was finished: nothing is kept"
    if result is None:
        kept = "the rows printed so far are all" if printed else "nothing is kept"
        return f"{run.standing()}; {kept}: with -o FILE, --resume could go on"
    again = "the same command" if run.resume else "the same command with --resume"
    return f"{run.standing()}; {again} goes on"


def _write(run: Run, asked: dict[str, Any], result: ResultFile | None, excerpt: Excerpt) -> None:
    """Write the rows as they come."""
    from scanfab.cli.console import is_readable, print_table
    from scanfab.table.columns import table_columns
    from scanfab.table.writing import row_writer

    if result is not None:
        with result.writer(asked, run.resume) as writer:
            for number, row in enumerate(run.rows()):
                if number == 0 and not run.resume and result.has_table:
                    _note_replaced(result.path)
                result.record(run.new_inputs(row))
                writer.write(row)
    elif is_readable():
        print_table(list(run.rows()), excerpt)
    else:
        columns = table_columns(run.settings.more_columns)
        printer = row_writer(".csv", sys.stdout, columns, excerpt=excerpt)
        for row in run.rows():
            printer.write(row)


def _manifests(output: Path | None, asked: Path | None) -> list[Path]:
    paths = [] if output is None else [output.with_name(output.name + ".manifest.json")]
    return paths if asked is None else [*paths, asked]


def _write_manifest(
    path: Path, asked: dict[str, Any], run: Run, told: Told, settings_file: SettingsFile
) -> None:
    from scanfab.base.files import whole_file
    from scanfab.pipeline.manifest import manifest

    # what was told of the rows that an earlier run has finished
    before = run.table.warnings if run.table is not None else []
    texts = [*dict.fromkeys([*before, *told.texts])]
    found = manifest(asked, run.series, texts, told.notes, run.inputs)
    found.update(settings_file.asked())
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # names of files need be no text; what replaces their letters is how JSON spells them
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
