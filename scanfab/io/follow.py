"""follow_series(): a series that grows while it is read, each frame as soon as it is whole."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabWarning, SettingsError
from scanfab.base.option import refuse_unknown, unusable
from scanfab.io.families import Family, PathLike, files_in
from scanfab.io.frame import Frame
from scanfab.io.options import take_reading
from scanfab.io.parse.growing import growing
from scanfab.io.series import Series
from scanfab.io.sources import READING, as_text, read_series
from scanfab.io.whole_frames import QUIET, Watch, WholeFrame, Wholeness

# seconds between two looks, or times what a look takes
PAUSE, PAUSES = 0.2, 3.0


def follow_series(
    source: PathLike, *, seconds: float | None = None, **options: Any
) -> FollowedSeries:
    """
    Open a series that a simulation is still writing.

    Going through it waits for its frames: each comes once its files are whole, that is, they can be
    read to their end and have not changed for a second, or a later frame is there. A file that is
    still broken when a later frame is whole comes as it is, for whoever reads it to stop or to pass
    it over. :func:`scanfab.compute` and :func:`scanfab.compute_file` take it as any other series,
    and make the rows of a run over the finished one.

    Parameters
    ----------
    source : path
        A folder, which may be empty, or a file that grows.
    seconds : float, optional
        It ends so long after the last new frame, or the start; otherwise when ``end()`` is called.
    **options
        See :func:`scanfab.read_series`.

    Returns
    -------
    FollowedSeries
        Its slices are those of the frames that are there already.

    Raises
    ------
    ReadError
        If there is no such folder or file; while frames are waited for, if it vanishes, or if files
        come that belong before frames that were taken.
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
    return FollowedSeries(_Follower(os.fspath(source), seconds, take_reading(dict(options))))


class FollowedSeries(Series):
    """Frames that are waited for; what is told of its files is told of those of taken frames."""

    _follower: _Follower

    def __init__(self, follower: _Follower) -> None:
        name = as_text(follower.source)
        nothing = Family(name, {}, None, "grains")
        super().__init__(name, nothing, sources=(follower.source,), reading=follower.reading)
        vars(self)["_follower"] = follower
        follower.opened = self._take_over

    def __repr__(self) -> str:
        return f"FollowedSeries {self.name}: {len(self._follower.taken)} frames so far"

    def _take_over(self, series: Series) -> None:
        """What is known of the files now."""
        own = {name: vars(self)[name] for name in ("name", "sources", "reading", "_follower")}
        vars(self).update({**vars(series), **own})

    def _every(self) -> Iterator[Frame]:
        return (frame for frame in self.as_they_come() if frame is not None)

    def as_they_come(self) -> Iterator[Frame | None]:
        """The frames; None, after a moment, where the next one is not there yet."""
        return self._follower.coming()

    def end(self) -> None:
        """Take no more frames."""
        self._follower.is_over = True

    @property
    def as_it_is(self) -> Series:
        """The series of what is there now, which is not waited for."""
        self._follower.look()
        return self._with(self.numbers)

    @property
    def lack(self) -> str:
        """Why there is no frame yet."""
        return str(self._follower.problem or f"{self.name}: no whole frame has come")

    def when_idle(self, call: Callable[[], object]) -> None:
        """Call this each time that there is nothing to do but to wait."""
        self._follower.idle = call

    def frames_expected(self) -> int:
        """Those that have come."""
        return len(self._follower.taken)

    def files(self) -> Iterator[Path]:
        """Those of the frames that were taken: others may be in the middle of being written."""
        if not self._follower.taken:
            return
        for path, is_grains in self.files_through(len(self._follower.taken) - 1):
            yield path
            if is_grains:
                yield from self.beside(path)
        if self.cells is not None:
            yield self.cells.path


