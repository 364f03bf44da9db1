"""scanfab merge: the parts of job arrays as one table."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.cli.console import Command, is_readable, print_csv, print_table
from scanfab.cli.options import options, usage_errors
from scanfab.io.options import parse_frames


@click.command(cls=Command)
@click.argument(
    "parts", metavar="PART...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@options("output")
@options("frames", help="Which frames the table is to have, as a Python slice (default: all).")
def merge(parts: tuple[Path, ...], output: Path | None, frames: str | None) -> int:
    """
    Merge the parts of job arrays into one table: the bytes of one run.

    PART is what scanfab compute -o PART --frames I::N has written, with its PART.manifest.json.
    Parts of several series, or whole tables, become one table of all of them.

    \b
    Job I of 8:  scanfab compute dumps/ --frames I::8 -o part_I.csv
    Then:        scanfab merge part_*.csv -o fabric.csv
    """
    from scanfab.pipeline.merge import check_no_part, merged

    with usage_errors():
        chosen = parse_frames(frames)
        if output is not None:
            check_no_part(output, parts)
    found = merged(parts, chosen)
    if output is not None:
        found.save(output)
    elif is_readable():
        print_table(found.rows, found.excerpt)
    else:
        print_csv(found.rows, found.excerpt, found.columns)
    # a choice of columns may say nothing of the void fabric
    if not found.rows or "alpha_vs" not in [one.name for one in found.columns]:
        return 0
    return 0 if any(row.get("alpha_vs") is not None for row in found.rows) else 1
