"""How the scheduler of a cluster is reached, listened to, and what is said where it is silent."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabError

# seconds within which a scheduler answers when it is called
TIMEOUT = 10.0
# seconds between two questions while frames are computed, and for which it may leave one open
BEAT, SILENCE = 2.0, 60.0


class ClusterError(ScanfabError):
    """The scheduler or the workers cannot be used; says what was found and what to do."""


def address_in(path: Path) -> str:
    """The address in a scheduler file, which may come in a moment."""
    end = time.monotonic() + TIMEOUT
    while True:
        try:
            return str(json.loads(path.read_text("utf-8"))["address"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            # it may be in the middle of being written
            if time.monotonic() > end or isinstance(error, KeyError | TypeError):
                break
        time.sleep(0.1)
    found = "something else" if path.exists() else f"nothing within {TIMEOUT:g} s"
    raise ClusterError(
        f"{path}: expected the file that a Dask scheduler writes, with its address, found {found}: "
        f"is the scheduler started with this file?"
    )


def check_that_one_listens(address: str) -> None:
    """ClusterError if there is nobody; addresses of other kinds than tcp are left to Dask."""
    kind, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    if kind not in ("", "tcp"):
        return
    if not host or not port.isdigit():
        raise ClusterError(f"{address}: expected the address of a scheduler, as tcp://HOST:8786")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), TIMEOUT) as stream:
            stream.settimeout(TIMEOUT)
            # a scheduler speaks first, and Dask would wait for it without an end
            speaks = bool(stream.recv(1))
    except TimeoutError:
        speaks = False
    except (OSError, OverflowError) as error:
        raise ClusterError(
            f"{address}: no scheduler is there ({error}): start one with `dask scheduler`, or name "
            f"the address that it prints"
        ) from None
    if not speaks:
        raise _silent(address, "it says nothing")


def connected(connect: Callable[..., Any], address: str) -> Any:
    """A client, within the time that a scheduler has to answer."""
    try:
        return _answer(lambda: connect(address, timeout=TIMEOUT, set_as_default=False), 2 * TIMEOUT)
    except Exception as error:
        raise _silent(address, str(error) or "no answer") from None


def _answer(ask: Callable[[], Any], seconds: float) -> Any:
    """What a call returns or raises; TimeoutError if it takes longer, whatever it waits for."""
    found: Future[Any] = Future()

    def try_it() -> None:
        try:
            found.set_result(ask())
        except Exception as error:
            found.set_exception(error)

    threading.Thread(target=try_it, daemon=True).start()
    return found.result(seconds)


class Pulse:
    """
    Asks a scheduler for its workers every few seconds, and calls back; leaves one that is silent.

    One that is stopped, or lies behind a network that swallows what is sent, closes no connection,
    so that whoever waits for a frame would wait without an end.
    """

    def __init__(self, client: Any, address: str, call: Callable[[], object]) -> None:
        self.threads: dict[str, int] = {}
        """Of each worker."""
        self._client, self._address, self._call = client, address, call
        self._is_silent = False
        self._is_over = threading.Event()

    def start(self) -> None:
        """Ask for the first time, and from now on."""
        self._ask()
        threading.Thread(target=self._beat, daemon=True).start()

    def stop(self) -> None:
        """Ask no more."""
        self._is_over.set()

    def gone(self) -> ClusterError:
        """The error for a scheduler that is lost."""
        what = f"has not answered for {SILENCE:g} s" if self._is_silent else "has gone"
        return ClusterError(
            f"{self._address}: the scheduler {what} while frames were computed: start it again, "
            f"and go on with `resume`"
        )

    def _beat(self) -> None:
        while not self._is_over.wait(BEAT):
            try:
                self._ask()
                self._call()
            except Exception as error:
                self._is_silent = isinstance(error, TimeoutError)
                # all that is waited for ends with it
                with suppress(Exception):
                    self._client.close(timeout=TIMEOUT)
                return

    def _ask(self) -> None:
        self.threads = dict(_answer(self._client.nthreads, SILENCE))


def _silent(address: str, reason: str) -> ClusterError:
    return ClusterError(
        f"{address}: does not answer as a Dask scheduler within {TIMEOUT:g} s ({reason}): is "
        f"another program there, another version of Dask, or does it hang?"
    )


def outdated(worker: str, theirs: dict[str, str], mine: dict[str, str]) -> ClusterError:
    """The error for a worker with other versions."""
    told = ", ".join(
        f"{name} {theirs.get(name, 'none')} there and {mine.get(name, 'none')} here"
        for name in sorted({*mine, *theirs})
        if mine.get(name) != theirs.get(name)
    )
    return ClusterError(
        f"{worker}: this worker has other versions than this process: {told}: the same are needed "
        f"for the same numbers"
    )


def unloadable(worker: str, error: BaseException, scanfab: str) -> ClusterError:
    """The error for a worker that lacks what it is to compute with."""
    return ClusterError(
        f"{worker}: this worker cannot load scanfab ({error}): it needs the same packages as this "
        f"process (scanfab {scanfab})"
    )


def blind(who: str, path: Path, worker: str, view: str) -> ClusterError:
    """The error for workers that do not see a file that is seen here."""
    return ClusterError(
        f"{who} cannot read {path}: {worker} sees {view}: workers need the same files by the same "
        f"paths as this process"
    )
