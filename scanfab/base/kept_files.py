"""Files in the user's cache that runs keep for later ones: whole, and written by nobody else."""

from __future__ import annotations

import hashlib
import os
import secrets
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path

from scanfab.base.ending import undone_at_end

CHECKSUM = 32


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


def is_private(status: os.stat_result) -> bool:
    """Whether nobody but the user, or the system itself, can have written to a file or folder."""
    if os.name != "posix":
        return True
    return status.st_uid in (0, os.getuid()) and not status.st_mode & 0o022


def make_private(folder: Path) -> None:
    """Make a folder, and those above it, for the user alone."""
    if not folder.is_dir():
        make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def read_kept(path: Path) -> bytes | None:
    """What a file holds; None if it is not whole, or if others could have written it."""
    try:
        with open(path, "rb") as file:
            if not is_private(os.fstat(file.fileno())):
                return None
            checksum, content = file.read(CHECKSUM), file.read()
    except OSError:
        return None
    return content if hashlib.sha256(content).digest() == checksum else None


def write_kept(path: Path, content: bytes) -> None:
    """Whole or not at all; a full disk is no reason to stop."""
    part = path.with_suffix(f".{secrets.token_hex(4)}")
    remove = partial(part.unlink, missing_ok=True)
    with suppress(OSError), undone_at_end(remove):
        try:
            with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            os.replace(part, path)
        finally:
            remove()
