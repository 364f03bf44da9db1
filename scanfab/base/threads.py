"""Work in several threads, or processes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from typing import Generic, TypeVar

__all__ = ["in_order"]

Result = TypeVar("Result")
Job = Callable[[int], Result]
"""What is to be done by so many threads."""


def in_order(
    pool: Executor, jobs: Iterator[Job[Result] | None], most: int, shares: bool = True
) -> Iterator[Result]:
    """
    The results in the order of the jobs, of which at most so many are under way.

    A job may be None where the next one is not there yet: then a result that is ready comes
    meanwhile. Each job is told how many threads it may use: its share of `most`, or one. Where the
    jobs end in an error, what is under way comes before it.
    """
    work = _Work(pool, jobs, most, shares)
    try:
        work.begin()
        while work.waiting or not work.is_over:
            if work.waiting and (work.waiting[0].done() or work.is_full):
                result = work.first()
                # whoever takes the result may be slow
                work.begin()
                yield result
            else:
                work.begin()
        if work.error is not None:
            raise work.error
    finally:
        # the pool may go on for others
        for job in work.waiting:
            job.cancel()


class _Work(Generic[Result]):
    """Jobs under way."""

    def __init__(
        self, pool: Executor, jobs: Iterator[Job[Result] | None], most: int, shares: bool
    ) -> None:
        self.pool, self.jobs, self.most, self.shares = pool, jobs, most, shares
        self.waiting: deque[Future[Result]] = deque()
        self.is_over = False
        self.error: Exception | None = None
        """What the jobs ended in."""

    @property
    def is_full(self) -> bool:
        """Whether there is nothing to begin before a result has come."""
        return self.is_over or len(self.waiting) >= self.most

    def begin(self) -> None:
        """Begin as many jobs as may be under way, of those that are there."""
        fresh: list[Job[Result]] = []
        while not self.is_over and len(self.waiting) + len(fresh) < self.most:
            job = self._next()
            if job is None:
                break
            fresh.append(job)
        threads = max(self.most // max(len(self.waiting) + len(fresh), 1), 1)
        for job in fresh:
            self.waiting.append(self.pool.submit(job, threads if self.shares else 1))

    def _next(self) -> Job[Result] | None:
        try:
            return next(self.jobs)
        except StopIteration:
            self.is_over = True
        except Exception as error:
            self.is_over, self.error = True, error
        return None

    def first(self) -> Result:
        """The first result; where the jobs have failed, what it lacks has the same cause."""
        try:
            return self.waiting.popleft().result()
        except Exception:
            if self.error is not None:
                raise self.error from None
            raise
