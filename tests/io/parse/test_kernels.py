"""White space is counted as the words of the text say, whatever the length."""

import random

import numpy as np
import pytest

from scanfab.io.parse.kernels import PIECE, count_spaces
from tests.helpers.uncompiled import run_uncompiled


def counted(text):
    """In plain words: spaces, those that follow another or begin the text, and ' \\n'."""
    spaces = [place for place, byte in enumerate(text) if byte in b" \t\r\n\v\f"]
    follow = sum(place == 0 or text[place - 1] in b" \t\r\n\v\f" for place in spaces)
    return len(spaces), follow, text.count(b" \n")


def assert_counts_are_right(size, seed):
    generator = random.Random(seed)
    share = generator.random()
    text = bytes(
        generator.choice(b" \n\t\r\v\f" if generator.random() < share else b"0129.e+-z")
        for _ in range(size)
    )
    found = count_spaces(np.frombuffer(text, np.uint8))
    assert found == counted(text)


@pytest.mark.parametrize("seed", range(20))
def test_white_space_is_counted(seed):
    for size in (0, 1, 2, PIECE - 1, PIECE, PIECE + 1, PIECE + 2, 3 * PIECE + 1, 2000):
        assert_counts_are_right(size, seed)


def test_nothing_but_blanks_does_not_overflow():
    size = 10 * PIECE + 1
    assert count_spaces(np.full(size, 32, np.uint8)) == (size, size, 0)


def test_white_space_is_counted_uncompiled():
    run_uncompiled(
        "from tests.io.parse.test_kernels import assert_counts_are_right\n"
        "for seed in range(5): assert_counts_are_right(700, seed)"
    )
