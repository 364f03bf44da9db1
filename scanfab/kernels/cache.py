"""Where compiled kernels are kept: for each user and version of the kernels, or nowhere."""

from __future__ import annotations

import gc
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba.core import event

from scanfab.ending import at_end

__all__ = ["is_kept", "kernel_cache", "when_compiling"]

# bytes that compiled kernels need at most
ROOM = 4 << 20
_unkept: list[str] = []
config: Any = numba.config


@contextmanager
def kernel_cache() -> Iterator[None]:
    """Functions that are declared inside are kept in scanfab's folder; all others are not."""
    before = config.CACHE_DIR
    given = Path(before) if before else None
    usual = _usual_folder()
    if given is not None and _is_writable(given):
        folder = given
    elif usual is not None and _is_private(usual) and _is_writable(usual):
        folder = usual
    else:
        # not a folder that others know: what it holds is run
        folder = Path(tempfile.mkdtemp(prefix="scanfab-kernels-"))
        _unkept.append(str(folder))
        at_end(_remove_unkept)
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before


def is_kept() -> bool:
    """Whether what is compiled outlives the process."""
    return not _unkept


def _remove_unkept() -> None:
    """Delete what cannot be kept, at the end of the process."""
    for folder in _unkept:
        shutil.rmtree(folder, ignore_errors=True)


def when_compiling(tell: Callable[[], None]) -> None:
    """
    Call a function when a kernel is first compiled rather than found; from any thread.

    The garbage collector waits while the compiler works: it would take a sixteenth of the time, and
    find next to nothing.
    """
    event.register("numba:compile", _Compiling(tell))  # type: ignore[no-untyped-call]


class _Compiling(event.Listener):
    def __init__(self, tell: Callable[[], None]) -> None:
        self._tell: Callable[[], None] | None = tell
        # a kernel is compiled within the one that calls it
        self._depth = 0

    def on_start(self, event: event.Event) -> None:
        self._depth += 1
        gc.disable()
        tell, self._tell = self._tell, None
        if tell is not None:
            tell()

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0:
            gc.enable()


def _usual_folder() -> Path | None:
    """The folder of this user and of these kernels; None if there is no home."""
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
    # Numba sees a change of the file that declares a kernel, not of those that it calls
    sources = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        sources.update(file.read_bytes())
    return base / "scanfab" / f"numba-{numba.__version__}-{sources.hexdigest()[:16]}"


def _is_private(folder: Path) -> bool:
    """Make the folder; whether it belongs to the user and no one else can write to it."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError:
        return False
    return os.name != "posix" or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


def _is_writable(folder: Path) -> bool:
    """Whether there is room for the kernels, if they are not there yet."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = any(folder.iterdir())
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"\0" * (1 if held else ROOM))
    except OSError:
        return False
    return True
