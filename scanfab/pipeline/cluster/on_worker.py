"""What workers of a cluster are asked, whatever sends it to them; it is loaded there."""

from __future__ import annotations

import os
import pickle
import platform
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabError
from scanfab.pipeline.cluster.packed import unpacked

# what decides numbers, or reads what is sent
PACKAGES = ("scanfab", "numpy", "numba", "scipy", "polars", "dask", "distributed")
# names that tell what a folder holds
MOST_NAMES = 5


@dataclass(frozen=True)
class Failed:
    """A try that raised an error."""

    worker: str
    error: Exception
    view: str = ""
    """What the worker sees in place of the frame's file, if it does not see that."""


@dataclass(frozen=True)
class Outdated:
    """A worker that has other versions than whoever asks."""

    worker: str
    versions: dict[str, str]


@cache
def versions_here() -> dict[str, str]:
    """Of Python and of the packages that count, in this process."""
    found = {"Python": ".".join(platform.python_version_tuple()[:2])}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return found


def view_there(path: str) -> str:
    """Nothing if a file can be read, else what is there instead."""
    if os.access(path, os.R_OK):
        return ""
    found = next(folder for folder in Path(path).parents if folder.exists())
    try:
        names = sorted(os.listdir(found))
    except OSError as error:
        return f"{found}, which it cannot list ({error.strerror})"
    more = ", ..." if len(names) > MOST_NAMES else ""
    held = ", ".join(names[:MOST_NAMES]) + more if names else "nothing"
    return f"{found} with {held} in it"


def sendable(error: Exception) -> Exception:
    """Some errors cannot be made again from what is sent of them."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return ScanfabError(f"{type(error).__name__}: {error}")
    return error


def computed_there(job: Any, versions: dict[str, str], topic: str) -> Any:
    """A frame's results, or why there are none."""
    from distributed import get_worker
    from distributed.utils import sync

    worker = get_worker()
    if versions_here() != versions:
        return Outdated(worker.address, versions_here())
    # the scheduler has it before the frame can take this worker down
    sync(worker.loop, worker.scheduler.log_event, topic=topic, msg=worker.get_current_task())
    try:
        return job(1)
    except Exception as error:
        path = file_of(job)
        view = "" if path is None else view_there(str(path))
        return Failed(worker.address, sendable(error), view)


def file_of(job: Any) -> Path | None:
    """Where a frame is read from, if it lies in a file."""
    file = getattr(job, "file", None)
    return None if file is None else file.snapshot.path.absolute()


def scanned_there(light: bytes, heavy: dict[str, Any], part: Any) -> Any:
    """What a function makes of a part; what it needs much of came before."""
    function: Callable[[Any], Any] = unpacked(light, heavy)
    return function(part)
