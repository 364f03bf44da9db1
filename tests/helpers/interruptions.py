"""Runs of the command line that are interrupted at random moments, and resumed until they end."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from scanfab.table.writing import Excerpt
from tests.helpers.dumps import cubic_rows, dump_text, write

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
PROGRAM = [sys.executable, "-c", "from scanfab.cli.main import main; main()"]
# a rough scan of small frames
FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")
FRAMES = 30


@contextmanager
def interrupted_at_row(monkeypatch: pytest.MonkeyPatch, number: int) -> Iterator[list[Any]]:
    """Rows are listed, and the run is interrupted before it writes the number-th."""
    rows: list[Any] = []
    written = Excerpt.of

    def interrupted(self: Excerpt, row: Any) -> dict[str, Any]:
        rows.append(row)
        if len(rows) == number:
            raise KeyboardInterrupt
        return written(self, row)

    with monkeypatch.context() as patch:
        patch.setattr(Excerpt, "of", interrupted)
        yield rows
    # an interrupted process ends without its threads; in this one they go on for a while
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()


def write_series(folder: Path, frames: int = FRAMES, edge: int = 4) -> Path:
    """Small frames of edge³ grains, squeezed along z a little more each time."""
    folder.mkdir()
    for frame in range(frames):
        rows = cubic_rows(edge, squeeze=1 - 0.005 * frame)
        text = dump_text(rows, step=100 * frame, box=((0, edge),) * 3)
        write(folder / f"dump_{100 * frame}.txt", text)
    return folder
