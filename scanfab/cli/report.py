"""scanfab report: one HTML file to share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

import scanfab
from scanfab.cli.console import Command, announce, working
from scanfab.cli.options import OF_SEVERAL, options, tables_argument, usage_errors


@click.command(cls=Command)
@tables_argument(path_type=Path)
@options("output", callback=None, required=True, metavar="FILE.html", help="The report.")
@click.option("--title", metavar="TEXT", help="Title (default: the sources' names).")
@click.option("--author", metavar="TEXT", default="", help="Author (default: none).")
@options("cutoff", **OF_SEVERAL)
@options("labels")
def report(tables: tuple[Path, ...], output: Path, **chosen: Any) -> int:
    """
    Write a report on fabric tables: one HTML file that opens without a network.

    TABLE is a table that scanfab compute -o wrote. Settings, versions and the source of the 3D view
    come from TABLE.manifest.json beside it; without this file the report says they are unknown.
    """
    from scanfab.base.files import refuse_inputs
    from scanfab.table.selection import check_labels
    from scanfab.viz.report.page import check_page_file

    with usage_errors():
        check_labels(chosen["labels"], len(tables))
        check_page_file(output)
        refuse_inputs([output], tables)
    announce()
    with working():
        made = scanfab.report(tables, **chosen)
    made.save(output)
    if not made.has_void_fabric:
        click.echo("scanfab: warning: no row of the tables has a void fabric", err=True)
    return 0 if made.has_void_fabric else 1
