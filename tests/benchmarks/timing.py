"""Interleaved runs of several ways to do a thing, and tables of their times."""

import gc
import random
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

ENOUGH = 10.0


def interleaved(
    ways: Mapping[str, Callable[[], Any]],
    repeats: int,
    warm: bool = True,
    clock: Callable[[], Any] | None = time.perf_counter,
) -> dict[str, float]:
    """
    Median seconds of each way; ways take turns, so that all share the machine's moods.

    Each turn has an order of its own, as a run also feels what the one before it left in caches.
    Ways that take milliseconds have more turns, until the median is not a matter of luck. What runs
    in one thread is measured by ``time.process_time``: other work on the machine matters less.
    Without a clock each way returns its own seconds.
    """
    if warm:
        for way in ways.values():
            way()
    seconds: dict[str, list[Any]] = {name: [] for name in ways}
    began, turns, order = time.perf_counter(), 0, random.Random(0)
    while turns < repeats or (warm and time.perf_counter() - began < ENOUGH):
        turns += 1
        for name in order.sample(list(ways), len(ways)):
            gc.collect()
            start = clock() if clock else 0.0
            answer = ways[name]()
            seconds[name].append(clock() - start if clock else answer)
    return {name: float(np.median(values)) for name, values in seconds.items()}


def table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
