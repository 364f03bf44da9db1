"""
The process of the scanfab command: turns errors into messages, and signals into exit codes.

Next to nothing is imported before main() runs: until then, Ctrl-C shows a traceback.
"""

from __future__ import annotations

import signal
import sys

# bytes of addresses: with fewer left, whatever fails does so for them
LITTLE = 200_000_000
# bars of a curve become those that a keyboard has
PLAIN_LETTERS = dict(zip("▁▂▃▄▅▆▇█", "_.-:=+*#", strict=True)) | {
    "α": "a",
    "ℓ": "l",
    "±": "+-",
    "²": "^2",
    "·": ".",
    "…": "~",
    "→": "->",
    "≥": ">=",
}


def main(args: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 failed, 2 wrong usage, 130 and 143 interrupted."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        # without a word until we can say one
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from scanfab.cli.signals import catch_signals, flush_streams, ignore_signals, leave_at_once

    catch_signals()
    _replace_closed_streams()
    _replace_foreign_letters()
    code = run(sys.argv[1:] if args is None else args)
    ignore_signals()
    if code:
        flush_streams()
        leave_at_once(code)
    sys.exit(code)


def _replace_closed_streams() -> None:
    """Where the shell closed a standard stream: nothing to read, and an error to write to."""
    import os

    # they stay open as long as the process
    if sys.stdin is None:
        sys.stdin = open(os.devnull)  # noqa: SIM115
    if sys.stdout is None:
        sys.stdout = open(os.devnull)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115


def _replace_foreign_letters() -> None:
    """Where a terminal knows no Greek, and for file names that are no text: what it can show."""
    import codecs

    codecs.register_error("scanfab", _shown)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="scanfab")


def _shown(error: UnicodeError) -> tuple[str, int]:
    """An error handler of codecs: other letters for those that cannot be encoded."""
    assert isinstance(error, UnicodeEncodeError)
    letters = error.object[error.start : error.end]
    known = "".join(PLAIN_LETTERS.get(letter, letter) for letter in letters)
    return known.encode("ascii", "backslashreplace").decode(), error.end


def run(args: list[str]) -> int:
    """The command line's exit code; errors become one message on standard error."""
    import click

    from scanfab.base.errors import DimensionError, ScanfabError
    from scanfab.cli.group import cli
    from scanfab.cli.signals import interrupted_words

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
        click.echo(interrupted_words(signal.SIGINT), err=True)
        return 128 + signal.SIGINT
    except Exception as error:
        if debug or not (isinstance(error, ScanfabError | OSError) or _lacks_memory(error)):
            raise
        click.echo(f"scanfab: error: {_describe(error)}", err=True)
        return 2 if isinstance(error, DimensionError) else 1


def _lacks_memory(error: Exception) -> bool:
    """Whether there is no memory: libraries that cannot load their parts raise all kinds."""
    from scanfab.base.files import address_space

    space = address_space()
    told = any(words in str(error) for words in ("failed to map", "can't start new thread"))
    return isinstance(error, MemoryError) or told or (space is not None and space < LITTLE)


def _describe(error: Exception) -> str:
    import os
    from io import UnsupportedOperation

    from scanfab.base.errors import ScanfabError

    if isinstance(error, UnsupportedOperation):
        return "standard output is closed: name a file with -o"
    if not isinstance(error, ScanfabError | OSError) and _lacks_memory(error):
        return (
            f"not enough memory ({str(error) or type(error).__name__}): fewer --workers need less, "
            f"and ulimit -v shows the limit"
        )
    if isinstance(error, OSError) and error.errno and error.strerror == os.strerror(error.errno):
        # whatever writes to files names them
        return f"{error.filename or 'standard output'}: {error.strerror}"
    from scanfab.pipeline.options import as_options

    return as_options(error) or type(error).__name__
