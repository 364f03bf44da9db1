"""follow_series(): a series that grows while it is read, each frame as soon as it is whole."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

from scanfab.base.errors import PackingError, ReadError, ScanfabWarning, SettingsError
from scanfab.base.option import refuse_unknown, unusable
from scanfab.io.families import Family, PathLike, files_in
from scanfab.io.files import Stamp, stamp_of
from scanfab.io.frame import Frame
from scanfab.io.growing import growing
from scanfab.io.options import take_reading
from scanfab.io.series import Series
from scanfab.io.sources import READING, as_text, read_series

# seconds between two looks, or times what a look takes
PAUSE, PAUSES = 0.2, 3.0
# a file that has been as it is for so many seconds is whole, if it can be read to its end
QUIET = 1.0
# one that was written so long ago need not be watched, whatever the clock of its server says
OLD = 60.0


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
    return FollowedSeries(os.fspath(source), seconds, take_reading(dict(options)))


class FollowedSeries(Series):
    """Frames that are waited for; its files are those of the frames that were taken."""

    def __init__(self, source: str, seconds: float | None, reading: dict[str, Any]) -> None:
        nothing = Family(source, {}, None, "grains")
        super().__init__(as_text(source), nothing, sources=(source,), reading=reading)
        self._path, self._seconds = Path(source), seconds
        self._is_over = False
        self._taken: list[Frame] = []
        self._alone: list[Frame] = []
        """Taken frames that had no contact file."""
        self._sizes: dict[Path, int] = {}
        """Of the files of taken frames."""
        self._now: Series | None = None
        """The series of the files that were there at the last look."""
        self._looked: list[tuple[Path, Stamp | None]] = []
        self._seen: dict[Path, tuple[Stamp, float]] = {}
        """How the files of waiting frames are, and since when."""
        self._told: list[Warning] = []
        self._problem: Exception | None = None
        """Why the source cannot be opened, or the next frame not be read."""
        self._idle: Callable[[], object] = lambda: None
        self._since = time.monotonic()

    def __repr__(self) -> str:
        return f"FollowedSeries {self.name}: {len(self._taken)} frames so far"

    def _every(self) -> Iterator[Frame]:
        return (frame for frame in self.as_they_come() if frame is not None)

    def as_they_come(self) -> Iterator[Frame | None]:
        """The frames; None, after a moment, where the next one is not there yet."""
        number = 0
        while True:
            begun = time.monotonic()
            frame = self._taken[number] if number < len(self._taken) else self._next()
            if frame is not None:
                yield frame
                number += 1
            elif self._is_over:
                return
            else:
                self._idle()
                yield None
                time.sleep(max(PAUSE, PAUSES * (time.monotonic() - begun)))

    def end(self) -> None:
        """Take no more frames."""
        self._is_over = True

    @property
    def as_it_is(self) -> Series:
        """The series of what is there now, which is not waited for."""
        self._look()
        return self._with(self.numbers)

    @property
    def lack(self) -> str:
        """Why there is no frame yet."""
        return str(self._problem or f"{self.name}: no whole frame has come")

    def when_idle(self, call: Callable[[], object]) -> None:
        """Call this each time that there is nothing to do but to wait."""
        self._idle = call

    def frames_expected(self) -> int:
        """Those that have come."""
        return len(self._taken)

    def files(self) -> Iterator[Path]:
        """Those of the frames that were taken: others may be in the middle of being written."""
        if not self._taken:
            return
        for path, is_grains in self.files_through(len(self._taken) - 1):
            yield path
            if is_grains:
                yield from self.beside(path)
        if self.cells is not None:
            yield self.cells.path

    def _next(self) -> Frame | None:
        """The next frame, if it can be taken now."""
        if self._is_over:
            return None if self._taken else self._last()
        self._look()
        self._check_sizes()
        waiting = self._waiting()
        if waiting and self._may_be_taken(waiting):
            return self._take(waiting[0])
        if self._seconds is not None and time.monotonic() - self._since >= self._seconds:
            # what is left is taken at once: nothing more is waited for
            self._seconds = 0.0
            found = self._last()
            self._is_over = found is None
            return found
        return None

    def _look(self) -> None:
        """
        Look for files, and open the series again if some have come.

        Raises
        ------
        ReadError
            If what is there cannot be gone on with.
        """
        if not self._path.exists():
            raise ReadError(
                f"{self._path}: has vanished while it was followed, after {len(self._taken)} "
                f"frames of it were taken: bring it back and go on with `resume`"
            )
        names = files_in(self._path) if self._path.is_dir() else [self._path]
        # until a frame is taken, what a file holds may be seen better when there is more of it
        looked = [(path, None if self._taken else _stamp(path)) for path in names]
        if looked == self._looked:
            return
        with warnings.catch_warnings(record=True) as caught, growing():
            warnings.simplefilter("always")
            try:
                series = read_series(self.sources[0], **self.reading)
            except SettingsError:
                raise
            except (ReadError, OSError) as error:
                self._problem, series = error, None
        # those of the last opening, and of threads that have computed meanwhile
        self._told = [one.message for one in caught if isinstance(one.message, Warning)]
        self._tell()
        if series is not None:
            self._looked, self._problem = looked, None
            self._go_on_with(series)
        elif self._taken and all(map(self._is_quiet, names)):
            raise ReadError(str(self._problem))

    def _go_on_with(self, series: Series) -> None:
        """Take over what is known of the files now, if taken frames stay what they are."""
        series.known = self.known
        files = list(series.grains.files.values())
        taken = list(self._sizes)
        if series.grains.kind != "index" and files[: len(taken)] != taken:
            for path in taken:
                if path not in files:
                    raise ReadError(
                        f"{path}: has vanished after its frame was taken, so that the numbers of "
                        f"all later frames would change: bring it back and go on with `resume`"
                    )
            new = next(path for path in files if path not in taken)
            raise ReadError(
                f"{new}: is new, and belongs before frames that were taken already: compute the "
                f"finished folder without `follow`"
            )
        for frame in self._alone:
            if any(_contacts(series, frame)):
                raise ReadError(
                    f"{frame.snapshot.path}: its contact file has come after it was taken without: "
                    f"compute the finished folder without `follow`"
                )
        self._now = series
        self.grains, self.contacts, self.cells = series.grains, series.contacts, series.cells
        self.contacts_from, self.options = series.contacts_from, series.options
        self.dim = series.dim

    def _tell(self) -> None:
        """What was told when the series was opened, once it is sure that it is one."""
        if self._taken:
            told, self._told = self._told, []
            for one in told:
                warnings.warn(one, stacklevel=2)

    def _check_sizes(self) -> None:
        """ReadError if a file has grown that was thought whole; one of many snapshots may."""
        for path, size in self._sizes.items() if len(self._sizes) > 1 else ():
            if path.exists() and path.stat().st_size != size:
                raise ReadError(
                    f"{path}: has changed after its frame was taken: expected a file that is "
                    f"written within {QUIET:g} s; compute the finished folder without `follow`"
                )

    def _waiting(self) -> list[Frame]:
        """The frames behind those that were taken, as far as they can be told."""
        with growing():
            return [] if self._now is None else list(islice(self._now, len(self._taken), None))

    def _may_be_taken(self, waiting: Sequence[Frame]) -> bool:
        """Whether the first of some frames is whole, or broken while a later one is whole."""
        if len(waiting) > 1 and self._is_old(waiting[0]):
            return True
        places = range(1, len(waiting) + 1)
        return any(
            self._is_whole(frame, has_later=place < len(waiting))
            for place, frame in zip(places, waiting, strict=True)
        )

    def _is_whole(self, frame: Frame, *, has_later: bool) -> bool:
        """Whether all files of a frame are there and can be read to their ends."""
        quiet = [self._is_quiet(path) for path in _files(frame)]
        if not (has_later or all(quiet)) or not all(_contacts(frame.series, frame)):
            return False
        if has_later or frame.number:
            return self._can_be_read(frame)
        # of the first frame alone nobody knows whether contact files will come, nor whether the
        # number in its name is its step
        may_come = frame.series.contacts_from in ("auto", "beside") and not frame.series.contacts
        has_step = frame.step is not None or frame.name_step is None
        return has_step and self._can_be_read(frame, with_contacts=may_come)

    def _can_be_read(self, frame: Frame, *, with_contacts: bool = False) -> bool:
        try:
            with growing():
                packing = frame.read()
        except (ReadError, PackingError) as error:
            self._problem = error
            return False
        return packing.contacts is not None or not with_contacts

    def _is_quiet(self, path: Path) -> bool:
        """Whether a file is there and has been as it is for a while."""
        stamp = _stamp(path)
        if stamp is None:
            return False
        if path not in self._seen or self._seen[path][0] != stamp:
            self._seen[path] = stamp, time.monotonic()
        return time.monotonic() - self._seen[path][1] >= QUIET or _age([path]) > OLD

    def _is_old(self, frame: Frame) -> bool:
        """Whether nobody is writing a frame any more."""
        return all(_contacts(frame.series, frame)) and _age(_files(frame)) > OLD

    def _take(self, frame: Frame) -> Frame:
        path = frame.snapshot.path
        self._taken.append(frame)
        may_come = frame.series.contacts_from in ("auto", "beside")
        if may_come and not any(_contacts(frame.series, frame)):
            self._alone.append(frame)
        if path.exists():
            self._sizes[path] = path.stat().st_size
        self._since = time.monotonic()
        self._tell()
        return frame

    def _last(self) -> Frame | None:
        """At the end: what is whole but for contacts that have not come."""
        waiting = self._waiting()
        # broken frames before a whole one are left to whoever reads them
        if any(map(self._can_be_read, waiting)):
            return self._take(waiting[0])
        if waiting:
            warnings.warn(
                f"{waiting[0].snapshot.path}: is left out, as it was not whole when following it "
                f"ended: {self._problem}",
                ScanfabWarning,
                stacklevel=2,
            )
        return None


def _contacts(series: Series, frame: Frame) -> list[Path | None]:
    """The contact file of a frame in each family of contacts, if it is there and can be read."""
    found: list[Path | None] = []
    for family in series.contacts:
        snapshot = None
        with suppress(ReadError), growing():
            snapshot = series._contacts_of(frame, family)
        found.append(None if snapshot is None else snapshot.path)
    return found


def _files(frame: Frame) -> list[Path]:
    """What a frame is read from, as far as it is there."""
    series, path = frame.series, frame.snapshot.path
    beside = [] if series.grains.kind == "index" else series.beside(path)
    contacts = [one for one in _contacts(series, frame) if one is not None]
    return [path, *frame.snapshot.parts, *beside, *contacts]


def _stamp(path: Path) -> Stamp | None:
    with suppress(OSError):
        return stamp_of(path)
    return None


def _age(files: Sequence[Path]) -> float:
    """Seconds since the last of some files was written; 0 if one is not there."""
    with suppress(OSError):
        return time.time() - max(path.stat().st_mtime for path in files)
    return 0.0
