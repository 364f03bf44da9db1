"""scanfab calibrate: how many lines are enough."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import click

import scanfab
from scanfab.cli.console import announce, draw, is_readable, print_csv, print_rows, working
from scanfab.cli.options import SourceCommand, checked, excerpt_of, open_one, options, take_output
from scanfab.pipeline.options import as_options

if TYPE_CHECKING:
    from scanfab.pipeline.calibration import StepRow


# what is changed in each ladder
CHANGED = {
    "spacing": "spacing / rmin",
    "directions": "directions",
    "cutoff": "cut-off / rmin",
    "rv": "RV / half extent",
    "recommended": "recommended",
}
# further columns on a terminal, of which the first ones always stay
SHOWN = (
    "variant", "alpha_vs_axial", "alpha_vs_axial_se", "alpha_vs_axial_sample_se", "is_steady",
    "time", "rule", "segments", "rule_bias",
)  # fmt: skip
STAY = 6


@click.command(cls=SourceCommand)
@options("READING", "SAMPLE")
@options("frame", default=-1, help="Which frame, as in the fabric table (default: last).")
@options("variants", default="cd")
@options("WINDOW", "edge", "cutoff")
@options("spacing", help="Of the ladder of directions (default: 0.25rmin).")
@options("directions", help="Of the ladder of spacings (default: icosahedral:9).")
@options(
    "tolerance",
    help="Standard error of the scan for the ladders of cut-offs and RVs, and the least to ask of "
    "the recommended settings.",
)
@options("max_chords", help="Steps that would cut more chords from grains than this are left out.")
@options("axis", "strain", "seed", "workers", "output", "EXCERPT", "plot")
def calibrate(sources: tuple[str, ...], frame: int, **chosen: Any) -> int:
    """
    Show how the void fabric of one frame changes with spacing, directions, cut-off and RV.

    Each step stands with its error from the scan, the sample's own error, and the time; then from
    where on nothing changes any more, and the settings that follow, as a command line. The spacings
    go down to r_min/10, which the 2017 paper takes. --cutoff and --rv are those of the other
    ladders.

    On a terminal a readable table; else the steps as CSV, and what they show on standard error.
    """
    from scanfab.base.column import columns_of_fields
    from scanfab.pipeline.calibration import StepRow
    from scanfab.pipeline.record import asked_for
    from scanfab.pipeline.repeat import repeat_command
    from scanfab.table.writing import write_rows

    asked = take_output(chosen)
    columns = columns_of_fields(StepRow)
    reading, settings = checked(chosen, scanfab.Settings)
    excerpt = excerpt_of(asked, columns)
    series = open_one(sources, reading, "calibrated")
    announce([series], settings.workers)
    with working():
        found = scanfab.calibrate(series, frame=frame, **vars(settings))
    rows = [replace(row, note=as_options(row.note)) for row in found.rows]
    usual = scanfab.Settings()
    best: Any = {"max_chords": usual.max_chords, "tolerance": usual.tolerance, **found.options}
    command = repeat_command(asked_for(sources, reading, replace(settings, **best)))
    if asked.output is not None:
        write_rows(asked.output, rows, columns, excerpt)
    draw(asked, rows, "calibration")
    tells_all = asked.output is not None or is_readable()
    if not tells_all:
        print_csv(rows, excerpt, columns)
    elif asked.output is None:
        _print(rows)
    # behind rows on standard output, what they show goes beside them
    for sentence in (*found.findings, command):
        click.echo(sentence, err=not tells_all)
    return 0


def _print(rows: list[StepRow]) -> None:
    """One table for each ladder."""
    steady = {None: "", 0: "no", 1: "yes"}
    for ladder, steps in groupby(rows, key=lambda row: row.ladder):
        shown = [
            {
                **asdict(row),
                CHANGED[ladder]: row.value,
                "rule_bias": row.rule_bias if row.rule_bias > 1e-12 else 0,
                "time": f"{row.seconds:.2g} s",
                "is_steady": steady[row.steady] + (" (!)" if row.note else ""),
            }
            for row in steps
        ]
        print_rows(shown, (CHANGED[ladder], *SHOWN), STAY)
        click.echo()
