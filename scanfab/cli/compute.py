"""scanfab compute: the fabric table."""

from __future__ import annotations

from typing import Any

import click

from scanfab.cli.options import SourceCommand, options
from scanfab.pipeline.options import OPTIONS


@click.command(cls=SourceCommand)
@options(*OPTIONS)
def compute(sources: tuple[str, ...], **chosen: Any) -> int:
    """
    Compute the fabric table: one row per frame and variant.

    SOURCE is a folder with a series of dumps, files of one series, or - for standard input. A
    source that is given twice is read once.

    \b
    A folder:       scanfab compute dumps/ --boundary type=2 -o fabric.csv
    Several files:  scanfab compute dumps/*.vtk --variants cd --tolerance 1e-3
    A pipe:         zcat dump.gz | scanfab compute - --format liggghts

    Variants: a whole sample; b whole sample without rattlers; c representative volume (RV); d RV
    without rattlers. Lengths are in the dump's own units.
    """
    from scanfab.cli.rows import write_table
    from scanfab.pipeline.settings import Settings

    return write_table(sources, chosen, Settings)
