"""Pipes, devices and sockets, which are no files: whoever opens one may wait for ever."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from scanfab.base.errors import ReadError

KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
# pipes that a shell or another program has opened for this process
INHERITED = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")


def check_file(path: Path) -> None:
    """ReadError if a path that exists is no file."""
    kind = kind_of(path)
    if kind is not None:
        raise ReadError(
            f"{path}: is {kind}, expected a file: what a program writes is read from standard "
            f"input, by - in place of its name and `format=NAME`"
        )


def check_file_or_pipe(path: Path) -> None:
    """ReadError if a path is neither a file nor a pipe that a shell made: ``<(command)``."""
    kind = kind_of(path)
    ready = kind in ("a pipe", "a socket") and os.fspath(path).startswith(INHERITED)
    if kind is not None and not ready:
        raise ReadError(
            f"{path}: is {kind}, expected a table: what a program writes is read from standard "
            f"input, as - in place of its name"
        )


def kind_of(path: Path) -> str | None:
    """What a path is that is neither a file nor a folder; None if it is one, or nothing."""
    try:
        return KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except OSError:
        return None  # whoever opens it says why
