"""Which spheres are one grain, frame by frame: what to tell where that is not as it was."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scanfab.base.errors import Note
from scanfab.base.spelling import counted
from scanfab.base.typing import IntArray
from scanfab.packing.packing import Packing


class Grouping(NamedTuple):
    """The spheres of a frame, those of one body by one number."""

    id: IntArray
    """Shape (N,): as the dump numbers the spheres."""
    body: IntArray
    """Shape (N,): the id of the first sphere of each one's body."""

    @property
    def grains(self) -> int:
        """How many bodies there are, those of one sphere among them."""
        return len(np.unique(self.body))

    def in_words(self) -> str:
        """How many grains there are, of how many spheres."""
        return f"{counted(self.grains, 'grain')} of {counted(len(self.id), 'sphere')}"


def grouping_of(packing: Packing) -> Grouping | None:
    """That of a frame; None if each sphere is a grain."""
    if packing.bodies is None:
        return None
    return Grouping(packing.id, packing.id[packing.bodies.head])


class Groupings:
    """The groupings of a series' frames, each held against the first; what differs is told once."""

    def __init__(self) -> None:
        self._first: tuple[int, Grouping] | None = None
        self._told: set[str] = set()

    def notes(self, number: int, grouping: Grouping | None) -> list[Note]:
        """What to tell once that of one more frame is known."""
        if grouping is None:
            return []
        if self._first is None:
            self._first = number, grouping
            return []
        first, before = self._first
        found = _difference(first, before, grouping)
        if found is None or found.code in self._told:
            return []
        self._told.add(found.code)
        return [found]


def _difference(first: int, before: Grouping, now: Grouping) -> Note | None:
    common, early, late = np.intersect1d(before.id, now.id, return_indices=True)
    one, two = before.body[early], now.body[late]
    both = len(np.unique(np.column_stack([one, two]), axis=0))
    # the numbers of bodies may be others, as long as the same spheres are one
    if both == len(np.unique(one)) == len(np.unique(two)):
        if len(common) == len(before.id) == len(now.id):
            return None
        text = (
            f"{now.in_words()}, where frame {first} has {before.in_words()}: grains have left or "
            f"come in (told once)"
        )
        return Note("grains_left", text)
    text = (
        f"other spheres are one body than in frame {first}: each frame is computed with its own "
        f"bodies; is the column that numbers them the right one (`bodies`)? (told once)"
    )
    return Note("other_bodies", text)
