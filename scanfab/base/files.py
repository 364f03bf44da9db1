"""
Files: the kind of a path, files that are written completely or not at all, and locks.

The steps that clean up before the process ends, also if a signal ends it, are kept here, and so is
the memory left for the process, of which messages speak.
"""

from __future__ import annotations

import atexit
import os
import stat
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import product
from pathlib import Path
from typing import IO

from scanfab.base.errors import ReadError, ScanfabError, SettingsError

# kinds of paths that are not read as files, because reading them may wait for ever
KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
KINDS |= {stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
# paths of the pipes that a shell or another program has opened for this process
INHERITED = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")
# Windows lets nobody read a locked byte, so a byte far beyond the end of any table is locked.
FAR = 1 << 40

Step = Callable[[], object]
_steps: list[Step] = []


def kind_of(path: Path) -> str | None:
    """The kind of a pipe, socket or device; None for a file, a folder or a missing path."""
    try:
        return KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except OSError:
        return None  # opening the path will raise an error that says why


def check_file(path: Path, is_table: bool = False) -> None:
    """Raise ReadError for a pipe or device; a table may also come from ``<(command)``."""
    kind = kind_of(path)
    passed_on = kind in ("a pipe", "a socket") and os.fspath(path).startswith(INHERITED)
    if kind is not None and not (passed_on and is_table):
        expected, more = ("a table", "") if is_table else ("a file", ", and `format=NAME`")
        raise ReadError(
            f"{path}: is {kind}, expected {expected}: to read what a program writes "
            f"from standard input, give - in place of its name{more}"
        )


def check_folder(path: Path) -> None:
    """Raise SettingsError if a file cannot be written here; pipes and devices can."""
    kind = "a folder" if path.is_dir() else kind_of(path)
    if kind in ("a folder", "a socket"):
        raise SettingsError(f"{path}: is {kind}: name a file to write")
    if kind is not None:
        return
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: there is no folder {path.parent} to write to")
    if not os.access(path.parent, os.W_OK):
        raise SettingsError(f"{path}: the folder {path.parent} cannot be written to")


def refuse_inputs(outputs: Iterable[Path | None], inputs: Iterable[Path]) -> None:
    """Raise SettingsError if a file to write is one that is read, by whatever path or link."""
    written = [path for path in outputs if path is not None and os.path.exists(path)]
    for path, source in product(written, inputs):
        if os.path.exists(source) and os.path.samefile(path, source):
            advice = "name another file to write"
            raise SettingsError(f"{path}: would replace the input {source}: {advice}")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    Give the path of a temporary file, which replaces the file if the block ends without an error.

    A pipe or device is written to directly.
    """
    if kind_of(path) is not None:
        with named_errors(path):
            yield path
        return
    # Libraries tell the format from the suffix, so it stays at the end. The random part gives
    # processes that write the same file different temporary files.
    part = path.with_name(f"{path.stem[:60]}.{os.urandom(4).hex()}.part{path.suffix}")
    remove = partial(part.unlink, missing_ok=True)
    with named_errors(path, part), undone_at_end(remove):
        yield part
        os.replace(part, path)


@contextmanager
def named_errors(name: Path | str, part: Path | None = None) -> Iterator[None]:
    """Put this file's name into system errors that name no file, or only the temporary file."""
    try:
        yield
    except OSError as error:
        if error.filename in (None, part, str(part)):
            error.filename = os.fspath(name)
        raise


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """
    Open a file, or create it, and lock it until it is closed.

    The system releases the lock when the process ends in any way. A file system without locks
    leaves the file unlocked. If another run holds the lock, ScanfabError is raised.
    """
    with named_errors(path):
        stream = open(path, "ab")  # noqa: SIM115
    with stream:
        try:
            if sys.platform == "win32":
                import msvcrt

                os.lseek(stream.fileno(), FAR, os.SEEK_SET)
                msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # the run that held the lock may have ended meanwhile and renamed the file
            is_free = path.exists() and os.path.samestat(os.fstat(stream.fileno()), path.stat())
        except OSError as error:
            is_free = not isinstance(error, BlockingIOError | PermissionError)
        if not is_free:
            raise ScanfabError(
                f"{path}: another run is writing to it: wait until that one has ended, or name "
                f"another `output=FILE`"
            )
        yield stream


def address_space() -> int | None:
    """Bytes of address space that ``ulimit -v`` leaves to this process; None if unlimited."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    except (ImportError, OSError):
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()


def at_end(step: Step) -> None:
    """Call a function at the end of the process."""
    if util := sys.modules.get("multiprocessing.util"):
        # a forked worker process ends without calling the functions of atexit
        util.Finalize(None, finish, exitpriority=0)
    _steps.append(step)


@contextmanager
def undone_at_end(step: Step) -> Iterator[None]:
    """Call a function at the end of the block, or of the process if that comes first."""
    _steps.append(step)
    try:
        yield
    finally:
        step()
        _steps.remove(step)


if hasattr(os, "register_at_fork"):
    # the parent process runs its own steps, so a forked child forgets them
    os.register_at_fork(after_in_child=_steps.clear)


@atexit.register
def finish() -> None:
    """Run all remaining steps, the newest first."""
    while _steps:
        with suppress(OSError):
            _steps.pop()()
