"""Work in several threads, processes or machines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Generic, Protocol, TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
Job = TypeVar("Job")


class Spread(Protocol):
    """What the parts of one piece of work can be sent to, in place of threads."""

    def map(self, function: Callable[..., Any], parts: Sequence[Any]) -> list[Any]:
        """What the function makes of each part, in their order."""
        ...


_spread: ContextVar[Spread | None] = ContextVar("spread", default=None)


@contextmanager
def spread_over(workers: Spread) -> Iterator[None]:
    """In the block what would be done by threads is done by these workers."""
    token = _spread.set(workers)
    try:
        yield
    finally:
        _spread.reset(token)


def in_threads(
    function: Callable[[Part], Result], parts: Sequence[Part], threads: int
) -> list[Result]:
    """What a function makes of each part, in their order, by so many threads, or by workers."""
    workers = _spread.get()
    if threads == 1 or len(parts) == 1:
        return [function(part) for part in parts]
    if workers is not None:
        return workers.map(function, parts)
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(function, parts))


def in_order(pool: Executor, jobs: Iterator[Callable[[], Result]], most: int) -> Iterator[Result]:
    """The results in the order of the jobs, of which at most so many are under way."""

    def submit(job: Callable[[], Result], threads: int) -> Future[Result]:
        return pool.submit(job)

    return _in_order(_Work(submit, jobs, lambda: most, lambda number: 1))


def shared_in_order(
    pool: Executor,
    jobs: Iterator[Callable[[int], Result] | None],
    most: Callable[[], int],
    share: Callable[[int], int],
) -> Iterator[Result]:
    """
    The same of jobs that share threads, and that may still be to come.

    Parameters
    ----------
    pool : Executor
        Does them.
    jobs : iterator
        Each is told how many threads it may use. None where the next one is not there yet: then a
        result that is ready comes meanwhile. If they end in an error, what is under way comes
        before it.
    most : callable
        How many may be under way.
    share : callable
        How many threads each of so many jobs may use.
    """
    return _in_order(_Work(pool.submit, jobs, most, share))


def _in_order(work: _Work[Any, Result]) -> Iterator[Result]:
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


class _Work(Generic[Job, Result]):
    """Jobs under way."""

    def __init__(
        self,
        submit: Callable[[Job, int], Future[Result]],
        jobs: Iterator[Job | None],
        most: Callable[[], int],
        share: Callable[[int], int],
    ) -> None:
        self.submit, self.jobs, self.most, self.share = submit, jobs, most, share
        self.waiting: deque[Future[Result]] = deque()
        self.is_over = False
        self.error: Exception | None = None
        """What the jobs ended in."""

    @property
    def is_full(self) -> bool:
        """Whether there is nothing to begin before a result has come."""
        return self.is_over or len(self.waiting) >= self.most()

    def begin(self) -> None:
        """Begin as many jobs as may be under way, of those that are there."""
        fresh: list[Job] = []
        most = self.most()
        while not self.is_over and len(self.waiting) + len(fresh) < most:
            job = self._next()
            if job is None:
                break
            fresh.append(job)
        threads = self.share(len(self.waiting) + len(fresh)) if fresh else 1
        self.waiting.extend(self.submit(job, threads) for job in fresh)

    def _next(self) -> Job | None:
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
