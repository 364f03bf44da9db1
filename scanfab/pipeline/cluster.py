"""dask_executor(): frames go to the workers of a Dask cluster; it computes again what is lost."""

from __future__ import annotations

import json
import logging
import os
import platform
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError
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
# seconds between two questions while frames are computed, and for which it may leave one open
BEAT, SILENCE = 2.0, 60.0
# how often Dask computes a frame again that raises an error
RETRIES = 2
# names that tell what a folder holds
MOST_NAMES = 5


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
        self._is_silent = False
        self.threads: dict[str, int] = self._asked_for_threads()
        """How many threads each worker had a moment ago."""
        threading.Thread(target=self._watch, daemon=True).start()
        if not self.threads:
            # a warning, so that --quiet shows it too: nothing else tells why nothing happens
            warn(
                f"{address}: the scheduler has no workers yet: frames wait for them, without a "
                f"limit: start some with `dask worker {address}`"
            )

    def room(self) -> int:
        """How many frames may be under way: one for each thread, so that none waits at a worker."""
        return max(sum(self.threads.values()), 1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a function computed by a worker; one that has a ``path`` reads that file."""
        future: Future[Any] = Future()
        job, path = partial(fn, *args, **kwargs), getattr(fn, "path", None)
        try:
            sent = self.client.submit(
                computed_there, job, path, versions_here(), pure=False, retries=RETRIES
            )
        except Exception:
            raise self._gone() from None
        # what is not waited for any more is neither computed nor kept there
        future.add_done_callback(lambda _: sent.release())
        sent.add_done_callback(partial(self._settle, future, fn, path))
        return future

    def _asked_for_threads(self) -> dict[str, int]:
        return dict(self.client.nthreads(callback_timeout=SILENCE))

    def _watch(self) -> None:
        """
        Ask for the workers every few seconds; leave a scheduler that does not answer.

        A scheduler that is stopped, or lies behind a network that swallows what is sent, closes no
        connection: whoever waits for a frame would wait without an end.
        """
        while self.client.status in ("running", "connecting"):
            time.sleep(BEAT)
            try:
                self.threads = self._asked_for_threads()
            except Exception as error:
                self._is_silent = isinstance(error, TimeoutError)
                with suppress(Exception):
                    # all that is waited for ends with it
                    self.client.close(timeout=TIMEOUT)
                return

    def _gone(self) -> ClusterError:
        what = f"has not answered for {SILENCE:g} s" if self._is_silent else "has gone"
        return ClusterError(
            f"{self.address}: the scheduler {what} while frames were computed: start it again, "
            f"and go on with `resume`"
        )

    def _settle(self, future: Future[Any], job: Any, path: Path | None, sent: Any) -> None:
        """Hand on what has become of a frame, unless nobody waits for it any more."""
        with suppress(InvalidStateError):
            try:
                future.set_result(self._result_of(sent, job, path))
            except ScanfabError as error:
                future.set_exception(error)

    def _result_of(self, sent: Any, job: Any, path: Path | None) -> Any:
        """What a worker has returned; all that can go wrong is a ScanfabError."""
        from distributed.scheduler import KilledWorker

        try:
            # it is there; without a limit Dask would wait for ever if the scheduler stops just now
            found = sent.result(timeout=SILENCE)
        except ScanfabError:
            raise
        except KilledWorker as error:
            raise DeadWorkersError(
                f"{job}: the workers that computed it died, {error.allowed_failures + 1} one after "
                f"the other: had they too little memory?"
            ) from None
        except Exception as error:
            if sent.status != "error" or self.client.status != "running":
                self._is_silent |= isinstance(error, TimeoutError)
                raise self._gone() from None
            text = f"{job}: {type(error).__name__} at a worker: {error}"
            if isinstance(error, ImportError):
                text += f": it needs the same packages as this process ({versions_here()})"
            raise ClusterError(text) from None
        if isinstance(found, ClusterError):
            # a file that is not there for this process either is an error of its frame
            raise found if path is None or path.exists() else ReadError(str(found))
        return found


def computed_there(job: partial[Any], path: Path | None, versions: dict[str, str]) -> Any:
    """
    What a function returns, called by a worker.

    A ClusterError is returned, not raised, if this worker cannot do what others can: to compute the
    frame once more would not help.
    """
    from distributed import get_worker

    worker, theirs = get_worker().address, versions_here()
    if theirs != versions:
        told = ", ".join(
            f"{name} {theirs.get(name)} there and {mine} here"
            for name, mine in versions.items()
            if theirs.get(name) != mine
        )
        return ClusterError(
            f"{worker}: this worker has other versions than this process: {told}: the same are "
            f"needed for the same numbers"
        )
    try:
        return job()
    except Exception:
        if path is None or os.access(path, os.R_OK):
            raise
        return ClusterError(
            f"{worker}: this worker cannot read {path}: it sees {_view(path)}: workers need the "
            f"same files by the same paths as this process"
        )


def _view(path: Path) -> str:
    """What is there in place of a file that cannot be read."""
    found = next(folder for folder in path.parents if folder.exists())
    with suppress(OSError):
        names = sorted(os.listdir(found))
        more = ", ..." if len(names) > MOST_NAMES else ""
        return f"{found} with {', '.join(names[:MOST_NAMES]) + more if names else 'nothing'} in it"
    return f"{found}, which it cannot list"


@cache
def versions_here() -> dict[str, str]:
    """Of Python and of the packages that count, in this process."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"Python": python, **{name: version(name) for name in PACKAGES}}
