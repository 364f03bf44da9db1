"""scanfab calibrate: how many lines are enough."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import Any

import click

import scanfab
from scanfab.cli.console import (
    announce,
    digits_of,
    draw,
    is_readable,
    print_csv,
    print_rows,
    working,
)
from scanfab.cli.options import (
    SourceCommand,
    checked,
    excerpt_of,
    open_one,
    options,
    take_output,
    usage_errors,
)
from scanfab.pipeline.options import as_options

# the quantity that each ladder changes, as the title of its first column
CHANGED = {
    "spacing": "spacing / rmin",
    "directions": "directions",
    "cutoff": "cut-off / rmin",
    "rv": "RV / half extent",
    "recommended": "recommended",
}
# further columns on a terminal; a narrow terminal drops the last ones, but never the first STAY
SHOWN = (
    "variant", "alpha_vs_axial", "alpha_vs_axial_se", "alpha_vs_axial_sample_se", "steady",
    "seconds", "rule", "segments", "rule_bias", "note",
)  # fmt: skip
STAY = 6
# whether a step is steady; None where this has no meaning
WORDS = {1: "yes", 0: "no"}


@click.command(cls=SourceCommand)
@options("READING", "SAMPLE")
@options("frame", default=-1, help="Which frame, as in the fabric table (default: last).")
@options("variants", default="cd")
@options("WINDOW", "edge", "cutoff")
@options("spacing", help="Spacing of the lines in the ladder of directions (default: 0.25rmin).")
@options("directions", help="Directions in the ladder of spacings (default: icosahedral:9).")
@options(
    "tolerance",
    help="Standard error of the scan in the ladders of cut-offs and RVs; the recommended settings "
    "never ask for a smaller one.",
)
@options("max_chords", help="Leave out steps that would cut more chords from grains than this.")
@options("axis", "strain", "seed", "workers", "output", "EXCERPT", "plot")
def calibrate(sources: tuple[str, ...], frame: int, **chosen: Any) -> int:
    """
    Show how the void fabric of one frame changes with spacing, directions, cut-off and RV.

    Each step is a row with the error of the scan, the error of the sample, and the time it took.
    scanfab then names the steps from which on the result no longer changes, and recommends settings
    as a command line. The spacings go down to r_min/10, the value of the 2017 paper. --cutoff and
    --rv set the cut-off and the RV of the ladders that change something else.

    On a terminal the steps are a readable table. Otherwise they are CSV on standard output, and
    the findings go to standard error.
    """
    from scanfab.base.files import refuse_inputs
    from scanfab.pipeline.calibration import STEP_COLUMNS
    from scanfab.pipeline.record import asked_for, repeat_command
    from scanfab.table.writing import write_rows

    outputs = take_output(chosen)
    reading, settings = checked(chosen, scanfab.Settings)
    excerpt = excerpt_of(outputs, STEP_COLUMNS)
    series = open_one(sources, reading, "calibrated")
    with usage_errors():
        refuse_inputs([outputs.output, outputs.plot], series.files())
    announce([series], settings.workers)
    with working():
        result = scanfab.calibrate(series, frame=frame, **vars(settings))
    rows = [scanfab.Row(**{**row, "note": as_options(row.note)}) for row in result.rows]
    usual = scanfab.Settings()
    best: Any = {"max_chords": usual.max_chords, "tolerance": usual.tolerance, **result.options}
    command = repeat_command(asked_for(sources, series.options, replace(settings, **best)))
    if outputs.output is not None:
        write_rows(outputs.output, rows, STEP_COLUMNS, excerpt)
    draw(outputs, rows, "calibration")
    tells_all = outputs.output is not None or is_readable()
    if not tells_all:
        print_csv(rows, excerpt, STEP_COLUMNS)
    elif outputs.output is None and excerpt.fields:
        print_rows(rows, excerpt.fields, len(excerpt.fields), digits_of(excerpt))
    elif outputs.output is None:
        for ladder, steps in groupby(rows, key=lambda row: row.ladder):
            title = CHANGED[ladder]
            shown = [{**row, title: row.value, "steady": WORDS.get(row.steady)} for row in steps]
            print_rows(shown, (title, *SHOWN), STAY, digits_of(excerpt))
            click.echo()
    # if CSV goes to standard output, the findings must not mix with it
    for sentence in (*result.findings, command):
        click.echo(sentence, err=not tells_all)
    return 0
