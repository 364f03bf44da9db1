"""
The process behind the fence (``python -m scanfab.io.parse.fenced``): reads files on request.

A request is a line of JSON, an answer the length of its head, the head as JSON, and the bytes of
the arrays. Whatever a library prints goes nowhere.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

# seconds that are left to whoever asks to end this process; it may be gone
SPARE = 2
Answer = tuple[dict[str, Any], dict[str, Any]]


def _hdf(request: dict[str, Any]) -> Answer:
    from scanfab.io.parse.hdf_files import read_hdf

    return read_hdf(request["path"], request["most"], request["with_data"])


def _xdmf(request: dict[str, Any]) -> Answer:
    from scanfab.io.parse.meshio_files import read_xdmf

    return read_xdmf(request["path"]), {}


def _surface(request: dict[str, Any]) -> Answer:
    from scanfab.io.parse.meshio_files import read_faces

    return read_faces(request["path"], request["suffix"]), {}


def _netcdf(request: dict[str, Any]) -> Answer:
    from scanfab.io.parse.netcdf_files import read_netcdf

    return read_netcdf(request["path"], request["most"], request["frame"])


def _gsd(request: dict[str, Any]) -> Answer:
    from scanfab.io.parse.gsd_files import read_gsd

    return read_gsd(request["path"], request["most"], request["frame"])


READERS: dict[str, Callable[[dict[str, Any]], Answer]] = {
    "gsd": _gsd,
    "hdf": _hdf,
    "netcdf": _netcdf,
    "xdmf": _xdmf,
    "surface": _surface,
}


def main() -> None:
    """Answer until there are no more requests."""
    out = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    _send(out, {}, {})
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            _limit_memory(request["most"] + request["own"])
            _limit_time(request["seconds"] + SPARE)
            arrays, words = READERS[request["reader"]](request)
            _limit_time(0)
        # libraries raise whatever their parsing meets, and exit for what they do not know
        except (Exception, SystemExit) as error:
            _limit_time(0)
            text = (str(error).splitlines() or [""])[0] or type(error).__name__
            _put(out, {"error": text})
        else:
            _send(out, arrays, words)


def _limit_memory(more: int) -> None:
    """No more addresses than now and so many bytes; where a system has such a limit."""
    try:
        import resource
    except ImportError:
        return
    now = 0
    if Path("/proc/self/statm").exists():
        now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = now + 2 * more
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))


def _limit_time(seconds: float) -> None:
    """Have the system end this process then, also while a library hangs; 0: never."""
    if hasattr(signal, "alarm"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)  # it may have been ignored by our parent
        signal.alarm(math.ceil(seconds))


def _send(out: IO[bytes], arrays: dict[str, Any], words: dict[str, Any]) -> None:
    plain = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
    listed = [
        (name, values.dtype.str, np.shape(arrays[name]), values.nbytes)
        for name, values in plain.items()
    ]
    _put(out, {"arrays": listed, "words": words})
    for values in plain.values():
        out.write(values.data.cast("B") if values.nbytes else b"")
    out.flush()


def _put(out: IO[bytes], head: dict[str, Any]) -> None:
    data = json.dumps(head).encode()
    out.write(len(data).to_bytes(8, "little") + data)
    out.flush()


if __name__ == "__main__":
    main()
