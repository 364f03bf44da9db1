"""scanfab inspect: what the reader finds in each frame, without computing the fabric."""

from __future__ import annotations

import json
from typing import Any

import click

import scanfab
from scanfab.cli.console import announce, print_rows, spelt, working
from scanfab.cli.options import SourceCommand, checked, open_series, options
from scanfab.pipeline.options import as_options

# shown to people, but not in the lines of JSON, whose names are fixed
IN_RV = "grains_in_rv"


@click.command(cls=SourceCommand)
@options("READING", "frames", "SAMPLE", "WINDOW")
@click.option("--json", "as_json", is_flag=True, help="Print each frame as a line of JSON.")
def inspect(sources: tuple[str, ...], as_json: bool, **chosen: Any) -> int:
    """
    Show what the reader finds in each frame: grains, radii, contacts, rattlers, cell, columns,
    extents, and where the RV would be.

    No fabric is computed. Contacts are found by geometry if no file lists them.
    """
    reading, settings = checked(chosen, scanfab.Settings)
    all_series = open_series(sources, reading)
    announce(all_series, settings.workers)

    def frames() -> int:
        return sum(len(range(series.frames_expected())[settings.frames]) for series in all_series)

    with working(frames, prints=True) as advance:
        for series in all_series:
            reports = []
            for found in scanfab.inspect(series, **vars(settings)):
                report = dict(found)
                report["warnings"] = [as_options(text) for text in found.warnings]
                if as_json:
                    kept = {name: report[name] for name in report if name != IN_RV}
                    click.echo(json.dumps(kept, ensure_ascii=False))
                reports.append(report)
                advance()
            if not as_json:
                _print(reports)
    return 0


def _print(reports: list[dict[str, Any]]) -> None:
    """Print what is the same in all frames of a series once, and then a row for each frame."""
    first, *others = reports
    same = {name for name in first if all(other[name] == first[name] for other in others)}
    click.echo(click.style(first["source"], bold=True))
    shown = ["frame", *(name for name in first if name not in {*same, "frame", "warnings"})]
    wide = [name for name in shown if any(isinstance(one[name], list) for one in reports)]
    for name in first:
        if name in same - {"source", "warnings", "frame"} or (name == "frame" and not others):
            click.echo(f"  {name:<13} {spelt(first[name], 6)}")
    if wide and others:
        click.echo(f"  {', '.join(wide)}: differ from frame to frame (--json shows them)")
    if others:
        narrow = [name for name in shown if name not in wide]
        print_rows(reports, narrow, len(narrow), 6)
    told: dict[str, list[int]] = {}
    for report in reports:
        for text in report["warnings"]:
            told.setdefault(text, []).append(report["frame"])
    for text, frames in told.items():
        ends = f"{frames[0]}" if len(frames) == 1 else f"{frames[0]} to {frames[-1]}"
        where = f" (frame {ends})" if others else ""
        click.echo(f"  warning{where}: {text}")
