"""scanfab report: one file to hand on."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.cli.options import usage_errors
from scanfab.cli.talk import talk_options, working

__all__ = ["report"]


@click.command()
@click.argument(
    "tables",
    metavar="TABLE...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
)
@click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    metavar="FILE.html",
    help="The report.",
)
@talk_options
def report(tables: tuple[Path, ...], output: Path) -> int:
    """
    Write a report on fabric tables: one HTML file that opens without a network.

    TABLE is what scanfab compute wrote with -o. Settings, versions and the source of the 3D view
    come from TABLE.manifest.json beside it; without it, the report says that they are not known.
    """
    from scanfab.cli.console import announce_compiling, reported_warnings
    from scanfab.report import has_void_fabric, make_report
    from scanfab.writers.page import check_page_file, save_page

    with usage_errors():
        check_page_file(output)
    with reported_warnings():
        announce_compiling()
        with working():
            page = make_report(tables)
        save_page(output, page)
        found = has_void_fabric(tables)
    if not found:
        click.echo("scanfab: warning: no row of the tables has a void fabric", err=True)
    return 0 if found else 1
