"""Write docs/command-line.md from the code: the help of every command, and the columns."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.base.column import Column, columns_of_fields
from scanfab.cli.group import COMMANDS, cli
from scanfab.pipeline.calibration import StepRow
from scanfab.pipeline.inspection import FrameReport
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS, map_columns
from scanfab.table.compare import DIFFERENCES, FRAMES, SUMMARY

PAGE = Path(__file__).parent / "command-line.md"

INTRODUCTION = """\
# The command line

This page is written by `python docs/make_command_line.py` from the code.

A source is a folder with one series of dumps, or the files of one series. Results go to standard
output, everything else to standard error. Exit codes: 0 done; 1 a failure, or no row has a void
fabric; 2 wrong usage; 130 interrupted. With `-o FILE` the rows go to `FILE.part`, which becomes
`FILE` at the end: `FILE` is complete or untouched.

`--resume` goes on with the `FILE.part` of an interrupted run. With a complete `FILE` it takes its
rows and computes only what is missing: frames that were written later, other `--frames`, frames
that were skipped. The result has the bytes of one run over all of them. That needs
`FILE.manifest.json`, the same settings (but `--workers` and `--frames`) and the same inputs.
Without `--resume` a run starts afresh, and a `FILE.part` that holds rows is kept under another
name. From Python it is `scanfab.compute_file("dumps/", "fabric.csv", resume=True)`, with the same
files.

A file `scanfab.toml` beside the dumps holds options of `scanfab compute` in its section
`[compute]`, as `boundary = "mask=3"`. Every command takes those that it has and that its line
does not name, and says which.

Shells complete commands, options and choices: `eval "$(_SCANFAB_COMPLETE=bash_source scanfab)"`
in `~/.bashrc` (`zsh_source`, `fish_source` for others).

Lengths are in the dump's own units; nothing is converted. `rmin`, `rmean` and `rmax` are the
smallest, mean and largest radius of the grains, without the boundary, in the first frame of the
series that has grains.
"""

TABLES = {
    "scanfab compute": OWN_COLUMNS,
    "scanfab compute, where the options ask for more than the default": MORE_COLUMNS,
    "scanfab map": map_columns(("edge",), shells=True),
    "scanfab compare": FRAMES,
    "scanfab compare --summary": SUMMARY,
    "scanfab compare --differences": DIFFERENCES,
    "scanfab calibrate": columns_of_fields(StepRow),
    "scanfab inspect --json": columns_of_fields(FrameReport),
}


def help_of(name: str) -> str:
    """The help of one command, as a terminal of 100 columns shows it."""
    parent = click.Context(cli, info_name="scanfab")
    command = cli.get_command(parent, name)
    assert command is not None
    context = click.Context(
        command, info_name=name, parent=parent, terminal_width=100, max_content_width=100
    )
    return command.get_help(context)


def page() -> str:
    """The whole page."""
    helps = [f"## scanfab {name}\n\n```text\n{help_of(name)}\n```\n" for name in COMMANDS]
    columns = "## Columns\n\nA value that does not exist is an empty cell, in JSON null. "
    columns += "The unit `length` is that of the dump's lengths, `time` that of its times, "
    columns += "`stress` that of its forces over lengths squared.\n"
    tables = [table(command, columns) for command, columns in TABLES.items()]
    return "\n".join([INTRODUCTION, *helps, columns, *tables])


def table(command: str, columns: tuple[Column, ...]) -> str:
    """What the columns of a command's table hold."""
    rows = "\n".join(f"| `{one.name}` | {one.unit} | {one.meaning} |" for one in columns)
    return f"### {command}\n\n| column | unit | what it holds |\n|---|---|---|\n{rows}\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
