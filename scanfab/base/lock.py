"""A file that one run writes to: others that ask for it meanwhile are told so."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from scanfab.base.errors import ScanfabError
from scanfab.base.files import named_errors

# on Windows nobody can read what is locked: a byte that no table is long enough to have
FAR = 1 << 40


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """
    Keep other runs away from a file, which is made if it is not there.

    The system drops the lock with the process, however it ends. Where a file system has no locks,
    nothing is kept away.

    Yields
    ------
    file object
        Closed, it holds no lock any more.

    Raises
    ------
    ScanfabError
        If another run writes to it.
    """
    with named_errors(path):
        stream = _open_locked(path)
    with stream:
        yield stream


def _open_locked(path: Path) -> IO[bytes]:
    while True:
        stream = open(path, "ab")  # noqa: SIM115
        try:
            _lock(stream)
        except (BlockingIOError, PermissionError):
            stream.close()
            raise ScanfabError(
                f"{path}: another run is writing to it: wait until that one has ended, or name "
                f"another `output=FILE`"
            ) from None
        # the run that had it may have ended meanwhile, and given the file its last name
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(stream.fileno()), os.stat(path)):
                return stream
        stream.close()


if sys.platform == "win32":
    import msvcrt

    def _lock(stream: IO[bytes]) -> None:
        os.lseek(stream.fileno(), FAR, os.SEEK_SET)
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(stream: IO[bytes]) -> None:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:  # a file system without locks
            return
