"""
A worker process for libraries that crash, hang or take all memory on damaged files.

VTK ends the whole process when a header promises 10^12 points, and HDF5 may hang on a damaged file.
One worker process reads the files of these libraries. It is started when it is first needed, and
again after a file that ended it. Its memory and its time for each file are limited.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from scanfab.base.errors import ReadError
from scanfab.base.files import at_end
from scanfab.io.files import plain

Answer = TypeVar("Answer")
# a file may take this many seconds, and one more second for each PER_SECOND bytes
SECONDS, PER_SECOND = 8.0, 10e6
# a file may take this many bytes of memory, and GROWTH bytes more for each of its bytes
MEMORY, GROWTH = 512e6, 100
_workers: dict[int, tuple[threading.Lock, list[Any]]] = {}
"""By process id (a forked process has its own): the lock, and the worker if it is idle."""


def fenced(function: Callable[..., Answer], path: Path, *more: Any) -> Answer:
    """
    Call a function with a file in the worker process, and return its answer.

    Parameters
    ----------
    function : callable
        A function of a module, so that the worker can import it. It is called with the path of the
        decompressed file as a str and with `more`. Any error it raises becomes a ReadError.
    path : Path
        The file.
    *more
        Further arguments. They and the answer must be picklable.

    Raises
    ------
    ReadError
        If the function raised an error, or if the worker crashed or exceeded its limits.
    """
    file = plain(path)
    size = file.stat().st_size
    limits = MEMORY + GROWTH * size, SECONDS + size / PER_SECOND
    lock, idle = _workers.setdefault(os.getpid(), (threading.Lock(), []))
    with lock:
        worker = idle.pop() if idle else _start()
        try:
            pickle.dump((function, (str(file.resolve()), *more), *limits), worker.stdin)
            worker.stdin.flush()
            is_sound, answer = pickle.load(worker.stdout)
            idle.append(worker)
        except (OSError, EOFError, pickle.UnpicklingError):
            is_sound, answer = False, "its library crashed, or took too much time or memory"
        finally:
            # the worker ended; or we were interrupted, and its answer to this call would come later
            if not idle:
                with suppress(OSError), worker:
                    worker.kill()
    if not is_sound:
        raise ReadError(f"{path}: cannot be read: {answer}")
    return answer  # type: ignore[no-any-return]


def _start() -> Any:
    """Start a worker with our import path and one thread; Ctrl-C does not reach it."""
    places = os.pathsep.join(os.path.abspath(place) for place in sys.path if place)
    more = {"PYTHONPATH": places, "OPENBLAS_NUM_THREADS": "1", "VTK_SMP_MAX_THREADS": "1"}
    words = [sys.executable, "-P", "-m", "scanfab.io.fence"]
    pipe, none = subprocess.PIPE, subprocess.DEVNULL
    worker = subprocess.Popen(
        words, stdin=pipe, stdout=pipe, stderr=none, start_new_session=True, env=os.environ | more
    )
    at_end(worker.kill)
    return worker


def _limit_memory(count: float) -> None:
    """Limit how many more bytes the worker may take, if the system supports it."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        # memory that libraries and earlier files still hold does not count against this file
        held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (held + int(count), hard))


def _serve() -> None:
    """Serve calls until the parent process ends; the output of libraries is discarded."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    # end of file: the parent process has ended
    with suppress(EOFError):
        while True:
            function, arguments, memory, seconds = pickle.load(sys.stdin.buffer)
            _limit_memory(memory)
            # a watchdog thread ends the worker even if a library hangs
            faulthandler.dump_traceback_later(seconds, exit=True)
            try:
                answer: tuple[bool, Any] = True, function(*arguments)
            # libraries raise errors of any type, and some call exit()
            except (Exception, SystemExit) as error:
                answer = False, (str(error).splitlines() or [type(error).__name__])[0]
            faulthandler.cancel_dump_traceback_later()
            _limit_memory(memory)
            pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


if __name__ == "__main__":
    _serve()
