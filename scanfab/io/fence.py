"""
A worker process for libraries that were seen to crash, to hang or to take all memory.

VTK ends the whole process when a header promises 10^12 points, HDF5 may hang on a damaged file. One
worker reads all such files. It is started when it is first needed, and again after each file that
ended it. Its memory and its time for a file are limited.
"""

from __future__ import annotations

import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from scanfab.base.ending import at_end
from scanfab.base.errors import ReadError
from scanfab.base.files import free_memory
from scanfab.io.files import Stamp, check_memory, plain, stamp_of

Answer = TypeVar("Answer")
# seconds for a file, and bytes that are read in one more
SECONDS, PER_SECOND = 8.0, 10e6
# bytes of memory that any file may take, and how many times its size a large one may take
MEMORY, GROWTH = 512e6, 100
# a file that ended the worker is refused for so many seconds: to read it takes several questions
SECONDS_REFUSED = 60.0
ENDED = "its library crashed, or took too much time or memory"

_lock = threading.Lock()
_workers: list[subprocess.Popen[bytes]] = []
_deadly: dict[Stamp, float] = {}


def needed(path: Path, module: str, extra: str) -> None:
    """ReadError if the package that reads a file is not installed."""
    if find_spec(module) is None:
        raise ReadError(
            f"{path}: is read by another package, {module}, which is not installed: "
            f'pip install "scanfab[{extra}]"'
        )


def fenced(function: Callable[..., Answer], path: Path, *more: Any) -> Answer:
    """
    Call a function with a file in the worker process.

    Parameters
    ----------
    function : callable
        Of a module, so that the worker can import it. It is called with the path of the
        decompressed file as a str and with `more`. What it raises becomes a ReadError.
    path : Path
        The file.
    *more
        Further arguments, which must be picklable, as the answer must.

    Raises
    ------
    ReadError
        If the function raised an error, or if the worker crashed or exceeded its limits.
    """
    file = plain(path)
    size, stamp = file.stat().st_size, stamp_of(file)
    check_memory(path, 2.0 * size)
    limit, seconds = min(MEMORY + GROWTH * size, free_memory()), SECONDS + size / PER_SECOND
    with _lock:
        if time.monotonic() - _deadly.get(stamp, -math.inf) < SECONDS_REFUSED:
            raise ReadError(f"{path}: cannot be read: {ENDED}")
        answered = False
        worker = _workers[0] if _workers else _start()
        timer = threading.Timer(seconds, worker.kill)
        timer.start()
        try:
            pickle.dump((function, (str(file.resolve()), *more), limit, seconds), worker.stdin)  # type: ignore[arg-type]
            worker.stdin.flush()  # type: ignore[union-attr]
            sound, answer = pickle.load(worker.stdout)  # type: ignore[arg-type]
            answered = True
        except (OSError, EOFError, pickle.UnpicklingError):
            _deadly[stamp] = time.monotonic()
            raise ReadError(f"{path}: cannot be read: {ENDED}") from None
        finally:
            timer.cancel()
            if not answered:
                # it ended, or we were interrupted, and the next answer would be to this question
                _end()
    if not sound:
        raise ReadError(f"{path}: cannot be read: {answer}")
    return answer  # type: ignore[no-any-return]


def _start() -> subprocess.Popen[bytes]:
    """Start a worker that imports what we import, and that Ctrl-C does not reach."""
    places = os.pathsep.join(os.path.abspath(one) for one in sys.path if one)
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "VTK_SMP_MAX_THREADS": "1"}
    worker = subprocess.Popen(
        [sys.executable, "-P", "-m", "scanfab.io.fence"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": places, **one_thread},
    )
    _workers.append(worker)
    at_end(_end)
    pickle.load(worker.stdout)  # type: ignore[arg-type]
    return worker


def _end() -> None:
    while _workers:
        with _workers.pop() as worker, suppress(OSError):
            worker.kill()


def _forget() -> None:
    """A forked process starts a worker of its own."""
    global _lock
    _lock = threading.Lock()
    _workers.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


def _limit(memory: float, seconds: float) -> None:
    """Limit the worker where the system can: it also ends when nobody is left to kill it."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        # libraries and earlier files may keep memory, which is not of this file
        held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (held + int(memory), hard))
    if hasattr(signal, "alarm"):
        signal.alarm(math.ceil(seconds))


def _serve() -> None:
    """Answer until there are no more questions; whatever libraries print goes nowhere."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    answer: Any = "ready"
    while True:
        pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()
        try:
            function, arguments, memory, seconds = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        _limit(memory, seconds + 2)
        try:
            answer = True, function(*arguments)
        # libraries raise whatever they meet, and exit for what they do not know
        except (Exception, SystemExit) as error:
            answer = False, (str(error).splitlines() or [type(error).__name__])[0]
        _limit(memory, 0)


if __name__ == "__main__":
    _serve()