class _Follower:
    """Which frames of a source have been taken, and which is the next."""

    def __init__(self, source: str, seconds: float | None, reading: dict[str, Any]) -> None:
        self.source = source
        self.seconds = seconds
        self.reading = reading
        self.is_over = False
        self.taken: list[Frame] = []
        self.problem: ReadError | None = None
        """Why the source cannot be opened yet."""
        self.opened: Callable[[Series], None] = lambda series: None
        self.idle: Callable[[], object] = lambda: None
        self._series: Series | None = None
        self._names: list[Path] = []
        self._wholeness, self._opening = Wholeness(), Watch()
        self._sizes: dict[Path, int] = {}
        """Of the files of taken frames."""
        self._alone: list[Frame] = []
        """Taken frames that had no contact file."""
        self._told: list[Warning] = []
        self._since = time.monotonic()

    def coming(self) -> Iterator[Frame | None]:
        """All frames from the first on, those that come too; None while there is none."""
        number = 0
        while True:
            begun = time.monotonic()
            frame = self._frame(number)
            if frame is not None:
                yield frame
                number += 1
            elif self.is_over:
                return
            else:
                self.idle()
                yield None
                time.sleep(max(PAUSE, PAUSES * (time.monotonic() - begun)))

    def look(self) -> None:
        """
        Look for files, and open the series again if some have come.

        Raises
        ------
        ReadError
            If what is there cannot be gone on with.
        """
        path = Path(self.source)
        if not path.exists():
            raise ReadError(
                f"{self.source}: has vanished while it was followed, after "
                f"{len(self.taken)} frames of it were taken: bring it back and go on with `resume`"
            )
        names = files_in(path) if path.is_dir() else [path]
        # until a frame is taken, what a file holds may be seen better when there is more of it
        if names == self._names and (self.taken or not self._opening.has_changed(names)):
            return
        with warnings.catch_warnings(record=True) as caught, growing():
            warnings.simplefilter("always")
            series = self._open(names)
        # those of the last opening, and of threads that have computed meanwhile
        self._told = [one.message for one in caught if isinstance(one.message, Warning)]
        self._tell()
        if series is not None:
            self._names, self.problem = names, None
            self._go_on_with(series)

    def _open(self, names: Sequence[Path]) -> Series | None:
        try:
            return read_series(self.source, **self.reading)
        except SettingsError:
            raise
        except (ReadError, OSError) as error:
            self.problem = error if isinstance(error, ReadError) else ReadError(str(error))
            if self.taken and all(map(self._wholeness.watch.is_quiet, names)):
                raise self.problem from None
            return None

    def _go_on_with(self, series: Series) -> None:
        if self._series is not None:
            # by the stamps of the files, and the space of the first frame: they are known already
            series.known = self._series.known
        self._series = series
        self._check_taken(series)
        self.opened(series)

    def _tell(self) -> None:
        """What was told when the series was opened, once it is sure that it is one."""
        if self.taken:
            told, self._told = self._told, []
            for one in told:
                warnings.warn(one, stacklevel=2)

    def _check_taken(self, series: Series) -> None:
        """ReadError if taken frames would be others in the finished folder."""
        files = list(series.grains.files.values())
        taken = list(dict.fromkeys(self._sizes))
        for path in taken:
            if path not in files and series.grains.kind != "index":
                raise ReadError(
                    f"{path}: has vanished after its frame was taken, so that the numbers of all "
                    f"later frames would change: bring it back and go on with `resume`"
                )
        if series.grains.kind != "index" and files[: len(taken)] != taken:
            new = next(path for path in files if path not in taken)
            raise ReadError(
                f"{new}: is new, and belongs before frames that were taken already: compute the "
                f"finished folder without `follow`"
            )
        for frame in self._alone:
            for family in series.contacts:
                if self._wholeness.contacts(series, frame, family) is not None:
                    raise ReadError(
                        f"{frame.snapshot.path}: its contact file in {family.pattern} has come "
                        f"after it was taken without: compute the finished folder without `follow`"
                    )

    def _check_sizes(self) -> None:
        """ReadError if a file has grown that was thought whole; one of many snapshots may."""
        for path, size in self._sizes.items() if len(self._sizes) > 1 else ():
            if path.exists() and path.stat().st_size != size:
                raise ReadError(
                    f"{path}: has changed after its frame was taken: expected a file that is "
                    f"written within {QUIET:g} s; compute the finished folder without `follow`"
                )

    def _frame(self, number: int) -> Frame | None:
        """A frame that was taken, or can be now."""
        if number < len(self.taken):
            return self.taken[number]
        if self.is_over:
            return self._last(number, ()) if number == 0 else None
        self.look()
        self._check_sizes()
        waiting = self._waiting(number)
        found = self._next(waiting) if waiting else None
        if found is not None:
            return self._take(found)
        if self.seconds is not None and time.monotonic() - self._since >= self.seconds:
            # what is left is taken at once: nothing more is waited for
            self.seconds = 0.0
            found = self._last(number, waiting)
            self.is_over = found is None
        return found

    def _waiting(self, number: int) -> list[Frame]:
        """The frames behind those that were taken, as far as they can be told."""
        if self._series is None:
            return []
        # contact files are looked into again; threads may still read frames of the series before
        series = replace(self._series)
        series.known = self._series.known
        with growing():
            return list(islice(series, number, None))

    def _take(self, frame: Frame) -> Frame:
        path = frame.snapshot.path
        # without its packing, which is needed but once
        plain = frame
        if isinstance(frame, WholeFrame):
            plain = replace(frame, packing=None)
        self.taken.append(plain)
        if frame.series.contacts_from in ("auto", "beside"):
            families = frame.series.contacts
            if not any(self._wholeness.contacts(frame.series, frame, one) for one in families):
                self._alone.append(plain)
        if path.exists():
            self._sizes[path] = path.stat().st_size
        self._since = time.monotonic()
        self._tell()
        return frame

    def _next(self, waiting: Sequence[Frame]) -> Frame | None:
        """The first of some frames, if it is whole, or broken while a later one is whole."""
        first, *later = waiting
        if later and self._wholeness.is_old(first):
            return first
        whole = self._wholeness.whole(first, bool(later))
        if whole is not None:
            return whole
        for place, other in enumerate(later, start=2):
            if self._wholeness.whole(other, place < len(waiting)) is not None:
                return first
        return None

    def _last(self, number: int, waiting: Sequence[Frame]) -> Frame | None:
        """At the end: what is whole but for contacts that have not come."""
        waiting = waiting or self._waiting(number)
        for place, frame in enumerate(waiting):
            found = self._wholeness.read(frame)
            if found is not None:
                # broken ones before it are left to whoever reads them
                return self._take(found if place == 0 else waiting[0])
        if waiting:
            warnings.warn(
                f"{waiting[0].snapshot.path}: is left out, as it was not whole when following it "
                f"ended: {self._wholeness.flaw}",
                ScanfabWarning,
                stacklevel=2,
            )
        return None
