"""Folders that are being written, frame by frame, each file in two halves."""

import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path

SAMPLE = Path(__file__).parents[2] / "sample_data"


def in_halves(data: bytes, path: Path, pause: float) -> None:
    """Write a file: half of it, and after a pause the rest."""
    with open(path, "wb") as stream:
        stream.write(data[: len(data) // 2])
        stream.flush()
        time.sleep(pause)
        stream.write(data[len(data) // 2 :])


def sample_frames(pattern: str = "yade_triaxial/triaxial-*-*.vtk.gz") -> list[list[Path]]:
    """The files of each frame of a series of sample data, grains before contacts."""
    found: dict[str, list[Path]] = {}
    for path in sorted(SAMPLE.glob(pattern), reverse=True):
        found.setdefault(path.name.rpartition("-")[2], []).append(path)
    return [found[step] for step in sorted(found)]


def meanwhile(steps: Iterable[Callable[[], object]]) -> threading.Thread:
    """Take steps one after the other, in a thread."""

    def take() -> None:
        for step in steps:
            step()

    thread = threading.Thread(target=take, daemon=True)
    thread.start()
    return thread


def until(is_so: Callable[[], object]) -> None:
    """Wait until something is so, for a minute at most."""
    end = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)
