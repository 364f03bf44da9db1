"""Work in several threads."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

__all__ = ["in_order"]

Result = TypeVar("Result")


def in_order(
    pool: ThreadPoolExecutor, jobs: Iterator[Callable[[], Result]], most: int
) -> Iterator[Result]:
    """The results in the order of the jobs, of which at most so many are under way."""
    waiting = deque(pool.submit(job) for job in islice(jobs, most))
    while waiting:
        result = waiting.popleft().result()
        # whoever takes the result may be slow
        waiting.extend(pool.submit(job) for job in islice(jobs, 1))
        yield result
