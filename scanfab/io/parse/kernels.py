"""White space in a long text: whether one blank stands between two words, and making it so."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.base.jit import inner, kernel

# white space is what is not above a blank
BLANK, LINE_END, TAB, RETURN = 32, 10, 9, 13
# so many can be counted in a byte, of which vector instructions take more at a time
PIECE = 240


@kernel
def count_spaces(text: npt.NDArray[np.uint8]) -> tuple[int, int, int]:
    """
    White space of a text that begins behind a line end.

    How many bytes of it there are, how many of these follow another, and how many of those are line
    ends that follow a blank.
    """
    spaces = pairs = np.int64(text.size > 0 and text[0] <= BLANK)
    ends = np.int64(0)
    for start in range(0, text.size - 1, PIECE):
        some = more = most = np.uint8(0)
        for k in range(np.uint64(start), np.uint64(min(start + PIECE, text.size - 1))):
            before, here = text[k], text[k + np.uint64(1)]
            some = np.uint8(some + np.uint8(here <= BLANK))
            more = np.uint8(more + (np.uint8(here <= BLANK) & np.uint8(before <= BLANK)))
            most = np.uint8(most + (np.uint8(here == LINE_END) & np.uint8(before == BLANK)))
        spaces += np.int64(some)
        pairs += np.int64(more)
        ends += np.int64(most)
    return int(spaces), int(pairs), int(ends)


@kernel
def single_blanks(text: npt.NDArray[np.uint8], out: npt.NDArray[np.uint8]) -> int:
    """
    Copy a text with one blank between two words of a line, and none around them.

    Returns how many bytes that makes; empty lines stay. -1 if there are other bytes below a blank
    than tabs and line ends, which no parser takes for blanks.
    """
    # numbers without a sign, which are not looked at for places from the end
    place, size, one = np.uint64(0), np.uint64(0), np.uint64(1)
    stop = np.uint64(text.size)
    has_words = False
    while True:
        place = _behind_blanks(text, place)
        if place >= stop:
            return int(np.int64(size))
        if text[place] == LINE_END:
            out[size] = LINE_END
            size, place = size + one, place + one
            has_words = False
        elif text[place] < BLANK:
            return -1
        else:
            if has_words:
                out[size] = BLANK
                size += one
            has_words = True
            while place < stop and text[place] > BLANK:
                out[size] = text[place]
                size, place = size + one, place + one


@inner()
def _behind_blanks(text: npt.NDArray[np.uint8], place: np.uint64) -> np.uint64:
    """The first byte from a place on that is no blank, tab or return before a line end."""
    stop, one = np.uint64(text.size), np.uint64(1)
    while place < stop:
        byte = text[place]
        if byte == RETURN:
            behind = text[place + one] if place + one < stop else LINE_END
            if behind not in (RETURN, LINE_END):
                return place
        elif byte not in (BLANK, TAB):
            return place
        place += one
    return place
