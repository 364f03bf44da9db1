"""How the scheduler of a cluster is reached, and what is said where it is not."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabError

__all__ = ["ClusterError", "address_in", "check_that_one_listens", "connected", "outdated"]

# seconds within which a scheduler answers
TIMEOUT = 10.0


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
    found: Future[Any] = Future()

    def try_it() -> None:
        try:
            found.set_result(connect(address, timeout=TIMEOUT, set_as_default=False))
        except Exception as error:
            found.set_exception(error)

    threading.Thread(target=try_it, daemon=True).start()
    try:
        return found.result(2 * TIMEOUT)
    except Exception as error:
        raise _silent(address, str(error) or "no answer") from None


def _silent(address: str, reason: str) -> ClusterError:
    return ClusterError(
        f"{address}: does not answer as a Dask scheduler within {TIMEOUT:g} s ({reason}): is "
        f"another program there, or another version of Dask?"
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
