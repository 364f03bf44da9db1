"""
Files: what kind a path is, files that are written completely or not at all, and locks.

The memory that the process can still get is here too, as it decides whether a file can be read.
"""

from __future__ import annotations

import os
import re
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO

from scanfab.base.ending import undone_at_end
from scanfab.base.errors import ReadError, ScanfabError, SettingsError

# reading from a pipe, a device or a socket may wait for ever
KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
KINDS |= {stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
# pipes that a shell or another program has opened for this process
INHERITED = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")
# Windows lets nobody read a locked byte, so the lock is on one that no table is long enough to have
FAR = 1 << 40
# the limit of the container
CONTAINER = Path("/sys/fs/cgroup/memory.max")


def kind_of(path: Path) -> str | None:
    """The kind of a pipe, socket or device; None for a file, a folder and a path to nothing."""
    try:
        return KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except OSError:
        return None  # opening the path fails with a reason


def check_file(path: Path, expected: str = "a file", instead: str = "") -> None:
    """ReadError if a path is a pipe or a device; a table may be a shell's ``<(command)``."""
    kind = kind_of(path)
    passed_on = kind in ("a pipe", "a socket") and os.fspath(path).startswith(INHERITED)
    if kind is not None and not (passed_on and expected == "a table"):
        instead = instead or "by - in place of its name and `format=NAME`"
        raise ReadError(
            f"{path}: is {kind}, expected {expected}: what a program writes is read from "
            f"standard input, {instead}"
        )


def check_folder(path: Path) -> None:
    """SettingsError if the folder of a file does not exist or cannot be written to."""
    if kind_of(path) is not None:
        return
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: there is no folder {path.parent} to write to")
    if not os.access(path.parent, os.W_OK):
        raise SettingsError(f"{path}: the folder {path.parent} cannot be written to")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    A temporary file beside the wanted one; it takes its place when the block ends without error.

    A pipe or a device is written to directly.
    """
    if kind_of(path) is not None:
        with named_errors(path):
            yield path
        return
    # Libraries know the format by the suffix, so it stays at the end. The random part keeps apart
    # processes that write the same file.
    part = path.with_name(f"{path.stem[:60]}.{os.urandom(4).hex()}.part{path.suffix}")
    remove = partial(part.unlink, missing_ok=True)
    with named_errors(path, part), undone_at_end(remove):
        try:
            yield part
            os.replace(part, path)
        finally:
            remove()


@contextmanager
def named_errors(name: Path | str, part: Path | None = None) -> Iterator[None]:
    """Errors of the system name this file if they name none or only its unfinished part."""
    try:
        yield
    except OSError as error:
        if error.filename in (None, part, str(part)):
            error.filename = os.fspath(name)
        raise


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """
    Open a file, which is created if it does not exist, and lock it until it is closed.

    The system releases the lock when the process ends, however it ends. On a file system without
    locks nothing is locked. If another run holds the lock, a ScanfabError says so.
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
            # the run that held the lock may just have ended and renamed the file
            is_free = path.exists() and os.path.samestat(os.fstat(stream.fileno()), path.stat())
        except OSError as error:
            is_free = not isinstance(error, BlockingIOError | PermissionError)
        if not is_free:
            raise ScanfabError(
                f"{path}: another run is writing to it: wait until that one has ended, or name "
                f"another `output=FILE`"
            )
        yield stream


def free_memory() -> int:
    """Bytes that this process can still get: the least of machine, container and own limit."""
    found = [sys.maxsize if (own := address_space()) is None else own]
    with suppress(OSError):
        text = Path("/proc/meminfo").read_text("ascii")
        found += [int(kB) << 10 for kB in re.findall(r"MemAvailable:\s*(\d+) kB", text)]
    # without a container there is no such file, and without a limit it says "max"
    with suppress(OSError, ValueError):
        found.append(int(CONTAINER.read_text("ascii")))
    return max(min(found), 0)


def address_space() -> int | None:
    """Bytes that ``ulimit -v`` leaves to this process; None without this limit."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    except (ImportError, OSError):
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()
