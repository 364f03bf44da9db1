"""dask_executor(): send frames to the workers of a Dask cluster."""

from __future__ import annotations

import json
import logging
import os
import platform
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabError, SettingsError, warn
from scanfab.io.families import PathLike

# packages that decide numbers, or that send and receive frames
PACKAGES = ("scanfab", "numpy", "numba", "scipy", "polars", "dask", "distributed")
# seconds within which a scheduler answers when it is called
TIMEOUT = 10.0
# seconds that a scheduler may take to answer while frames are computed
SILENCE = 60.0
# how often Dask computes a frame again that raises an error
RETRIES = 2


class ClusterError(ScanfabError):
    """The scheduler or the workers cannot be used; the message says what to do."""


class DeadWorkersError(ClusterError):
    """All workers that tried to compute a frame have died, for instance for lack of memory."""


@contextmanager
def dask_executor(
    scheduler: str | None = None, *, scheduler_file: PathLike | None = None
) -> Iterator[DaskExecutor]:
    """
    Connect to a Dask cluster: an executor for :func:`scanfab.compute` and the other functions.

    Each worker reads the files of its frames itself, so all workers need the same files at the
    same paths. If a worker dies, Dask gives its frames to other workers. A frame that raises an
    error is tried twice more.

    Parameters
    ----------
    scheduler : str, optional
        Address of the scheduler, such as ``tcp://10.0.0.5:8786``.
    scheduler_file : path, optional
        Instead of the address: the file that ``dask scheduler --scheduler-file``, ``dask-mpi`` and
        ``dask-jobqueue`` write.

    Yields
    ------
    DaskExecutor
        An executor that works until the end of the block.

    Raises
    ------
    ScanfabError
        If no scheduler answers; while frames are computed, if workers have other versions or cannot
        read the files.
    SettingsError
        If not exactly one of the two is given, or distributed is not installed.

    Examples
    --------
    >>> import scanfab
    >>> def fabric(folder, address):
    ...     with scanfab.dask_executor(address) as executor:
    ...         return scanfab.compute(scanfab.read_series(folder), executor=executor)
    """
    if (scheduler is None) == (scheduler_file is None):
        raise SettingsError("name a cluster by either `scheduler` or `scheduler_file`")
    try:
        from distributed import Client
        from distributed.utils import silence_logging_cmgr
    except ImportError:
        install = "pip install 'scanfab[cluster]'"
        raise SettingsError(f"a Dask cluster needs the package distributed: {install}") from None
    address = str(scheduler) if scheduler_file is None else _address_in(Path(scheduler_file))
    # Dask logs lost connections; our error says the same
    with silence_logging_cmgr(logging.CRITICAL + 1):
        client = _connected(Client, address)
        try:
            yield DaskExecutor(client, address)
        finally:
            client.close(timeout=2)


def _connected(connect: Any, address: str) -> Any:
    """The client of a scheduler; ClusterError if no scheduler answers at this address."""
    kind, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    try:
        if kind in ("", "tcp"):
            # a scheduler speaks first; for a server that stays silent Dask would wait for ever
            with socket.create_connection((host.strip("[]"), int(port)), TIMEOUT) as stream:
                stream.settimeout(TIMEOUT)
                if not stream.recv(1):
                    raise ConnectionError("it says nothing")
        return connect(address, timeout=TIMEOUT, set_as_default=False)
    except Exception as error:
        what = f"no Dask scheduler answers there within {TIMEOUT:g} s ({error})"
        advice = "start one by `dask scheduler`, and name the address that it prints"
        raise ClusterError(f"{address}: {what}: {advice}, as tcp://HOST:8786") from None


def _address_in(path: Path) -> str:
    """The address in a scheduler file; waits for a scheduler that is about to write it."""
    end = time.monotonic() + TIMEOUT
    while time.monotonic() < end:
        with suppress(OSError, ValueError, KeyError, TypeError):
            return str(json.loads(path.read_text("utf-8"))["address"])
        time.sleep(0.1)
    expected = f"expected the file that a Dask scheduler writes, within {TIMEOUT:g} s"
    found = "something else" if path.exists() else "nothing"
    raise ClusterError(f"{path}: {expected}, found {found}: is it started with this file?")


class DaskExecutor(Executor):
    """Sends frames to the workers of a Dask cluster; :func:`dask_executor` makes it."""

    def __init__(self, client: Any, address: str) -> None:
        self.client, self.address = client, address
        self._submit: Callable[..., Future[Any]]
        self._submit = client.get_executor(pure=False, retries=RETRIES).submit
        if not self.threads():
            # a warning, so that --quiet shows it too: nothing else tells why nothing happens
            what = "the scheduler has no workers yet: frames wait for them, without a limit"
            warn(f"{address}: {what}: start some with `dask worker {address}`")

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function; a function with a ``path`` reads that file."""
        return self._submit(computed_there, fn, versions_here(), *args, **kwargs)

    def threads(self) -> int:
        """
        The number of threads of all workers; ClusterError if the scheduler does not answer.

        If a scheduler is stopped, or the network loses what is sent, no connection is closed.
        Without this question a run would wait for its frames for ever.
        """
        try:
            return sum(self.client.nthreads(callback_timeout=SILENCE).values())
        except Exception as error:
            raise self.explained(error, "") from None

    def explained(self, error: Exception, job: object) -> Exception:
        """The error to show for an error of a job, or of a question to the scheduler."""
        from distributed.scheduler import KilledWorker

        if isinstance(error, ScanfabError):
            return error
        if isinstance(error, KilledWorker):
            died = f"{error.allowed_failures + 1} one after the other: had they too little memory?"
            return DeadWorkersError(f"{job}: the workers that computed it died, {died}")
        if not isinstance(error, CancelledError) and job:
            return ClusterError(f"{job}: {type(error).__name__} at a worker: {error}")
        is_silent = isinstance(error, TimeoutError)
        what = f"has not answered for {SILENCE:g} s" if is_silent else "has gone"
        advice = "start it again, and go on with `resume`"
        what = f"the scheduler {what} while frames were computed"
        return ClusterError(f"{self.address}: {what}: {advice}")


def computed_there(
    fn: Callable[..., Any], versions: dict[str, str], *args: Any, **kwargs: Any
) -> Any:
    """Call a function in a worker; ScanfabError if its versions or files are not those at home."""
    here, path, theirs = platform.node(), getattr(fn, "path", None), versions_here()
    if theirs != versions:
        there, mine = dict(theirs.items() - versions.items()), versions.items() - theirs.items()
        what = f"the worker on {here} has {there}, but this process {dict(mine)}"
        raise ClusterError(f"{what}: the same versions are needed for the same numbers")
    if path is not None and not os.access(path, os.R_OK):
        need = "workers need the same files by the same paths as this process"
        raise ReadError(f"{path}: the worker on {here} cannot read it: {need}")
    return fn(*args, **kwargs)


@cache
def versions_here() -> dict[str, str]:
    """The versions of Python and of the packages that count, in this process."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"Python": python, **{name: version(name) for name in PACKAGES}}
