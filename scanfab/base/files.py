"""
Files: what a path is, writing whole or not at all, locks.

The memory that a process can still get is here, too: it says whether a file can be read.
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

# pipes, devices and sockets are no files: whoever opens one may wait for ever
KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
KINDS |= {stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
# pipes that a shell or another program has opened for this process
INHERITED = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")
# Windows lets nobody read a locked byte, so the lock is on one that no table is long enough to have
FAR = 1 << 40
# the limit of the container
CONTAINER = Path("/sys/fs/cgroup/memory.max")


def kind_of(path: Path) -> str | None:
    """What a path is that is neither a file nor a folder; None if it is one, or nothing."""
    try:
        return KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except OSError:
        return None  # whoever opens it says why


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
    """SettingsError if there is no folder that a file of this name can be written to."""
    if kind_of(path) is not None:
        return
    if not path.parent.is_dir():
        raise SettingsError(f"{path}: there is no folder {path.parent} to write to")
    if not os.access(path.parent, os.W_OK):
        raise SettingsError(f"{path}: the folder {path.parent} cannot be written to")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """
    A file beside the wanted one, to be written, that takes its place if all goes well.

    A pipe or a device is written to as it is.
    """
    if kind_of(path) is not None:
        with named_errors(path):
            yield path
        return
    # some libraries tell the format by the suffix, so it stays at the end; the random part keeps
    # processes that write the same file apart
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
    """Let errors of the system name this file where they name none, or its unfinished part."""
    try:
        yield
    except OSError as error:
        if error.filename in (None, part, str(part)):
            error.filename = os.fspath(name)
        raise


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """
    Open a file, which is made if it is not there, and keep other runs away until it is closed.

    The system drops the lock with the process, however it ends. A file system that has no locks
    keeps nobody away. If another run writes to the file, a ScanfabError says so.
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
            # the run that had the lock may have ended just now, and renamed the file
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
    """Bytes that this process can get at most: of the machine, its container, its own limit."""
    found = [sys.maxsize if (own := address_space()) is None else own]
    with suppress(OSError):
        text = Path("/proc/meminfo").read_text("ascii")
        found += [int(kB) << 10 for kB in re.findall(r"MemAvailable:\s*(\d+) kB", text)]
    # not every process is in a container, and one without a limit has the word "max"
    with suppress(OSError, ValueError):
        found.append(int(CONTAINER.read_text("ascii")))
    return max(min(found), 0)


def address_space() -> int | None:
    """What ``ulimit -v`` leaves to this process; None without such a limit."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    except (ImportError, OSError):
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()
