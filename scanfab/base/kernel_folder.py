"""The folder of compiled kernels: for each user and version of them, and only if it is safe."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from functools import cache
from pathlib import Path

import numba

from scanfab.base.kept_files import is_private, make_private, user_folder

# bytes that compiled kernels need at most
ROOM = 16 << 20


class Folder:
    """Where kernels are kept, or why they are not."""

    def __init__(self, path: Path | None, problem: str = "") -> None:
        self.path = path
        self.problem = problem


@cache
def kernel_folder() -> Folder:
    """The folder of this user and of these kernels, which is made if it can be."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(given) if given else user_folder()
    if base is None:
        return Folder(None, "there is no home folder")
    folder = base / _version()
    try:
        make_private(folder)
    except OSError as error:
        return Folder(None, f"{error.filename}: {error.strerror}")
    for one in (base, folder):
        # what it holds is run
        if not is_private(one.stat()):
            return Folder(None, f"{one} is not yours, or others can write to it (chmod go-w)")
    if not _has_room(folder):
        return Folder(None, f"{folder} cannot be written to")
    return Folder(folder)


def kernel_files() -> list[Path]:
    """All files that kernels are made of: those of every room, and how they are compiled."""
    package = Path(__file__).parents[1]
    patterns = (
        "*/kernels.py",
        "*/*/kernels.py",
        "*/kernels/*.py",
        "base/jit.py",
        "base/kernel_*.py",
    )
    return sorted(file for pattern in patterns for file in package.glob(pattern))


def _version() -> str:
    """
    The name of the folder, by Numba and by all kernels together.

    A kernel changes with those that it calls, which no stamp of its own file tells.
    """
    sources = hashlib.sha256(sys.version.encode())
    for file in kernel_files():
        sources.update(file.read_bytes())
    return f"numba-{numba.__version__}-{sources.hexdigest()[:16]}"


def _has_room(folder: Path) -> bool:
    """Whether there is room for the kernels, or they are there already."""
    held = any(folder.iterdir())
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"\0" * (1 if held else ROOM))
    except OSError:
        # a folder of the system that holds them need not be written to
        return held and not os.access(folder, os.W_OK)
    return True
