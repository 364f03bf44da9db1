"""Results come in the order of the jobs, and few jobs are under way."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from scanfab.base.threads import in_order


@pytest.mark.parametrize("most", [1, 3, 20])
def test_results_are_in_the_order_of_the_jobs(most):
    last = threading.Event()

    def job(number):
        # the first of several ends after the others that are under way
        if number == 0 and most > 1:
            assert last.wait(10)
        if number == min(most, 10) - 1:
            last.set()
        return number

    with ThreadPoolExecutor(20) as pool:
        assert list(in_order(pool, (partial(job, k) for k in range(10)), most)) == list(range(10))


def test_jobs_are_taken_as_results_are():
    taken = []

    def jobs():
        for number in range(10):
            taken.append(number)
            yield partial(int, number)

    with ThreadPoolExecutor(2) as pool:
        found = in_order(pool, jobs(), 3)
        assert next(found) == 0
        assert taken == [0, 1, 2, 3]
        assert next(found) == 1
        assert taken == [0, 1, 2, 3, 4]


def test_without_jobs_there_is_nothing():
    with ThreadPoolExecutor(1) as pool:
        assert list(in_order(pool, iter(()), 4)) == []
