"""The command and its subcommands, which are found when they are used."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module

import click

# one module a command, imported only when the command runs: --help stays fast
COMMANDS = {
    "compute": "the fabric table: one row per frame and variant",
    "merge": "the parts of job arrays as one table",
    "compare": "variants side by side, normalised curves, correlation with contact fabric",
    "inspect": "what the reader sees, nothing computed",
    "calibrate": "how many lines are enough: ladders of settings, and those it recommends",
    "report": "one file to hand on: settings, tables, figures, a view that can be turned",
    "view": "a frame in 3D",
    "map": "fabric by place: a grid, slices or shells of blocks",
    "convert": "one frame or a series in another format, with contacts, cell and forces",
    "formats": "every reader and writer, its extensions, and the package it comes from",
}


# bytes of addresses: to compile the scan with four workers takes 1.4e9
LEAST_SPACE = 1_500_000_000


class LazyGroup(click.Group):
    """A group that knows its commands by name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            if ctx.resilient_parsing:
                return None
            near = get_close_matches(cmd_name, COMMANDS, n=1)
            hint = f"Did you mean {near[0]!r}?" if near else f"Choose from {', '.join(COMMANDS)}."
            raise click.UsageError(f"No such command {cmd_name!r}. {hint}", ctx)
        command: click.Command = getattr(import_module(f"scanfab.cli.{cmd_name}"), cmd_name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=LazyGroup)
@click.version_option(package_name="scanfab", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, expose_value=False, help="Show a traceback with an error.")
def cli() -> None:
    """The void fabric of granular packings by scan lines, from DEM particle dumps."""
    from scanfab.base.errors import ScanfabError
    from scanfab.base.files import address_space

    space = address_space()
    # with less, some libraries end the process, or wait for ever, where they are loaded
    if space is not None and space < LEAST_SPACE:
        raise ScanfabError(
            f"not enough memory: the limit (ulimit -v) leaves {space / 1e6:.0f} MB, "
            f"{LEAST_SPACE / 1e6:.0f} MB are needed at least"
        )
