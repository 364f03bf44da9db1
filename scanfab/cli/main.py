"""
The process of the scanfab command: turns errors into messages, and signals into exit codes.

Imports stay inside the functions, because Ctrl-C shows a traceback until main() runs.
"""

from __future__ import annotations

import gc
import signal
import sys

# New objects before Python looks for garbage; the default is far lower. What is imported stays, so
# looking is in vain, and takes a twentieth of a short run; large arrays are freed without it.
FEW_OBJECTS = 50_000
# bytes of address space: if fewer are left, any unknown error is put down to lack of memory
LITTLE = 200_000_000


def main(args: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 failed, 2 wrong usage, 130 and 143 interrupted."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # until our handler is in place, Ctrl-C ends the process silently
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.set_threshold(FEW_OBJECTS)
    from scanfab.cli.signals import catch_signals, leave

    catch_signals()
    _prepare_streams()
    leave(run(sys.argv[1:] if args is None else args))


def _prepare_streams() -> None:
    """Replace streams that the shell closed; escape letters that a terminal lacks."""
    import os

    for name, mode in (("stdin", "r"), ("stdout", "r"), ("stderr", "w")):
        if getattr(sys, name) is None:
            # stays open; reading gives nothing, and writing to stdout (mode "r") raises an error
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            # Greek letters, and file names that are not valid text
            stream.reconfigure(errors="backslashreplace")


def run(args: list[str]) -> int:
    """Run a command and return its exit code; an error becomes one message on standard error."""
    import click

    from scanfab.base.errors import DimensionError, NoReferenceError
    from scanfab.cli.group import cli
    from scanfab.cli.signals import interrupted_words, tell_if_ended

    tell_if_ended()
    # --debug may stand anywhere; click knows the option only to list it in the help
    debug = "--debug" in args
    args = [word for word in args if word != "--debug"]
    try:
        code = cli.main(args, prog_name="scanfab", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (KeyboardInterrupt, click.Abort):
        click.echo(interrupted_words(signal.SIGINT), err=True)
        return 128 + signal.SIGINT
    except Exception as error:
        if debug or (message := _message(error)) is None:
            raise
        click.echo(f"scanfab: error: {message}", err=True)
        return 2 if isinstance(error, DimensionError | NoReferenceError) else 1


def _message(error: Exception) -> str | None:
    """The message for an error; None for an error that only a bug in scanfab can raise."""
    import os
    from io import UnsupportedOperation

    from scanfab.base.errors import ScanfabError
    from scanfab.base.files import address_space
    from scanfab.pipeline.options import as_options

    if isinstance(error, UnsupportedOperation):
        return "standard output is closed: name a file with -o"
    if isinstance(error, OSError) and error.errno and error.strerror == os.strerror(error.errno):
        # an error without a file name comes from standard output: code that writes files names them
        return f"{error.filename or 'standard output'}: {error.strerror}"
    words = as_options(error) or type(error).__name__
    if isinstance(error, ScanfabError | OSError):
        return words
    # short of memory, libraries fail to load their parts and raise errors of any type
    space, signs = address_space(), ("failed to map", "can't start new thread")
    is_full = any(sign in words for sign in signs) or (space is not None and space < LITTLE)
    advice = "fewer --workers need less, and ulimit -v shows the limit"
    is_full |= isinstance(error, MemoryError)
    return f"not enough memory ({words}): {advice}" if is_full else None
