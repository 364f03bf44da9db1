"""A file that one run writes to: others that ask for it meanwhile are told so."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from scanfab.base.errors import ScanfabError
from scanfab.base.files import named_errors

# Windows lets nobody read a locked byte, so the lock is on one that no table is long enough to have
FAR = 1 << 40


@contextmanager
def locked(path: Path) -> Iterator[IO[bytes]]:
    """
    Keep other runs away from a file, which is made if it is not there.

    The system drops the lock with the process, however it ends. A file system that has no locks
    keeps nobody away.

    Yields
    ------
    file object
        Closed, it holds no lock any more.

    Raises
    ------
    ScanfabError
        If another run writes to the file.
    """
    while True:
        with named_errors(path):
            stream = open(path, "ab")  # noqa: SIM115
        with stream:
            _lock(stream, path)
            # the run that had the lock may have ended meanwhile, and renamed the file
            if path.exists() and os.path.samestat(os.fstat(stream.fileno()), os.stat(path)):
                yield stream
                return


def _lock(stream: IO[bytes], path: Path) -> None:
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(stream.fileno(), FAR, os.SEEK_SET)
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        raise ScanfabError(
            f"{path}: another run is writing to it: wait until that one has ended, or name "
            f"another `output=FILE`"
        ) from None
    except OSError:  # a file system without locks
        return
