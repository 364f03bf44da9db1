"""The scanfab command: finds its subcommands when they are used, and turns errors into messages."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from difflib import get_close_matches
from importlib import import_module
from io import UnsupportedOperation
from types import FrameType

import click

__all__ = ["cli", "main", "tell_when_ended"]

# one module a command, imported only when the command runs: --help stays fast
COMMANDS = {
    "compute": "the fabric table: one row per frame and variant",
    "compare": "variants side by side, normalised curves, correlation with contact fabric",
    "inspect": "what the reader sees, nothing computed",
    "calibrate": "how many lines are enough: ladders of settings, and those it recommends",
    "report": "one file to hand on: settings, tables, figures, a view that can be turned",
    "view": "a frame in 3D",
    "formats": "every reader and writer, its extensions, and the package it comes from",
}


ENDED: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
# what modules, where they were imported, have to remove before a process ends
LEFTOVERS = {
    "scanfab.readers.files": "remove_copies",
    "scanfab.kernels.cache": "remove_unkept",
}


# how far the command under way is, said where it is interrupted
_standing: Callable[[], str] | None = None


def tell_when_ended(standing: Callable[[], str] | None) -> None:
    """What to add to the word that the process was interrupted."""
    global _standing
    _standing = standing


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
        command = getattr(import_module(f"scanfab.cli.{cmd_name}"), cmd_name)
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _print_version(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"scanfab {version('scanfab')}")
        ctx.exit()


@click.group(cls=LazyGroup)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_print_version,
    help="Show the version and exit.",
)
@click.option("--debug", is_flag=True, expose_value=False, help="Show a traceback with an error.")
def cli() -> None:
    """The void fabric of granular packings by scan lines, from DEM particle dumps."""


class Terminated(BaseException):
    """The process was told to end (SIGTERM)."""


def main(args: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 failed, 2 wrong usage, 130 and 143 interrupted."""

    signal.signal(signal.SIGTERM, _end)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    _replace_closed_streams()
    code = run(sys.argv[1:] if args is None else args)
    # the result stands: a signal would only spoil the exit code
    for late in ENDED:
        signal.signal(late, signal.SIG_IGN)
    if code:
        _leave_at_once(code)
    sys.exit(code)


def _end(number: int, frame: FrameType | None) -> None:
    """End on a signal: by an exception, or at once where modules are being imported."""
    if not _imports(frame):
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt
    # extension modules take an exception for a failed import, and some of VTK's crash
    _leave_at_once(_report_end(number))


def _imports(frame: FrameType | None) -> bool:
    """Whether what the frame does is done for an import."""
    while frame is not None and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


def _report_end(number: int) -> int:
    """Say that a signal ended the process; the exit code for that."""
    click.echo(f"scanfab: {ENDED[number]}{_standing() if _standing else ''}", err=True)
    return 128 + number


def _replace_closed_streams() -> None:
    """Where the shell closed a standard stream: nothing to read, and an error to write to."""
    # they stay open as long as the process
    if sys.stdin is None:
        sys.stdin = open(os.devnull)  # noqa: SIM115
    if sys.stdout is None:
        sys.stdout = open(os.devnull)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115


def _leave_at_once(code: int) -> None:
    """Exit without waiting for the frames that other threads are computing."""
    for module, function in LEFTOVERS.items():
        if hasattr(sys.modules.get(module), function):
            getattr(sys.modules[module], function)()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # a full disk, a closed pipe: told already
            stream.flush()
    os._exit(code)


def run(args: list[str]) -> int:
    """The command line's exit code; errors become one message on standard error."""
    from scanfab.errors import ScanfabError

    tell_when_ended(None)
    # wherever it stands: the group knows it only for its help
    debug = "--debug" in args
    args = [word for word in args if word != "--debug"]
    try:
        code = cli.main(args, prog_name="scanfab", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (KeyboardInterrupt, click.Abort):
        return _report_end(signal.SIGINT)
    except Terminated:
        return _report_end(signal.SIGTERM)
    except (ScanfabError, OSError, MemoryError) as error:
        if debug:
            raise
        click.echo(f"scanfab: error: {_describe(error)}", err=True)
        return 1


def _describe(error: BaseException) -> str:
    if isinstance(error, UnsupportedOperation):
        return "standard output is closed: name a file with -o"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {os.strerror(error.errno or 0)}"
    return str(error) or type(error).__name__
