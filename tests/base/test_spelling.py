"""Numbers in messages, beside the examples of the functions."""

import pytest

from scanfab.base.spelling import spelt_apart


@pytest.mark.parametrize(
    ("value", "limit", "spelt"),
    [
        (0.0013, 0.001, ("0.0013", "0.001")),
        (1.0, 1.0000001, ("1", "1.0000001")),
        (0.25, 0.25, ("0.25", "0.25")),
        (float("inf"), 1e-4, ("inf", "0.0001")),
    ],
)
def test_numbers_that_differ_are_spelt_so_that_they_do(value, limit, spelt):
    assert spelt_apart(value, limit) == spelt
