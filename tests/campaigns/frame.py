"""What the campaigns share: their options, and runs that are counted."""

from __future__ import annotations

import argparse
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

SAMPLE_DATA = Path(__file__).parents[2] / "sample_data"


def asked(doc: str | None, **defaults: Any) -> argparse.Namespace:
    """
    The options of a campaign, named with their defaults: ``seeds=40`` makes ``--seeds N``.

    Of a list or dict some words can be chosen, by default all. An option whose default is a type,
    such as Path, is an argument that must be there.
    """
    parser = argparse.ArgumentParser(description=(doc or "").strip().splitlines()[0])
    for name, default in defaults.items():
        option = f"--{name.replace('_', '-')}"
        if isinstance(default, type):
            parser.add_argument(name, type=default)
        elif isinstance(default, dict | list | tuple):
            parser.add_argument(option, nargs="+", default=[*default])
        elif isinstance(default, bool):
            parser.add_argument(option, action="store_true")
        else:
            parser.add_argument(option, type=type(default), default=default)
    return parser.parse_args()


def count_wrong(what: str, runs: int, fault_of: Callable[[int], str | None]) -> int:
    """How many runs are wrong: those whose number gives a fault, in words; all are printed."""
    wrong = 0
    for number in range(runs):
        fault = fault_of(number)
        wrong += fault is not None
        print(f"{what}, run {number + 1}: {fault or 'the same bytes'}", flush=True)
    print(f"{what}: {runs} runs, {wrong} wrong", flush=True)
    return wrong


def ended(process: subprocess.Popen[str], seconds: float = 120.0) -> tuple[int, str]:
    """Exit code and messages of a process, which is killed if it takes too long."""
    watch = threading.Timer(seconds, process.kill)
    watch.start()
    _, said = process.communicate()
    watch.cancel()
    return process.returncode, said
