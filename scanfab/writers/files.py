"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scanfab.errors import SettingsError

__all__ = ["check_folder", "whole_file"]


def check_folder(path: Path) -> None:
    """SettingsError if there is no folder that a file of this name can be written to."""
    if _is_stream(path):
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
    if _is_stream(path):
        yield path
        return
    # with the suffix at the end: some libraries tell the format by it
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        yield part
        if not part.exists():
            # VTK prints, and goes on
            raise OSError(f"{path}: cannot be written")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _is_stream(path: Path) -> bool:
    return path.exists() and not path.is_file() and not path.is_dir()
