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
from functools import cache, partial
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


class UnseenFileError(ClusterError):
    """A worker cannot read the file of a frame."""


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
        import distributed
    except ImportError:
        raise SettingsError(
            "a Dask cluster needs the package distributed: pip install 'scanfab[cluster]'"
        ) from None
    connect: Any = distributed.Client
    address = str(scheduler) if scheduler_file is None else _address_in(Path(scheduler_file))
    with _quiet():
        _check_that_one_listens(address)
        try:
            client = connect(address, timeout=TIMEOUT, set_as_default=False)
        except Exception as error:
            raise _no_answer(address, str(error)) from None
        try:
            yield DaskExecutor(client, address)
        finally:
            client.close(timeout=2)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence what Dask logs of lost connections: the error that we raise says it."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for one, level in zip(loggers, levels, strict=True):
            one.setLevel(level)


def _address_in(path: Path) -> str:
    """The address in a scheduler file, which the scheduler may just be about to write."""
    end = time.monotonic() + TIMEOUT
    while time.monotonic() < end:
        with suppress(OSError, ValueError, KeyError, TypeError):
            return str(json.loads(path.read_text("utf-8"))["address"])
        time.sleep(0.1)
    found = "something else" if path.exists() else "nothing"
    raise ClusterError(
        f"{path}: expected the file that a Dask scheduler writes, with its address, within "
        f"{TIMEOUT:g} s, found {found}: is the scheduler started with this file?"
    )


def _check_that_one_listens(address: str) -> None:
    """ClusterError if nobody answers there; addresses of other kinds than tcp are left to Dask."""
    kind, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    if kind not in ("", "tcp"):
        return
    if not host or not port.isdigit():
        raise ClusterError(f"{address}: expected the address of a scheduler, as tcp://HOST:8786")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), TIMEOUT) as stream:
            stream.settimeout(TIMEOUT)
            # a scheduler speaks first; if it does not, Dask would wait for it without an end
            speaks = bool(stream.recv(1))
    except TimeoutError:
        speaks = False
    except (OSError, OverflowError) as error:
        raise ClusterError(
            f"{address}: no scheduler is there ({error}): start one with `dask scheduler`, or name "
            f"the address that it prints"
        ) from None
    if not speaks:
        raise _no_answer(address, "it says nothing")


def _no_answer(address: str, reason: str) -> ClusterError:
    return ClusterError(
        f"{address}: does not answer as a Dask scheduler within {TIMEOUT:g} s ({reason}): is "
        f"another program there, another version of Dask, or does it hang?"
    )


class DaskExecutor(Executor):
    """Sends frames to the workers of a Dask cluster; :func:`dask_executor` makes it."""

    def __init__(self, client: Any, address: str) -> None:
        self.client, self.address = client, address
        self._sender = client.get_executor(pure=False, retries=RETRIES)
        if not self._threads():
            # a warning, so that --quiet shows it too: nothing else tells why nothing happens
            warn(
                f"{address}: the scheduler has no workers yet: frames wait for them, without a "
                f"limit: start some with `dask worker {address}`"
            )

    def room(self) -> int:
        """How many frames may be under way: one for each thread of the workers, and at least 1."""
        return max(self._threads(), 1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a function computed by a worker; one that has a ``path`` reads that file."""
        job, path = partial(fn, *args, **kwargs), getattr(fn, "path", None)
        try:
            future: Future[Any] = self._sender.submit(computed_there, job, path, versions_here())
        except Exception:
            raise self._gone("has gone") from None
        return future

    def explained(self, error: Exception, job: Any) -> Exception:
        """What users are told of an error of a job."""
        from distributed.scheduler import KilledWorker

        if isinstance(error, UnseenFileError) and not job.path.exists():
            # not for this process either: it is an error of the frame
            return ReadError(str(error))
        if isinstance(error, ScanfabError):
            return error
        if isinstance(error, KilledWorker):
            return DeadWorkersError(
                f"{job}: the workers that computed it died, {error.allowed_failures + 1} one after "
                f"the other: had they too little memory?"
            )
        if isinstance(error, CancelledError):
            return self._gone("has gone")
        text = f"{job}: {type(error).__name__} at a worker: {error}"
        if isinstance(error, ImportError):
            text += f": it needs the same packages as this process ({versions_here()})"
        return ClusterError(text)

    def _threads(self) -> int:
        """
        How many threads the workers have now; ClusterError if the scheduler does not answer.

        A scheduler that is stopped, or lies behind a network that swallows what is sent, closes no
        connection: without a limit, a run would wait for its frames for ever.
        """
        try:
            return sum(self.client.nthreads(callback_timeout=SILENCE).values())
        except TimeoutError:
            raise self._gone(f"has not answered for {SILENCE:g} s") from None
        except Exception:
            raise self._gone("has gone") from None

    def _gone(self, what: str) -> ClusterError:
        return ClusterError(
            f"{self.address}: the scheduler {what} while frames were computed: start it again, and "
            f"go on with `resume`"
        )


def computed_there(job: partial[Any], path: Path | None, versions: dict[str, str]) -> Any:
    """What a function returns, called by a worker; ClusterError if this worker cannot do it."""
    from distributed import get_worker

    worker, theirs = get_worker().address, versions_here()
    if theirs != versions:
        told = ", ".join(
            f"{name} {theirs.get(name)} there and {mine} here"
            for name, mine in versions.items()
            if theirs.get(name) != mine
        )
        raise ClusterError(
            f"{worker}: this worker has other versions than this process: {told}: the same are "
            f"needed for the same numbers"
        )
    try:
        return job()
    except Exception:
        if path is None or os.access(path, os.R_OK):
            raise
        raise UnseenFileError(
            f"{worker}: this worker cannot read {path}: workers need the same files by the same "
            f"paths as this process"
        ) from None


@cache
def versions_here() -> dict[str, str]:
    """Of Python and of the packages that count, in this process."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"Python": python, **{name: version(name) for name in PACKAGES}}
