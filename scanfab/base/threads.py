"""Work in several threads, or processes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from itertools import islice
from typing import TypeVar

__all__ = ["in_order"]

Result = TypeVar("Result")


def in_order(pool: Executor, jobs: Iterator[Callable[[], Result]], most: int) -> Iterator[Result]:
    """The results in the order of the jobs, of which at most so many are under way."""
    waiting = deque(pool.submit(job) for job in islice(jobs, most))
    try:
        while waiting:
            result = waiting.popleft().result()
            # whoever takes the result may be slow
            waiting.extend(pool.submit(job) for job in islice(jobs, 1))
            yield result
    finally:
        # the pool may go on for others
        for job in waiting:
            job.cancel()
