"""Runs of the command line that are interrupted at random moments, and resumed until they end."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import pytest

from scanfab.table.writing import Excerpt
from tests.helpers.dumps import cubic_rows, dump_text, write

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
PROGRAM = [sys.executable, "-c", "from scanfab.cli.main import main; main()"]
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


@dataclass
class Interrupter:
    """Runs one command to its end, again and again stopped by a signal."""

    series: Path
    options: tuple[str, ...]
    random: Random
    codes: Counter[int] = field(default_factory=Counter)
    """Exit codes of the interrupted processes; of those that were faster than the signal too."""

    def command(self, output: Path) -> list[str]:
        """What computes the series, with a random number of workers, which changes nothing."""
        workers = str(self.random.choice((1, 2, 3)))
        words = ["compute", str(self.series), *self.options, "-o", str(output)]
        return [*PROGRAM, *words, "--workers", workers]

    def whole(self, output: Path) -> tuple[bytes, float]:
        """The bytes of a run that nobody interrupts, and its seconds."""
        start = time.perf_counter()
        subprocess.run(self.command(output), check=True, capture_output=True)
        return output.read_bytes(), time.perf_counter() - start

    def interrupted(self, output: Path, seconds: float, times: int) -> bytes:
        """The bytes of a run that was stopped some times within so many seconds, and resumed."""
        for _ in range(times):
            sent = self.random.choice(SIGNALS)
            code = self._stopped(output, sent, self.random.uniform(0, seconds))
            self.codes[code] += 1
            # what is there is complete: the signal came while the process was ending
            if output.exists():
                return output.read_bytes()
            assert code != 0
        words = [*self.command(output), "--resume"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        left = {path.name for path in output.parent.iterdir()}
        assert left == {output.name, f"{output.name}.manifest.json"}
        return output.read_bytes()

    def _stopped(self, output: Path, sent: signal.Signals, delay: float) -> int:
        """The exit code of a process that gets a signal."""
        words = [*self.command(output), "--resume"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            try:
                process.communicate(timeout=delay)
            except subprocess.TimeoutExpired:
                process.send_signal(sent)
                process.communicate(timeout=60)
        return process.returncode
