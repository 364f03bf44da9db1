"""Results come in the order of the jobs, and few jobs are under way."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from scanfab.pipeline.compute import shared_in_order


def in_order(pool, jobs, most):
    return shared_in_order(pool, jobs, lambda: most, lambda number: number)


@pytest.mark.parametrize("most", [1, 3, 20])
def test_results_are_in_the_order_of_the_jobs(most):
    last = threading.Event()

    def job(number, threads):
        assert threads <= most
        # the first of several ends after the others that are under way
        if number == 0 and most > 1:
            assert last.wait(10)
        if number == min(most, 10) - 1:
            last.set()
        return number

    with ThreadPoolExecutor(20) as pool:
        jobs = (lambda threads, k=k: job(k, threads) for k in range(10))
        assert list(in_order(pool, jobs, most)) == list(range(10))
        assert list(in_order(pool, iter(()), most)) == []


def test_jobs_are_taken_as_results_are_and_their_error_comes_last():
    taken = []

    def jobs():
        for number in range(5):
            taken.append(number)
            yield lambda threads, number=number: number
        raise ValueError("no more")

    with ThreadPoolExecutor(2) as pool:
        found = in_order(pool, jobs(), 3)
        assert [next(found), taken] == [0, [0, 1, 2, 3]]
        assert [next(found) for _ in range(4)] == [1, 2, 3, 4]
        with pytest.raises(ValueError, match="no more"):
            next(found)
