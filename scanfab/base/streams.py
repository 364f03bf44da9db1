"""Pipes, devices and sockets, which are no files: whoever opens one may wait for ever."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from scanfab.base.errors import ReadError

KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
KINDS |= {stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
# pipes that a shell or another program has opened for this process
INHERITED = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")


def check_file(path: Path) -> None:
    """ReadError if a path that exists is no file."""
    _refuse(path, kind_of(path), "a file", "by - in place of its name and `format=NAME`")


def check_file_or_pipe(path: Path) -> None:
    """ReadError if a path is neither a file nor a pipe that a shell made: ``<(command)``."""
    kind = kind_of(path)
    if kind not in ("a pipe", "a socket") or not os.fspath(path).startswith(INHERITED):
        _refuse(path, kind, "a table", "as - in place of its name")


def _refuse(path: Path, kind: str | None, expected: str, instead: str) -> None:
    if kind is not None:
        raise ReadError(
            f"{path}: is {kind}, expected {expected}: what a program writes is read from "
            f"standard input, {instead}"
        )


def kind_of(path: Path) -> str | None:
    """What a path is that is neither a file nor a folder; None if it is one, or nothing."""
    try:
        return KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except OSError:
        return None  # whoever opens it says why
