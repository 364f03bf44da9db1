"""Numbers in messages."""

from __future__ import annotations

import pytest

from scanfab.base.spelling import spelt_apart, spelt_time


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "1 s"), (99.4, "99 s"), (100.0, "2 min"), (5990.0, "100 min"), (7200.0, "2.0 h")],
)
def test_times_are_spelt_in_the_unit_that_fits(seconds, text):
    assert spelt_time(seconds) == text


@pytest.mark.parametrize(
    ("value", "limit", "spelt"),
    [
        (0.0010004, 0.001, ("0.0010004", "0.001")),
        (0.0013, 0.001, ("0.0013", "0.001")),
        (1.0, 1.0000001, ("1", "1.0000001")),
        (0.25, 0.25, ("0.25", "0.25")),
        (float("inf"), 1e-4, ("inf", "0.0001")),
    ],
)
def test_numbers_that_differ_are_spelt_so_that_they_do(value, limit, spelt):
    assert spelt_apart(value, limit) == spelt
