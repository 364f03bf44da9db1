"""
A worker process for libraries that were seen to crash, to hang or to take all memory.

VTK ends the whole process when a header promises 10^12 points, HDF5 may hang on a damaged file. One
worker reads all such files. It is started when it is first needed, and again after each file that
ended it. Its memory and its time for a file are limited.
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

from scanfab.base.ending import at_end
from scanfab.base.errors import ReadError
from scanfab.base.files import free_memory
from scanfab.io.files import check_memory, plain

Answer = TypeVar("Answer")
# seconds for a file, and bytes that are read in one more
SECONDS, PER_SECOND = 8.0, 10e6
# bytes of memory that any file may take, and how many times its size a large one may take
MEMORY, GROWTH = 512e6, 100
_workers: dict[int, tuple[threading.Lock, list[Any]]] = {}
"""The lock of each process, and its worker if that waits; a forked process has its own."""


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
    size = file.stat().st_size
    check_memory(path, 2.0 * size)
    limits = min(MEMORY + GROWTH * size, free_memory()), SECONDS + size / PER_SECOND
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
            # it ended; or we were interrupted, and its next answer would belong to this question
            if not idle:
                with suppress(OSError), worker:
                    worker.kill()
    if not is_sound:
        raise ReadError(f"{path}: cannot be read: {answer}")
    return answer  # type: ignore[no-any-return]


def _start() -> Any:
    """A worker that imports what we import, on one thread, and that Ctrl-C does not reach."""
    places = os.pathsep.join(os.path.abspath(one) for one in sys.path if one)
    more = {"PYTHONPATH": places, "OPENBLAS_NUM_THREADS": "1", "VTK_SMP_MAX_THREADS": "1"}
    words = [sys.executable, "-P", "-m", "scanfab.io.fence"]
    pipe, none = subprocess.PIPE, subprocess.DEVNULL
    worker = subprocess.Popen(
        words, stdin=pipe, stdout=pipe, stderr=none, start_new_session=True, env=os.environ | more
    )
    at_end(worker.kill)
    return worker


def _limit_memory(count: float) -> None:
    """Limit how many more bytes the worker may take, where the system can limit them."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        # libraries and earlier files may keep memory, which is not of this file
        held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (held + int(count), hard))


def _serve() -> None:
    """Answer until there are no more questions; whatever libraries print goes nowhere."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    # the questions end with the process that asks them
    with suppress(EOFError):
        while True:
            function, arguments, memory, seconds = pickle.load(sys.stdin.buffer)
            _limit_memory(memory)
            # ends the worker from a thread of its own, even while a library hangs
            faulthandler.dump_traceback_later(seconds, exit=True)
            try:
                answer: tuple[bool, Any] = True, function(*arguments)
            # libraries raise whatever they meet, and exit for what they do not know
            except (Exception, SystemExit) as error:
                answer = False, (str(error).splitlines() or [type(error).__name__])[0]
            faulthandler.cancel_dump_traceback_later()
            _limit_memory(memory)
            pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


if __name__ == "__main__":
    _serve()
