"""
Compiled kernels, kept by Numba's own cache in a folder that only the user can write to.

Numba trusts the files of its cache: it would stop at one that is cut, and run code with a wrong
byte. Here a damaged file is compiled again.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import caching, event
from numba.core.serialize import dumps

from scanfab.base.files import make_private, user_folder


@cache
def kernel_folder() -> tuple[Path | None, str]:
    """
    The folder of compiled kernels, which is made if it can be, and why nothing is kept in it.

    Its name is a hash of all kernels and compilers. Numba alone would look at the file of a kernel,
    and not see that another file, with a kernel that this one calls, has changed.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    base = Path(given) if given else user_folder()
    if base is None:
        return None, "there is no home folder"
    sources = hashlib.sha256(f"{sys.version} {llvmlite.__version__}".encode())
    for file in kernel_files():
        sources.update(file.read_bytes())
    folder = base / f"numba-{numba.__version__}-{sources.hexdigest()[:16]}"
    try:
        make_private(folder)
        states = {one: one.stat() for one in (base, folder)}
    except OSError as error:
        return None, f"{error.filename}: {error.strerror}"
    for one, state in states.items():
        # the files are code that will be run: only the user and the system may write them
        if os.name == "posix" and (state.st_uid not in (0, os.getuid()) or state.st_mode & 0o022):
            return None, f"{one} is not yours, or others can write to it (chmod go-w)"
    writable = os.access(folder, os.W_OK)
    return folder, "" if writable else f"{folder} cannot be written to"


def kernel_files() -> list[Path]:
    """The files of all kernels, and those that say how they are compiled."""
    package = Path(__file__).parents[1]
    patterns = ("*/kernels.py", "*/*/kernels.py", "*/kernels/*.py", "base/jit.py")
    return sorted(file for pattern in patterns for file in package.glob(pattern))


def cache_of(function: Callable[..., Any]) -> Any:
    """Numba's cache of one function; one that keeps nothing where there is no safe folder."""
    return caching.NullCache() if kernel_folder()[0] is None else _Cache(function)  # type: ignore[no-untyped-call]


class _Place(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Where Numba keeps the compiled forms of one function."""

    def __init__(self, function: Any, file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        self._module = function.__module__

    def get_cache_path(self) -> str:
        return os.path.join(str(kernel_folder()[0]), self._module)

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        return cls(py_func, py_file)


class _Checked(caching.CompileResultCacheImpl):
    """Adds a checksum to each compiled form."""

    _locator_classes = [_Place]  # noqa: RUF012

    def reduce(self, cres: Any) -> Any:
        content = dumps(super().reduce(cres))  # type: ignore[no-untyped-call]
        return hashlib.sha256(content).digest(), content

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        digest, content = payload
        if hashlib.sha256(content).digest() != digest:
            raise ValueError("damaged")
        return super().rebuild(target_context, pickle.loads(content))  # type: ignore[no-untyped-call]


class _Cache(caching.FunctionCache):
    """Numba's cache of a function, for which no file of it is a reason to stop."""

    _impl_class = _Checked

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # a damaged pickle may raise anything
            with suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None
        # two processes that first save at the same time may give two forms one file
        return found if found is None or found.signature.args == tuple(sig) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):  # the disk may be full
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


class _Compiling(event.Listener):
    """Calls a function when the first kernel is compiled."""

    tell: Callable[[], None] | None = None

    def on_start(self, event: Any) -> None:
        tell, self.tell = self.tell, None
        if tell is not None:
            tell()

    def on_end(self, event: Any) -> None:
        pass


_compiling = _Compiling()
event.register("numba:compile", _compiling)  # type: ignore[no-untyped-call]


def when_compiling(tell: Callable[[], None]) -> None:
    """Call a function when a kernel is first compiled rather than found; from any thread."""
    _compiling.tell = tell
