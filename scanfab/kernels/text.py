"""White space in a long text: whether a table has just one blank between two words."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.kernels.compiled import kernel

__all__ = ["BLANK", "count_spaces"]

# white space is what is not above it
BLANK = 32
# so many can be counted in a byte, of which vector instructions take more at a time
PIECE = 240


@kernel
def count_spaces(text: npt.NDArray[np.uint8]) -> tuple[int, int]:
    """How many of the bytes behind the first are white space, and how many follow another such."""
    spaces = pairs = np.int64(0)
    for start in range(0, text.size - 1, PIECE):
        some = more = np.uint8(0)
        for k in range(np.uint64(start), np.uint64(min(start + PIECE, text.size - 1))):
            space = np.uint8(text[k + np.uint64(1)] <= BLANK)
            some = np.uint8(some + space)
            more = np.uint8(more + (space & np.uint8(text[k] <= BLANK)))
        spaces += np.int64(some)
        pairs += np.int64(more)
    return int(spaces), int(pairs)
