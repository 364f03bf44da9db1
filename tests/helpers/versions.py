"""
What another version of the program reads, in an environment of its own.

This file is also the program that reads there: it gets a list of files as JSON, and prints a line
of JSON for each.
"""

from __future__ import annotations

import faulthandler
import hashlib
import json
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BASE = "f055af2"
"""The commit that had every feature, and every number checked, before the code was halved."""
SECONDS = 120


class Reading(NamedTuple):
    """A source, how it is read, and where and in which format its last frame is written first."""

    source: str
    options: dict[str, Any] = {}  # noqa: RUF012
    converted: tuple[str, str] | None = None


Answer = list[dict[str, str]] | str
"""The packings that were read, as digests; or the name of the error."""


def installed_base(commit: str, kept: Path) -> Path:
    """The Python of an environment with a commit; made where it is not."""
    checkout, python = kept / commit, kept / f"{commit}-env" / "bin" / "python"
    if not checkout.is_dir():
        subprocess.run(["git", "clone", "--quiet", ROOT, checkout], check=True)
        subprocess.run(["git", "-C", checkout, "checkout", "--quiet", commit], check=True)
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", python.parents[1]], check=True)
        words = ["-m", "pip", "install", "--quiet", f"{checkout}[test]"]
        subprocess.run([python, *words], check=True)
    return python


def answers(python: Path, readings: Sequence[Reading]) -> list[Answer]:
    """How each reading ends; if its process dies, another process goes on behind the file."""
    found: list[Answer] = []
    while len(found) < len(readings):
        done = subprocess.run(
            [python, "-P", __file__], input=json.dumps(readings[len(found) :]), cwd=ROOT,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False,
        )  # fmt: skip
        found += map(json.loads, done.stdout.splitlines())
        if done.returncode:
            found.append(f"FAILED the process ended with {done.returncode}")
    return found


def digest(value: Any) -> str:
    """An array by its kind, shape and bytes, for integers of any width; anything else as text."""
    if isinstance(value, np.ndarray):
        value = value.astype({"O": str, "i": np.int64}.get(value.dtype.kind, value.dtype))
        content = np.ascontiguousarray(value).tobytes()
        return f"{value.dtype} {value.shape} {hashlib.sha256(content).hexdigest()[:16]}"
    return repr(value)


def packed(packing: Any) -> dict[str, str]:
    """All that a packing holds, as digests."""
    held = {f"column {name}": values for name, values in sorted(packing.columns.items())}
    for kind, thing, names in (
        ("", packing, "position radius id wall_contacts step time"),
        ("", packing.space, "dimension"),
        ("contacts ", packing.contacts, "pairs image normal point force force_n source"),
        ("cell ", packing.cell, "vectors origin periodic"),
    ):
        if thing is not None:
            held |= {f"{kind}{name}": getattr(thing, name) for name in names.split()}
    return {name: digest(value) for name, value in held.items()}


def answer(reading: Reading) -> Answer:
    """Read with the scanfab of this interpreter."""
    import scanfab

    source = reading.source
    try:
        if reading.converted:
            source, name = reading.converted
            Path(source).parent.mkdir(parents=True, exist_ok=True)
            packing = scanfab.read_series(reading.source)[-1].read()
            scanfab.convert(packing, source, to=name)
        return [packed(frame.read()) for frame in scanfab.read_series(source, **reading.options)]
    except scanfab.ScanfabError as error:
        return type(error).__name__
    except BaseException as error:
        return f"FAILED {type(error).__name__}: {error}"[:200]


def too_long(*_: object) -> None:
    """Handle the alarm."""
    raise TimeoutError


if __name__ == "__main__":
    signal.signal(signal.SIGALRM, too_long)
    for one in json.load(sys.stdin):
        signal.alarm(SECONDS)
        # compiled code sees no signal: then the process ends
        faulthandler.dump_traceback_later(2 * SECONDS, exit=True)
        print(json.dumps(answer(Reading(*one))), flush=True)
        signal.alarm(0)
        faulthandler.cancel_dump_traceback_later()
