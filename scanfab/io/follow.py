"""follow_series(): read a series while a simulation writes it, each frame once it is complete."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any

from scanfab.base.errors import Note, PackingError, ReadError, collected, tell, warn
from scanfab.base.option import refuse_unknown, unusable
from scanfab.base.spelling import counted
from scanfab.io.families import Family, PathLike, expanded, files_of
from scanfab.io.files import Stamp, growing, stamp_of
from scanfab.io.frame import Frame
from scanfab.io.reader import READING, ReadOptions
from scanfab.io.series import ENDLESS, Series
from scanfab.io.sources import as_text, series_of

# seconds between two looks at the files, or PAUSES times the duration of the last look
PAUSE, PAUSES = 0.2, 3.0
# a file that has not changed for this many seconds is complete, if it can be read to its end
QUIET = 1.0


def follow_series(
    source: PathLike, *, seconds: float | None = None, **options: Any
) -> FollowedSeries:
    """
    Open a series that a simulation is still writing.

    Iterating over the series waits for its frames. A frame comes when its files are complete: they
    can be read to their end, and either have not changed for a second or a later frame exists. If a
    later frame is complete and a file is still broken, its frame comes as it is, and reading it
    raises the error. :func:`scanfab.compute` and :func:`scanfab.compute_file` take the series as
    any other, and give the same rows as for the finished series.

    Parameters
    ----------
    source : path
        A folder, which may be empty, or a file that grows.
    seconds : float, optional
        The series ends this many seconds after the last new frame, or after the start; by default
        it ends when ``end()`` is called.
    **options
        See :func:`scanfab.read_series`.

    Returns
    -------
    FollowedSeries
        Slices of it hold the frames that exist already.

    Raises
    ------
    ReadError
        If there is no such folder or file; later, if it vanishes, or if files appear that belong
        before frames that were already returned.
    SettingsError
        If an option has a value that cannot be used.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.follow_series("sample_data/liggghts_periodic", seconds=0)
    >>> [frame.step for frame in series]
    [30000, 60000, 90000, 120000, 150000]
    """
    refuse_unknown("follow_series", options, [*READING, "seconds"])
    if not isinstance(source, str | os.PathLike) or not Path(source).exists():
        raise ReadError(f"{source}: expected a folder or a file to follow, found nothing")
    if seconds is not None and not (isinstance(seconds, int | float) and seconds >= 0):
        raise unusable("seconds", "0 or more", seconds)
    return FollowedSeries(os.fspath(source), seconds, ReadOptions(**options))


State = tuple[Path, int, int, list[Path]]
"""The place of a frame (file, first byte, last byte) and its contact files; it must not change
after the frame was taken."""


class FollowedSeries(Series):
    """A series that waits for its frames; its files are those of the frames taken so far."""

    def __init__(self, source: str, seconds: float | None, options: ReadOptions) -> None:
        nothing = Family(source, {}, None, "grains")
        super().__init__(as_text(source), nothing, options=options, sources=(source,))
        self.idle: Callable[[], object] = lambda: None
        """Called each time there is no new frame, before waiting."""
        self._seconds = math.inf if seconds is None else seconds
        self._is_over = False
        self._taken: list[tuple[Frame, State]] = []
        self._since = time.monotonic()
        """When the last frame was taken."""
        self._seen: dict[Path, tuple[Stamp, float]] = {}
        """The last stamp of each file, and the time since when it has it."""
        self._looked: list[Any] = []
        """The files and their stamps when the series was last opened."""
        self._told: list[Note] = []
        """Notes from opening the files; they are shown once the first frame is taken."""
        self._problem: Exception | None = None
        """Why the source cannot be opened, or the next frame cannot be read."""

    def __repr__(self) -> str:
        return f"FollowedSeries {self.name}: {counted(len(self._taken), 'frame')} so far"

    def _every(self) -> Iterator[Frame]:
        return (frame for frame in self.as_they_come() if frame is not None)

    def as_they_come(self) -> Iterator[Frame | None]:
        """Iterate over the frames; gives None each time the next frame is not complete yet."""
        number = 0
        while True:
            begun = time.monotonic()
            if number == len(self._taken):
                self._take_next()
            if self._taken:
                tell(self._told)
                self._told = []
            if number < len(self._taken):
                yield self._taken[number][0]
                number += 1
            elif self._is_over:
                return
            else:
                self.idle()
                yield None
                time.sleep(max(PAUSE, PAUSES * (time.monotonic() - begun)))

    def end(self) -> None:
        """End the series: no more frames are taken."""
        self._is_over = True

    @property
    def as_it_is(self) -> Series:
        """The series of the files that exist now; it does not wait."""
        self._look()
        return self.whole

    @property
    def lack(self) -> str:
        """Why there is no frame yet."""
        return str(self._problem or f"{self.name}: no whole frame has come")

    def files(self, number: int = ENDLESS, known: Container[Path] = ()) -> Iterator[Path]:
        """The files of the frames that were taken; other files may be incomplete."""
        return super().files(min(number, len(self._taken) - 1), known)

    def _take_next(self) -> None:
        """Take the next frame if it, or a later frame, is complete."""
        if self._is_over and self._taken:
            return
        self._look()
        waiting = self._frames_of(self)[len(self._taken) :]
        ends = self._is_over or time.monotonic() - self._since >= self._seconds
        if not any(self._is_whole(frame, has_later=frame is not waiting[-1]) for frame in waiting):
            if not ends:
                return
            # the series ends: do not wait for contact files either
            self._seconds = 0.0
            if not any(map(self._can_be_read, waiting)):
                self._is_over = True
                for frame in waiting[:1]:
                    problem = f"left out, because it was incomplete at the end: {self._problem}"
                    warn(f"{frame.snapshot.path}: {problem}")
                if not waiting and self.grains.reader is not None:
                    # a snapshot that is cut is no frame: searched once more, its file says so
                    with suppress(ReadError):
                        self.grains.reader.snapshots(list(self.grains.files.values())[-1])
                return
        self._taken.append((waiting[0], _state(waiting[0].series, waiting[0])))
        self._since = time.monotonic()

    def _frames_of(self, series: Series) -> list[Frame]:
        """The frames of a series that exist now, complete or not."""
        with growing():
            return [] if series.grains.reader is None else list(series.whole)

    def _look(self) -> None:
        """Open the series again if files have changed; ReadError if it cannot be continued."""
        source = Path(self.sources[0])
        if not source.exists():
            problem = f"has vanished while it was followed, after {len(self._taken)} frames of it"
            raise ReadError(f"{source}: {problem}: bring it back and go on with `resume`")
        names = files_of(source)
        if (contacts := self.options.contacts) not in ("auto", "file", "geometric"):
            with suppress(ReadError):  # there may be none yet
                names += [file for path in expanded(contacts) for file in files_of(Path(path))]
        quiet = [self._quiet(path) for path in names]
        looked = [(path, self._seen.get(path)) for path in names]
        if looked == self._looked:
            return
        with collected() as self._told, growing():
            try:
                series = series_of(source, self.options)
            except (ReadError, OSError) as error:
                self._problem, series = error, None
        if series is not None:
            series.known = self.known
            self._check_taken(series)
            self.grains, self.contacts, self.cells = series.grains, series.contacts, series.cells
            self.contacts_from = series.contacts_from
            self._looked, self._problem = looked, None
        elif self._taken and min(quiet, default=QUIET) >= QUIET:
            raise ReadError(str(self._problem))

    def _check_taken(self, series: Series) -> None:
        """ReadError if the frames that were taken are no longer the first frames of the series."""
        frames = self._frames_of(series)[: len(self._taken)] if self._taken else []
        for (taken, old), frame in zip_longest(self._taken, frames):
            if frame is None or _state(series, frame) != old:
                problem = f"was read as frame {taken.number}, but since then files up to it"
                advice = "compute the finished folder without `follow`"
                raise ReadError(f"{old[0]}: {problem} have changed or appeared: {advice}")

    def _is_whole(self, frame: Frame, *, has_later: bool) -> bool:
        """Whether all files of a frame exist, are no longer being written, and can be read."""
        series, path = frame.series, frame.snapshot.path
        contacts = _contacts(series, frame)
        beside = [] if series.grains.kind == "index" else series.beside(path)
        files = [path, *beside, *filter(None, contacts)]
        quiet = min(map(self._quiet, files))
        if not all(contacts) or not (has_later or quiet >= QUIET):
            return False
        if has_later or frame.number:
            return self._can_be_read(frame)
        # as long as there is only one frame, contact files may still come, and the number in its
        # name may or may not be a step
        may_come = series.contacts_from in ("auto", "beside") and not series.contacts
        has_step = frame.step is not None or frame.name_step is None
        return has_step and self._can_be_read(frame, needs_contacts=may_come)

    def _can_be_read(self, frame: Frame, *, needs_contacts: bool = False) -> bool:
        try:
            with growing():
                packing = frame.read()
        except (ReadError, PackingError) as error:
            self._problem = error
            return False
        return packing.contacts is not None or not needs_contacts

    def _quiet(self, path: Path) -> float:
        """How many seconds a file has not changed; 0 if it does not exist."""
        try:
            stamp = stamp_of(path)
        except OSError:
            return 0.0
        if path not in self._seen or self._seen[path][0] != stamp:
            self._seen[path] = stamp, time.monotonic()
        return time.monotonic() - self._seen[path][1]


def _state(series: Series, frame: Frame) -> State:
    """The present state of a frame."""
    path, stop = frame.snapshot.path, frame.snapshot.stop
    if stop is None:
        stop = path.stat().st_size if path.exists() else 0
    return path, frame.snapshot.start, stop, [*filter(None, _contacts(series, frame))]


def _contacts(series: Series, frame: Frame) -> list[Path | None]:
    """The contact file of a frame in each contact family; None if it is missing or unreadable."""
    paths: list[Path | None] = []
    for family in series.contacts:
        snapshot = None
        with suppress(ReadError), growing():
            snapshot = series.contacts_of(frame, family)
        paths.append(None if snapshot is None else snapshot.path)
    return paths
