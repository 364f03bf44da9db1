"""
Compiled kernels on disk, each a file of its own: one that is damaged is compiled again.

Numba's own files have an index, and it trusts both: what is cut or garbage ends in an error, and
code with a wrong byte is run.
"""

from __future__ import annotations

import gc
import hashlib
import pickle
from collections.abc import Callable
from functools import cache
from inspect import getfile
from pathlib import Path
from typing import Any

from numba.core import event
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from scanfab.base.kept_files import read_kept, write_kept
from scanfab.base.kernel_folder import kernel_folder


class KernelCache(NullCache):
    """What Numba asks for the compiled forms of one function, and gives them to."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The form for these types of arguments; None if it is not there, or not as it was."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        content = None if path is None else read_kept(path)
        if content is None:
            return None
        try:
            parts = pickle.loads(content)
            return CompileResult._rebuild(target_context, *parts)  # type: ignore[no-untyped-call]
        except Exception:  # of another version, whatever its name says
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a form, if there is a place for it."""
        path = self._path(sig, data.codegen)
        if path is not None and not data.lifted and not data.library.has_dynamic_globals:
            write_kept(path, dumps(data._reduce()))  # type: ignore[no-untyped-call]

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        folder = kernel_folder().path
        if folder is None:
            return None
        function = self.function
        key = (_source(getfile(function)), function.__qualname__, str(sig), codegen.magic_tuple())
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:24]
        return folder / f"{function.__name__}-{name}.kernel"


@cache
def _source(file: str) -> bytes:
    """What tells one version of a function's file from another."""
    return hashlib.sha256(Path(file).read_bytes()).digest()


def when_compiling(tell: Callable[[], None]) -> None:
    """
    Call a function when a kernel is first compiled rather than found; from any thread.

    The garbage collector waits while the compiler works: it would take a sixteenth of the time, and
    find next to nothing.
    """
    _listener().tell = tell


@cache
def _listener() -> _Compiling:
    """The one of this process: another command in it has other words, but no other listener."""
    listener = _Compiling()
    event.register("numba:compile", listener)  # type: ignore[no-untyped-call]
    return listener


class _Compiling(event.Listener):
    def __init__(self) -> None:
        self.tell: Callable[[], None] | None = None
        # a kernel is compiled within the one that calls it
        self._depth = 0
        self._collects = True

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._collects = gc.isenabled()
        self._depth += 1
        gc.disable()
        tell, self.tell = self.tell, None
        if tell is not None:
            tell()

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()
