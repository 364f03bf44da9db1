"""scanfab merge: join the parts of a job array into one table."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.cli.console import Command, is_readable, print_csv, print_table
from scanfab.cli.options import options, usage_errors


@click.command(cls=Command)
@click.argument(
    "parts", metavar="PART...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@options("output")
@options("frames", help="Frames that the table must have, as a Python slice (default: all).")
def merge(parts: tuple[Path, ...], output: Path | None, frames: str | None) -> int:
    """
    Join the parts of a job array into one table, with the same bytes as the table of a single run.

    PART is a table that scanfab compute -o PART --frames I::N wrote, with PART.manifest.json beside
    it. Parts of several series, or whole tables, are joined into one table.

    \b
    Job I of 8:  scanfab compute dumps/ --frames I::8 -o part_I.csv
    Then:        scanfab merge part_*.csv -o fabric.csv
    """
    from scanfab.pipeline.merge import merge_tables
    from scanfab.table.writing import ALL

    with usage_errors():
        table = merge_tables(parts, output, frames=frames)
    if output is None and is_readable():
        print_table(table, ALL)
    elif output is None:
        print_csv(table, ALL, table.columns)
    # the user may have chosen columns without the void fabric
    if not len(table) or "alpha_vs" not in table.names:
        return 0
    return 0 if any(row.alpha_vs is not None for row in table) else 1
