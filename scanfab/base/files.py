"""Files that are written whole or not at all, and the folder of scanfab in the user's cache."""

from __future__ import annotations

import os
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from scanfab.base.ending import undone_at_end
from scanfab.base.errors import SettingsError


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
        with named_errors(path):
            yield path
        return
    # some libraries tell the format by the suffix, so it stays at the end; the random part keeps
    # processes that write the same file apart
    part = path.with_name(f"{path.stem[:60]}.{secrets.token_hex(4)}.part{path.suffix}")
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


def _is_stream(path: Path) -> bool:
    return path.exists() and not path.is_file() and not path.is_dir()


def user_folder() -> Path | None:
    """scanfab's folder in the user's cache; None if there is no home."""
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "scanfab"


def make_private(folder: Path) -> None:
    """Make a folder, and those above it, for the user alone."""
    if not folder.is_dir():
        make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)
