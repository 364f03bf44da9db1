"""How many steps the lines of a scan may be followed, all its threads together."""

from __future__ import annotations

import threading

from scanfab.base.errors import SettingsError

# steps of following lines through a periodic medium: more take minutes
MOST_STEPS = 1e10


class FollowedTooFarError(SettingsError):
    """To follow the lines of a scan through a periodic medium takes more steps than allowed."""


class Following:
    """
    The steps that following the lines of a scan has taken, of all its threads together.

    Whether they are too many does not depend on the threads: no part of a scan takes any back.
    """

    def __init__(self, most: float) -> None:
        self.most = most
        self._taken = 0.0
        self._lock = threading.Lock()

    @property
    def left(self) -> float:
        """How many more are allowed."""
        return self.most - self._taken

    def add(self, steps: float) -> None:
        """
        Count the steps of a part of the scan.

        Raises
        ------
        FollowedTooFarError
            If they are too many.
        """
        with self._lock:
            self._taken += steps
        self.check(self._taken)

    def __reduce__(self) -> tuple[type, tuple[float]]:
        # another process counts its own; whoever adds up all parts checks their sum
        return Following, (self.most,)

    def check(self, taken: float) -> None:
        """FollowedTooFarError if so many steps are too many."""
        if taken >= self.most:
            raise FollowedTooFarError(
                f"void segments that leave the cell are long: following them through its images "
                f"takes more than {self.most:.2g} steps. Much of the cell is empty, or a variant "
                f"keeps few grains: check the cell's size (`cell`) and its periodic axes "
                f"(`periodic`), choose a wider `spacing` or other `variants`, or allow more "
                f"(`max_chords`)"
            )
