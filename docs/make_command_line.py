"""Write docs/command-line.md from the code: the help of every command, and the columns."""

from __future__ import annotations

from pathlib import Path

import click

from scanfab.cli.group import COMMANDS, cli
from scanfab.pipeline.inspection import REPORT_MEANINGS
from scanfab.pipeline.ladders import STEP_MEANINGS
from scanfab.table.comparison import DIFFERENCE_MEANINGS, FRAME_MEANINGS, SUMMARY_MEANINGS
from scanfab.table.table import MEANINGS

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
name.

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
    "scanfab compute": MEANINGS,
    "scanfab compare": FRAME_MEANINGS,
    "scanfab compare --summary": SUMMARY_MEANINGS,
    "scanfab compare --differences": DIFFERENCE_MEANINGS,
    "scanfab calibrate": STEP_MEANINGS,
    "scanfab inspect --json": REPORT_MEANINGS,
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
    columns = "## Columns\n\nA value that does not exist is an empty cell, in JSON null.\n"
    tables = [table(command, meanings) for command, meanings in TABLES.items()]
    return "\n".join([INTRODUCTION, *helps, columns, *tables])


def table(command: str, meanings: dict[str, str]) -> str:
    """What the columns of a command's table hold."""
    rows = "\n".join(f"| `{name}` | {meaning} |" for name, meaning in meanings.items())
    return f"### {command}\n\n| column | what it holds |\n|---|---|\n{rows}\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
