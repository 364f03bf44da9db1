"""
Libraries behind a fence: another process reads a file, and what it does ends nothing but itself.

HDF5 and meshio may crash, hang or take all memory on a damaged file. One process reads all of them;
it starts when it is first needed, and anew after each file that it did not survive. What comes back
is arrays and words, nothing that could be run.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.ending import at_end
from scanfab.base.errors import ReadError
from scanfab.base.memory import free_memory
from scanfab.io.files import Stamp, check_memory, stamp_of

# seconds for a file, and bytes that are read in one more; and for the process to start
SECONDS, PER_SECOND = 8.0, 10e6
SECONDS_TO_START = 120.0
# for so long a file that the process did not survive is not tried again: to read one takes several
# questions, and each would take its seconds
SECONDS_REFUSED = 60.0
# a file may be unpacked to so many times its size, and a small one to so many bytes
MOST_UNPACKED, SMALL = 1000, 16 << 20
# bytes of the libraries themselves
OWN = 512 << 20

GONE = "its library crashed, or took too long or too much"
Arrays = dict[str, npt.NDArray[Any]]


class FencedError(Exception):
    """What the process said of the file, or how it ended."""


class GoneError(FencedError):
    """The process did not survive the file."""


class _Process:
    """The process behind the fence."""

    def __init__(self) -> None:
        # no file of the working folder stands in for a library: -P, and no empty path
        places = os.pathsep.join(os.path.abspath(place) for place in sys.path if place)
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "scanfab.io.parse.fenced"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Ctrl-C is for us: who ends in order still reads
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": places},
        )
        with _Limit(self.process, SECONDS_TO_START):
            self._answer()

    def ask(self, request: dict[str, Any]) -> tuple[Arrays, dict[str, Any]]:
        """Arrays and words that answer a request."""
        assert self.process.stdin is not None
        with _Limit(self.process, request["seconds"]):
            try:
                self.process.stdin.write(json.dumps(request).encode() + b"\n")
                self.process.stdin.flush()
                return self._answer()
            except (OSError, EOFError, ValueError):
                raise GoneError(GONE) from None

    def _answer(self) -> tuple[Arrays, dict[str, Any]]:
        assert self.process.stdout is not None
        stream = self.process.stdout
        head = json.loads(_read(stream, int.from_bytes(_read(stream, 8), "little")))
        if "error" in head:
            raise FencedError(head["error"])
        arrays = {
            name: np.frombuffer(_read(stream, size), np.dtype(type)).reshape(shape)
            for name, type, shape, size in head["arrays"]
        }
        return arrays, head["words"]

    def end(self) -> None:
        """Stop it, whatever it does."""
        with suppress(OSError):
            self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()


class _Limit:
    """Kills a process that is still busy when the time is over."""

    def __init__(self, process: subprocess.Popen[bytes], seconds: float) -> None:
        self.timer = threading.Timer(seconds, process.kill)
        self.timer.daemon = True

    def __enter__(self) -> None:
        self.timer.start()

    def __exit__(self, *_: object) -> None:
        self.timer.cancel()


def _read(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


_lock = threading.Lock()
_running: list[_Process] = []
# files, as they stood, that the process did not survive, and when
_deadly: dict[Stamp, float] = {}


def needed(path: Path, module: str, extra: str) -> None:
    """ReadError if the package is not installed that reads a file."""
    if find_spec(module) is None:
        raise ReadError(
            f"{path}: is read by another package, {module}, which is not installed: "
            f'pip install "scanfab[{extra}]"'
        )


def fenced(reader: str, file: Path, path: Path, **more: Any) -> tuple[Arrays, dict[str, Any]]:
    """
    Let the process behind the fence read a file.

    Parameters
    ----------
    reader : str
        One of those that ``fenced.py`` knows.
    file, path : Path
        The file, unpacked; and its name for messages.
    **more
        What else the reader wants to know.

    Returns
    -------
    arrays : dict of str to ndarray
    words : dict

    Raises
    ------
    ReadError
        If the library cannot read it, crashed, took too long, or would take too much memory.
    """
    size, stamp = file.stat().st_size, stamp_of(file)
    check_memory(path, 2.0 * size)
    most = int(min(MOST_UNPACKED * size + SMALL, free_memory() / 3))
    request = {
        "reader": reader,
        "path": str(file.resolve()),
        "most": most,
        "own": OWN,
        "seconds": SECONDS + size / PER_SECOND,
        **more,
    }
    with _lock:
        try:
            _refuse_deadly(stamp)
            if not _running:
                _running.append(_Process())
                at_end(_end)
            return _running[0].ask(request)
        except FencedError as error:
            if isinstance(error, GoneError):
                _end()
                _deadly[stamp] = time.monotonic()
            raise ReadError(f"{path}: cannot be read: {error}") from None
        except (OSError, EOFError, ValueError) as error:
            _end()
            raise ReadError(
                f"{path}: cannot be read: the process that reads such files does not start: {error}"
            ) from None
        except BaseException:
            # interrupted between question and answer: the next one would get this answer
            _end()
            raise


def _refuse_deadly(stamp: Stamp) -> None:
    """FencedError for a file that the process did not survive a moment ago."""
    now = time.monotonic()
    for one in [one for one, when in _deadly.items() if now - when > SECONDS_REFUSED]:
        del _deadly[one]
    if stamp in _deadly:
        raise FencedError(GONE)


def _end() -> None:
    while _running:
        _running.pop().end()


def _forget() -> None:
    """A forked process has none of its own behind the fence: the one it knows is its parent's."""
    global _lock
    _lock = threading.Lock()
    _running.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
