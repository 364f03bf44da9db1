"""Snapshots of contacts by step, or by time where there are no steps."""

from __future__ import annotations

from pathlib import Path

import pytest

from scanfab.io.moments import of_moment
from scanfab.io.reader import Snapshot

PATH = Path("a")


def at(step=None, time=None):
    return Snapshot(PATH, step, time)


@pytest.mark.parametrize(
    ("listed", "grains", "sure", "expected"),
    [
        ([at(1), at(2)], at(2), False, at(2)),
        ([at(1), at(2)], at(3), True, None),
        ([at(1, 0.5), at(2, 0.7)], at(1, 0.7), True, at(1, 0.5)),
        ([at(time=0.1), at(time=0.2)], at(time=0.2), False, at(time=0.2)),
        ([at(time=0.1), at(time=0.2)], at(time=0.15), True, None),
        # programs write times with different digits
        ([at(time=0.1000001)], at(time=0.1), True, at(time=0.1000001)),
        ([at(time=0.2)], at(time=0.1), True, None),
        # nobody knows: files that belong together have one frame each
        ([at()], at(), True, at()),
        ([at()], at(), False, None),
        ([at()], at(time=0.1), True, at()),
        ([at(), at()], at(), True, None),
        ([at(5)], at(time=0.1), True, at(5)),
    ],
)
def test_which_snapshot_is_of_the_same_moment(listed, grains, sure, expected):
    assert of_moment(listed, grains, sure) == expected
