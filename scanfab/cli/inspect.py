"""scanfab inspect: what the reader sees, nothing computed."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click

import scanfab
from scanfab.cli.console import announce, spelt, working
from scanfab.cli.options import SourceCommand, checked, open_series, options
from scanfab.pipeline.options import as_options

if TYPE_CHECKING:
    from scanfab.pipeline.inspection import FrameReport


@click.command(cls=SourceCommand)
@options("READING", "frames", "SAMPLE", "WINDOW")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line and frame.")
def inspect(sources: tuple[str, ...], as_json: bool, **chosen: Any) -> int:
    """
    Show what the reader sees in each frame: grains, radii, contacts, rattlers, cell, columns,
    extents, and where the RV would be.

    Nothing is computed; contacts are found by geometry where no file lists them.
    """
    from scanfab.pipeline.inspection import inspect_series

    reading, settings = checked(chosen, scanfab.Settings)
    every = open_series(sources, reading)
    announce(every, settings.workers)

    def frames() -> int:
        return sum(len(range(one.frames_expected())[settings.frames]) for one in every)

    with working(frames, prints=True) as advance:
        for found in (one for series in every for one in inspect_series(series, settings)):
            report = replace(found, warnings=[as_options(text) for text in found.warnings])
            if as_json:
                click.echo(json.dumps(asdict(report), ensure_ascii=False))
            else:
                _print(report)
            advance()
    return 0


def _print(report: FrameReport) -> None:
    """A frame as lines of a name and its value."""
    fields = asdict(report)
    title = f"{fields.pop('source')}, frame {fields.pop('frame')}"
    told = fields.pop("warnings")
    click.echo(click.style(title, bold=True))
    for name, value in [*fields.items(), *(("warning", text) for text in told)]:
        click.echo(f"  {name:<13} {spelt(value, 6)}")
