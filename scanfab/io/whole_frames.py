"""Whether the frames of a series that is still being written are whole."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.families import Family
from scanfab.io.frame import Frame
from scanfab.io.parse.growing import growing
from scanfab.io.series import Series
from scanfab.packing.packing import Packing

# a file that has been as it is for so many seconds is whole, if it can be read to its end
QUIET = 1.0
# one that was written so long ago need not be watched, whatever the clock of its server says
OLD = 60.0


@dataclass(frozen=True, repr=False)
class WholeFrame(Frame):
    """A frame that was read to see whether it is whole; other processes read it again."""

    packing: Packing | None = None

    def read(self) -> Packing:
        return super().read() if self.packing is None else self.packing

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "packing": None}


class Watch:
    """Since when files have been as they are."""

    def __init__(self) -> None:
        self._seen: dict[Path, tuple[tuple[int, int], float]] = {}

    def has_changed(self, paths: Sequence[Path]) -> bool:
        """Whether one of them is new, or not as at the last look."""
        # all of them are looked at, for the next time
        changed = [self._look(path)[1] for path in paths]
        return any(changed)

    def is_quiet(self, path: Path) -> bool:
        """Whether a file is there and has been as it is for a while."""
        found, _ = self._look(path)
        if found is None:
            return False
        quiet = time.monotonic() - self._seen[path][1] >= QUIET
        return quiet or time.time() - found.st_mtime > OLD

    def _look(self, path: Path) -> tuple[os.stat_result | None, bool]:
        try:
            found = path.stat()
        except OSError:
            return None, self._seen.pop(path, None) is not None
        stamp = found.st_size, found.st_mtime_ns
        is_new = path not in self._seen or self._seen[path][0] != stamp
        if is_new:
            self._seen[path] = stamp, time.monotonic()
        return found, is_new


class Wholeness:
    """Which frames can be taken."""

    def __init__(self) -> None:
        self.watch = Watch()
        self.flaw: Exception | None = None
        """What was wrong with the last frame that was not whole."""

    def whole(self, frame: Frame, has_later: bool) -> WholeFrame | None:
        """The frame with its packing, if its files are whole, or nothing."""
        files = self._files(frame)
        quiet = [self.watch.is_quiet(path) for path in files]
        if not (has_later or all(quiet)) or not self.has_contacts(frame):
            return None
        found = self.read(frame)
        if found is None or found.packing is None:
            return None
        # of the first frame alone nobody knows whether contact files will come
        is_sure = has_later or frame.number or frame.series.contacts or found.packing.contacts
        may_come = frame.series.contacts_from in ("auto", "beside")
        return found if is_sure or not may_come else None

    def read(self, frame: Frame) -> WholeFrame | None:
        """The frame with its packing, if that can be read."""
        try:
            with growing():
                return WholeFrame(**vars(frame), packing=frame.read())
        except (ReadError, PackingError) as error:
            self.flaw = error
            return None

    def is_old(self, frame: Frame) -> bool:
        """Whether nobody is writing a frame any more."""
        try:
            youngest = max(path.stat().st_mtime for path in self._files(frame))
        except OSError:
            return False
        return time.time() - youngest > OLD and self.has_contacts(frame)

    def _files(self, frame: Frame) -> list[Path]:
        """What a frame is read from, as far as it is there."""
        series, path = frame.series, frame.snapshot.path
        found = [self.contacts(series, frame, family) for family in series.contacts]
        beside = [] if series.grains.kind == "index" else series.beside(path)
        parts = frame.snapshot.parts
        return [path, *parts, *beside, *(one for one in found if one is not None)]

    def has_contacts(self, frame: Frame) -> bool:
        """Whether the frame has a file in each family of contacts."""
        families = frame.series.contacts
        return all(self.contacts(frame.series, frame, one) is not None for one in families)

    def contacts(self, series: Series, frame: Frame, family: Family) -> Path | None:
        """The contact file of a frame in a family, if it is there and can be looked into."""
        try:
            with growing():
                found = series._contacts_of(frame, family)
        except ReadError:
            return None
        return None if found is None else found.path
