"""Work in several threads, processes or machines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

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
    """In the block, these workers do what threads would do."""
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
    alone = (lambda threads, job=job: job() for job in jobs)
    return shared_in_order(pool, alone, lambda: most, lambda number: 1)


def shared_in_order(
    pool: Executor,
    jobs: Iterator[Callable[[int], Result] | None],
    most: Callable[[], int],
    share: Callable[[int], int],
) -> Iterator[Result]:
    """
    The results of jobs that share threads, in the order of the jobs.

    Parameters
    ----------
    pool : Executor
        Does the jobs.
    jobs : iterator
        Each job is told how many threads it may use. None where the next one is not there yet: a
        result that is ready then comes meanwhile. If the jobs end in an error, the results of those
        under way come before it.
    most : callable
        How many may be under way.
    share : callable
        How many threads each of so many jobs may use.
    """
    waiting: deque[Future[Result]] = deque()
    ready: list[Result] = []
    over: Exception | None = None
    try:
        while waiting or ready or over is None:
            fresh, over = ([], over) if over else _taken(jobs, most() - len(waiting))
            threads = share(len(waiting) + len(fresh)) if fresh else 1
            waiting.extend(pool.submit(job, threads) for job in fresh)
            # the next jobs are begun before this, as whoever takes a result may be slow
            yield from ready
            ready.clear()
            if waiting and (waiting[0].done() or over or len(waiting) >= most()):
                try:
                    ready.append(waiting.popleft().result())
                except Exception:
                    # where the jobs have failed, this error has the same cause
                    if over is not None and not isinstance(over, StopIteration):
                        raise over from None
                    raise
        if not isinstance(over, StopIteration):
            raise over
    finally:
        # the pool may go on for others
        for future in waiting:
            future.cancel()


def _taken(jobs: Iterator[Job | None], room: int) -> tuple[list[Job], Exception | None]:
    """Jobs that are there, up to some number, and what ended them: StopIteration, or an error."""
    fresh: list[Job] = []
    try:
        while len(fresh) < room and (job := next(jobs)) is not None:
            fresh.append(job)
    except Exception as error:
        return fresh, error
    return fresh, None
