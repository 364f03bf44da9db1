"""scanfab calibrate: how many lines are enough."""

from __future__ import annotations

import shlex
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from scanfab.cli.options import (
    EXCERPT,
    READING,
    SAMPLE,
    WINDOW,
    GroupedOption,
    SourceType,
    check_plot,
    options,
)
from scanfab.cli.settings_file import fill_from_file
from scanfab.cli.sources import SourceCommand, open_series, reading_arguments
from scanfab.cli.tables import Column, print_columns, spelt
from scanfab.cli.talk import talk_options, tell_inputs, working
from scanfab.pipeline.options import as_options

if TYPE_CHECKING:
    from scanfab.pipeline.calibration import StepRow


# what compute has no use for, or what is recommended instead
OWN = (
    "source", "frame", "output", "plot", "variants", "spacing", "directions", "tolerance",
    "max_chords", "fields", "digits",
)  # fmt: skip
TITLES = {
    "spacing": "spacing / r_min",
    "directions": "directions",
    "cutoff": "cut-off / r_min",
    "rv": "RV / half extent",
    "recommended": "recommended",
}


@click.command(cls=SourceCommand)
@click.argument("source", metavar="SOURCE", type=SourceType())
@options(*READING, *SAMPLE)
@click.option(
    "--frame",
    cls=GroupedOption,
    group="reading",
    default=-1,
    metavar="K",
    help="Which frame, as in the fabric table (default: last).",
)
@options("variants", default="cd")
@options(*WINDOW, "edge", "cutoff")
@options("spacing", help="Of the ladder of directions (default: 0.25rmin).")
@options("directions", help="Of the ladder of spacings (default: icosahedral:9).")
@options(
    "tolerance",
    help="Standard error of the scan for the ladders of cut-offs and RVs, and the least to ask of "
    "the recommended settings.",
)
@options("max_chords", help="Steps that would cut more chords from grains than this are left out.")
@options("axis", "strain", "seed", "workers", "output", *EXCERPT, "plot")
@talk_options
@click.pass_context
def calibrate(
    ctx: click.Context,
    /,
    source: str,
    output: Path | None,
    plot: Path | None,
    frame: int,
    **chosen: Any,
) -> int:
    """
    Show how the void fabric of one frame changes with spacing, directions, cut-off and RV.

    Each step with its error from the scan, the sample's own, and the time; then from where on
    nothing changes any more, and the settings that follow, as a command line. The spacings go down
    to r_min/10, which the 2017 paper takes. --cutoff and --rv are those of the other ladders.

    On a terminal a readable table; else the steps as CSV, and what they show on standard error.
    """
    from scanfab.base.column import columns_of_fields
    from scanfab.cli.console import announce_compiling, is_readable, print_csv, reported_warnings
    from scanfab.pipeline.calibration import StepRow
    from scanfab.pipeline.calibration import calibrate as calibrate_series
    from scanfab.pipeline.settings import Settings
    from scanfab.table.writing import Excerpt, ResultFile
    from scanfab.viz.figures.page import make_figures, save_figures

    check_plot(plot, None)
    columns = columns_of_fields(StepRow)
    with reported_warnings():
        chosen, settings_file = fill_from_file(ctx, (source,), chosen)
        with settings_file.named_errors():
            reading = reading_arguments(chosen)
            excerpt = Excerpt.make(columns, chosen.pop("fields"), int(chosen.pop("digits")))
            settings = Settings(**chosen)
            result = None if output is None else ResultFile(output, columns, excerpt)
        announce_compiling()
        series = open_series((source,), reading)
        if len(series) > 1:
            names = ", ".join(one.name for one in series)
            raise click.UsageError(f"one series can be calibrated at a time, found {names}")
        tell_inputs(series, settings.workers)
        with working():
            found = calibrate_series(series[0], frame=frame, **vars(settings))
        rows = tuple(replace(row, note=as_options(row.note)) for row in found.rows)
        found = replace(found, rows=rows)
        command = _command_line(ctx, source, found.options)
        if result is not None:
            result.save(found.rows)
        if plot is not None:
            save_figures(plot, make_figures(found.rows, "calibration"))
        tells_all = result is not None or is_readable()
        if result is None and tells_all:
            _print(found.rows)
        elif result is None:
            print_csv(found.rows, excerpt, columns)
        # behind rows on standard output, what they show goes beside them
        for sentence in (*found.findings, command):
            click.echo(sentence, err=not tells_all)
    return 0


def _command_line(ctx: click.Context, source: str, recommended: dict[str, str]) -> str:
    """The recommended compute, with what the user said of source and sample."""
    words = ["scanfab", "compute", source]
    for parameter in ctx.command.params:
        name = str(parameter.name)
        given = ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE
        # --quiet and the like are no settings
        if name in OWN or name not in ctx.params or not given:
            continue
        value = ctx.params[name]
        for one in value if parameter.multiple else [value]:
            numbers = name == "cell" and not Path(one).is_file()
            spelt = one.split() if numbers else one if isinstance(one, tuple) else [one]
            words += [parameter.opts[0], *map(str, spelt)]
    words += ["--variants", ctx.params["variants"]]
    for name, value in recommended.items():
        words += [f"--{name}", value]
    return shlex.join(words)


def _print(rows: tuple[StepRow, ...]) -> None:
    """One table for each ladder."""
    for ladder, steps in groupby(rows, key=lambda row: row.ladder):
        print_columns(_columns(ladder, list(steps)))
        click.echo()


def _columns(ladder: str, steps: list[StepRow]) -> list[Column]:
    """What was changed, and what came of it; the rest where there is room."""
    steady = {None: "", 0: "no", 1: "yes"}
    return [
        Column(TITLES[ladder], [f"{row.value:g}" for row in steps]),
        Column("variant", [row.variant for row in steps]),
        Column("rule", [row.rule for row in steps], 2),
        Column(
            "bias", [spelt(row.rule_bias if row.rule_bias > 1e-12 else 0, 2) for row in steps], 4
        ),
        Column("segments", [spelt(row.segments) for row in steps], 3),
        Column("time", [f"{row.seconds:.2g} s" for row in steps], 1),
        Column("α_vs axial", [spelt(row.alpha_vs_axial) for row in steps]),
        Column("± scan", [spelt(row.alpha_vs_axial_se) for row in steps]),
        Column("± sample", [spelt(row.alpha_vs_axial_sample_se) for row in steps]),
        Column("steady", [steady[row.steady] + (" (!)" if row.note else "") for row in steps]),
    ]
