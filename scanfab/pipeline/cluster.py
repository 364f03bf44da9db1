"""dask_executor(): frames go to the workers of a Dask cluster; it computes again what is lost."""

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

# what decides numbers, or reads what is sent
PACKAGES = ("scanfab", "numpy", "numba", "scipy", "polars", "dask", "distributed")
# seconds within which a scheduler answers when it is called
TIMEOUT = 10.0
# seconds that a scheduler may take to answer while frames are computed
SILENCE = 60.0
# how often Dask computes a frame again that raises an error
RETRIES = 2


class ClusterError(ScanfabError):
    """The scheduler or the workers cannot be used; says what was found and what to do."""


class DeadWorkersError(ClusterError):
    """All workers that computed a frame have died, as one does that has too little memory."""


@contextmanager
def dask_executor(
    scheduler: str | None = None, *, scheduler_file: PathLike | None = None
) -> Iterator[DaskExecutor]:
    """
    Connect to a Dask cluster: an executor for :func:`scanfab.compute` and the other functions.

    Each worker reads the files of its frames itself, so it sees the same files by the same paths.
    If a worker dies, Dask gives its frames to others. A frame that raises an error is computed
    twice more before the error counts.

    Parameters
    ----------
    scheduler : str, optional
        Its address, such as ``tcp://10.0.0.5:8786``.
    scheduler_file : path, optional
        In its place the file that ``dask scheduler --scheduler-file``, ``dask-mpi`` and
        ``dask-jobqueue`` write.

    Yields
    ------
    DaskExecutor
        Until the end of the block.

    Raises
    ------
    ScanfabError
        If no scheduler answers; while frames are computed, if workers have other versions or do not
        see the files.
    SettingsError
        If not just one of the two is named, or distributed is not installed.

    Examples
    --------
    >>> import scanfab
    >>> def fabric(folder, address):
    ...     with scanfab.dask_executor(address) as executor:
    ...         return scanfab.compute(scanfab.read_series(folder), executor=executor)
    """
    if (scheduler is None) == (scheduler_file is None):
        raise SettingsError("a cluster is named by just one of `scheduler` and `scheduler_file`")
    try:
        from distributed import Client
    except ImportError:
        raise SettingsError(
            "a Dask cluster needs the package distributed: pip install 'scanfab[cluster]'"
        ) from None
    address = str(scheduler) if scheduler_file is None else _address_in(Path(scheduler_file))
    # Dask logs lost connections, which the error that we raise says
    levels = {name: logging.getLogger(name).level for name in ("distributed", "distributed.client")}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    client = None
    try:
        client = _connected(Client, address)
        yield DaskExecutor(client, address)
    finally:
        if client is not None:
            client.close(timeout=2)
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _connected(connect: Any, address: str) -> Any:
    """The client of a scheduler; ClusterError if none answers at this address."""
    kind, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    try:
        if kind in ("", "tcp"):
            with socket.create_connection((host.strip("[]"), int(port)), TIMEOUT) as stream:
                stream.settimeout(TIMEOUT)
                # a scheduler speaks first; Dask would wait without an end for one that does not
                if not stream.recv(1):
                    raise ConnectionError("it says nothing")
        return connect(address, timeout=TIMEOUT, set_as_default=False)
    except Exception as error:
        what = f"no Dask scheduler answers there within {TIMEOUT:g} s ({error})"
        advice = "start one by `dask scheduler`, and name the address that it prints"
        raise ClusterError(f"{address}: {what}: {advice}, as tcp://HOST:8786") from None


def _address_in(path: Path) -> str:
    """The address in a scheduler file, which the scheduler may just be about to write."""
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
        if not self._threads():
            # a warning, so that --quiet shows it too: nothing else tells why nothing happens
            what = "the scheduler has no workers yet: frames wait for them, without a limit"
            warn(f"{address}: {what}: start some with `dask worker {address}`")

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a function computed by a worker; one that has a ``path`` reads that file."""
        return self._submit(computed_there, fn, versions_here(), *args, **kwargs)

    def room(self) -> int:
        """How many frames may be under way: one for each thread of the workers, and at least 1."""
        return max(self._threads(), 1)

    def _threads(self) -> int:
        """
        How many threads the workers have now; ClusterError if the scheduler does not say it.

        A scheduler that is stopped, or lies behind a network that swallows what is sent, closes no
        connection: without this question a run would wait for its frames for ever.
        """
        try:
            return sum(self.client.nthreads(callback_timeout=SILENCE).values())
        except Exception as error:
            raise self.explained(error, "") from None

    def explained(self, error: Exception, job: object) -> Exception:
        """What users are told of an error of a job, or of asking the scheduler."""
        from distributed.scheduler import KilledWorker

        if isinstance(error, ScanfabError):
            return error
        if isinstance(error, KilledWorker):
            died = f"{error.allowed_failures + 1} one after the other: had they too little memory?"
            return DeadWorkersError(f"{job}: the workers that computed it died, {died}")
        if isinstance(error, CancelledError) or not job:
            is_silent = isinstance(error, TimeoutError)
            what = f"has not answered for {SILENCE:g} s" if is_silent else "has gone"
            what = f"the scheduler {what} while frames were computed"
            return ClusterError(f"{self.address}: {what}: start it again, and go on with `resume`")
        return ClusterError(f"{job}: {type(error).__name__} at a worker: {error}")


def computed_there(
    fn: Callable[..., Any], versions: dict[str, str], *args: Any, **kwargs: Any
) -> Any:
    """What a function returns, called by a worker; ScanfabError if this worker cannot do it."""
    here, path, theirs = platform.node(), getattr(fn, "path", None), versions_here()
    if theirs != versions:
        there, mine = (
            dict(theirs.items() - versions.items()),
            dict(versions.items() - theirs.items()),
        )
        what = f"the worker on {here} has {there}, but this process {mine}"
        raise ClusterError(f"{what}: the same versions are needed for the same numbers")
    if path is not None and not os.access(path, os.R_OK):
        need = "workers need the same files by the same paths as this process"
        raise ReadError(f"{path}: the worker on {here} cannot read it: {need}")
    return fn(*args, **kwargs)


@cache
def versions_here() -> dict[str, str]:
    """Of Python and of the packages that count, in this process."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"Python": python, **{name: version(name) for name in PACKAGES}}
