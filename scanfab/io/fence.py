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
from functools import cache
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
    lock, workers = _own(os.getpid())
    with lock:
        if not workers:
            workers.append(_start())
        worker = workers[0]
        try:
            question = function, (str(file.resolve()), *more), *limits
            pickle.dump(question, worker.stdin)  # type: ignore[arg-type]
            worker.stdin.flush()  # type: ignore[union-attr]
            is_sound, answer = pickle.load(worker.stdout)  # type: ignore[arg-type]
        except BaseException as error:
            # it ended, or we were interrupted, and its next answer would be to this question
            workers.clear()
            with suppress(OSError), worker:
                worker.kill()
            if not isinstance(error, OSError | EOFError | pickle.UnpicklingError):
                raise
            is_sound, answer = False, "its library crashed, or took too much time or memory"
    if not is_sound:
        raise ReadError(f"{path}: cannot be read: {answer}")
    return answer  # type: ignore[no-any-return]


@cache
def _own(process: int) -> tuple[threading.Lock, list[subprocess.Popen[bytes]]]:
    """The lock and the worker, if one is running, of a process; a forked process has its own."""
    return threading.Lock(), []


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
    answer: tuple[bool, Any]
    while True:
        try:
            function, arguments, memory, seconds = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        _limit_memory(memory)
        # ends the worker from a thread of its own, even while a library hangs
        faulthandler.dump_traceback_later(seconds, exit=True)
        try:
            answer = True, function(*arguments)
        # libraries raise whatever they meet, and exit for what they do not know
        except (Exception, SystemExit) as error:
            answer = False, (str(error).splitlines() or [type(error).__name__])[0]
        faulthandler.cancel_dump_traceback_later()
        _limit_memory(memory)
        pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()


if __name__ == "__main__":
    _serve()
