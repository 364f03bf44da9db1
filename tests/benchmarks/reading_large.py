"""scanfab.read on files of a million grains, against general parsers: seconds with all cores."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

from tests.benchmarks.reading_formats import grains, make_dumps, make_tables, parsers, read
from tests.benchmarks.timing import interleaved, table

FILES = (
    "table, .csv",
    "table, .tsv",
    "table, .txt",
    "table, aligned by blanks",
    "table, without names",
    "YADE `export.text`",
    "LAMMPS text dump",
)


def run(repeats: int, count: int = 1_000_000) -> dict[str, str]:
    """The section ``reading large``."""
    warnings.simplefilter("ignore")
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder, rows = Path(name), grains(count)
        files = {**make_tables(folder, rows), **make_dumps(folder, rows)}
        del rows
        for title in FILES:
            made = files[title]
            ways = {"scanfab": lambda made=made: read(made), **parsers(made)}
            seconds = interleaved(ways, repeats)
            ours = seconds.pop("scanfab")
            theirs, best = min((value, name) for name, value in seconds.items())
            size = made.path.stat().st_size / 1e6
            lines.append((title, f"{size:.0f}", f"{size / ours:.0f}", best, f"{theirs / ours:.2f}"))
    return {"reading large": table(["file", "MB", "MB/s", "best parser", "of its speed"], lines)}
