"""The scanfab command; it imports a subcommand only when that subcommand runs."""

from __future__ import annotations

from importlib import import_module

import click

from scanfab.base.spelling import meant

# each command is a module of this name, with _ for -, which is imported when the command runs:
# --help stays fast
COMMANDS = {
    "compute": "the fabric table: one row per frame and variant",
    "merge": "join the parts of a job array into one table",
    "compare": "variants side by side, normalised curves, correlation with contact fabric",
    "inspect": "what the reader finds in each frame, without computing the fabric",
    "calibrate": "how many lines are enough: ladders of settings, and recommended settings",
    "report": "one HTML file to share: settings, tables, figures, a 3D view",
    "view": "a frame in 3D",
    "map": "fabric by place: blocks in a grid, slices or shells",
    "convert": "one frame or a series in another format, with contacts, cell and forces",
    "sample-data": "small real series to try the examples on",
    "formats": "every reader and writer, its extensions, and the package it comes from",
}


# bytes of address space: compiling the scan with four workers takes 1.4e9
LEAST_SPACE = 1_500_000_000


class LazyGroup(click.Group):
    """A group that knows its commands by name, and imports each when it is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            if ctx.resilient_parsing:
                return None
            hint = meant(cmd_name, COMMANDS, "command")
            raise click.UsageError(f"there is no command {cmd_name!r}: {hint}", ctx)
        name = cmd_name.replace("-", "_")
        command: click.Command = getattr(import_module(f"scanfab.cli.{name}"), name)
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
    # with less, some libraries end the process or hang while they are loaded
    if space is not None and space < LEAST_SPACE:
        raise ScanfabError(
            f"not enough memory: the limit (ulimit -v) leaves {space / 1e6:.0f} MB, "
            f"but scanfab needs at least {LEAST_SPACE / 1e6:.0f} MB"
        )
