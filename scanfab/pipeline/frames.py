"""The frames of one source as samples: the chosen frames, and the reference frame."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import count, islice
from typing import Any

from scanfab.base.errors import (
    NoReferenceError,
    Note,
    PackingError,
    ReadError,
    ScanfabNote,
    SettingsError,
    SkippedFrameWarning,
    tell,
)
from scanfab.base.spelling import counted
from scanfab.io.follow import FollowedSeries
from scanfab.io.frame import Frame
from scanfab.io.series import ENDLESS, Series, counts_from_end
from scanfab.packing.boundary import select_boundary, spelt_rules, unnamed_boundary
from scanfab.packing.doubts import cell_hint, doubts_of
from scanfab.packing.packing import Packing
from scanfab.packing.rattlers import installed_rules
from scanfab.packing.sample import Sample
from scanfab.packing.search import find_contacts
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import as_written

Unread = Frame | Packing
Source = Packing | Series | Iterable[Packing]
"""One frame, a series that is read frame by frame, or packings from anywhere."""


class NoChosenFrameError(SettingsError):
    """The series has frames, but the option ``frames`` chooses none of them."""


def _refused(expected: str, found: object) -> SettingsError:
    how = ": `frame.read()` is its packing" if isinstance(found, Frame) else ""
    return SettingsError(f"expected {expected}, found {found!r}{how}")


class _Stream:
    """Packings that come one after the other, for instance from a running simulation."""

    name = ""

    def __init__(self, packings: Iterable[Packing]) -> None:
        self._coming, self._taken = iter(packings), 0
        # itertools.tee would keep some that are taken
        self._kept: deque[Packing] = deque()

    def __iter__(self) -> Iterator[Packing]:
        """The packings that are not taken yet; they are kept until they are taken."""
        for number in count():
            if number == len(self._kept):
                for packing in islice(self._coming, 1):
                    if not isinstance(packing, Packing):
                        raise _refused("packings", packing)
                    self._kept.append(packing)
            # another iterator may have kept packings meanwhile, so compare again
            if number == len(self._kept):
                return
            yield self._kept[number]

    def __len__(self) -> int:
        return self._taken + sum(1 for _ in self)

    def numbers_of(self, frames: slice) -> range:
        """The numbers of a slice; packings are counted only if it counts from their end."""
        return range(len(self) if counts_from_end(frames) else ENDLESS)[frames]

    def as_they_come(self) -> Iterator[Packing]:
        """Take each packing, so that it is forgotten: no more are in memory than necessary."""
        while self._kept or next(iter(self), None) is not None:
            self._taken += 1
            yield self._kept.popleft()


class Frames:
    """
    The frames of one source, read when they are needed; a packing is a series of one frame.

    With ``on_error="stop"`` a damaged frame is an error. With ``"skip"`` a warning names it and it
    is left out, no matter whether it was chosen or lies before the reference frame. No frame is
    read twice: samples that the search for the reference frame has read are used again.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        One frame, or many.
    settings : Settings
        Only ``frames``, ``reference``, ``on_error``, ``boundary``, ``min_contacts``, ``rattlers``,
        ``min_force`` and ``contact_tolerance`` are used.

    Raises
    ------
    SettingsError
        If the source is something else.
    """

    def __init__(self, source: Source, settings: Settings) -> None:
        if isinstance(source, str) or not isinstance(source, Iterable | Packing):
            expected = "a Packing, a Series (of scanfab.read_series) or an iterable of packings"
            raise _refused(expected, source)
        self.source: Series | _Stream
        self.settings = settings
        if isinstance(source, Series):
            self.source, self.settings = of_whole(source, settings)
        else:
            self.source = _Stream([source] if isinstance(source, Packing) else source)
        if isinstance(self.source, FollowedSeries) and counts_from_end(self.settings.frames):
            what = f"{as_written(self.settings.frames)} counts from the end of the series"
            raise SettingsError(f"frames: {what}, which nobody knows while it is followed")
        self.named = number_of_reference(self.source, self.settings)
        """Number of the reference frame, if the user names one."""
        if isinstance(self.source, Series):
            self.source.known.reference = self.named
        self.name = self.source.name
        self.ready: dict[int, Sample | None] = {}
        """Chosen frames that :meth:`reference` has read; None for damaged frames."""

    def __iter__(self) -> Iterator[tuple[int, Unread]]:
        """All frames with their numbers, unread."""
        return enumerate(self.source)

    @cached_property
    def chosen(self) -> range:
        """The numbers of the chosen frames; the range may end behind the last frame."""
        return chosen_frames(self.source, self.settings.frames)

    def due(self) -> Iterator[tuple[int, Unread]]:
        """The chosen frames with their numbers, unread; waits for frames that are still to come."""
        return (frame for frame in self.as_they_come() if frame is not None)

    def as_they_come(self) -> Iterator[tuple[int, Unread] | None]:
        """
        The chosen frames with their numbers, unread; the frames of a stream are forgotten.

        None stands for a frame of a followed series that is not complete yet.

        Raises
        ------
        SettingsError
            At the end, if there was no chosen frame.
        """
        every: Iterable[Unread | None] = self.source
        if isinstance(self.source, _Stream | FollowedSeries):
            every = self.source.as_they_come()
        found, number = False, 0
        for frame in every:
            if frame is None:
                yield None
                continue
            if number in self.chosen:
                found = True
                yield number, frame
            number += 1
            if number >= self.chosen.stop:
                break
        if not found:
            raise self.no_such_frames()

    def one(self) -> tuple[int, Unread]:
        """The first chosen frame, unread; SettingsError if there is none."""
        for number, frame in self:
            if number in self.chosen:
                return number, frame
        raise self.no_such_frames()

    def reference(self) -> tuple[int, Unread, Sample]:
        """
        The frame that lengths come from: the one that the user names, else the first with grains.

        It need not be chosen.

        Raises
        ------
        NoReferenceError
            If the frame that the user names does not exist or has no grains.
        SettingsError
            If no frame has boundary particles, or all particles are boundary.
        PackingError
            If no frame has any grains.
        ReadError
            If the frame that the user names cannot be read.
        """
        has_particles, is_stream = False, isinstance(self.source, _Stream)
        for number, frame in self:
            if self.named is not None and number < self.named and not is_stream:
                continue
            is_named = number == self.named
            sample = sample_of(frame, self.settings) if is_named else self.sample(number, frame)
            if number in self.chosen:
                self.ready[number] = sample
            if sample is not None and sample.grains.any():
                if self.named not in (None, number):
                    raise NoReferenceError(
                        f"reference: packings are not kept, so it must be their first frame that "
                        f"has grains: expected {number}, found {self.named}"
                    )
                tell(self.check_boundary(sample))
                return number, frame, sample
            if is_named:
                raise NoReferenceError(f"reference: frame {number} of {self.name} has no grains")
            has_particles |= sample is not None and len(sample.packing) > 0
        if self.named is not None:
            raise no_such_reference(self.named, self.name, len(self.source))
        if has_particles:
            named = " or ".join(rule.text for rule in self.settings.boundary)
            what = f"{named} selects all particles of every frame"
            raise SettingsError(f"boundary: {what}: no grain is left")
        next(self.due())  # raises another error if there is no frame at all
        raise PackingError(f"{self.name or 'the source'}: no frame has any grains")

    def sample(self, number: int, frame: Unread) -> Sample | None:
        """The sample of a frame; None if the frame is damaged and damaged frames are skipped."""
        if number in self.ready:
            return self.ready.pop(number)
        try:
            return sample_of(frame, self.settings)
        except (PackingError, ReadError) as error:
            if self.settings.on_error == "stop":
                raise
            tell([Note("skipped", str(error), kind=SkippedFrameWarning)], f"frame {number}")
            return None

    def check_boundary(self, first: Sample) -> list[Note]:
        """
        A note for rules of the boundary that select no particle; SettingsError if no rule does.

        Rules that select no particle of the ``first`` sample are tried on all other frames.
        """
        rules = self.settings.boundary
        missing = [rule for rule in rules if not rule.select(first.packing).any()]
        others = iter(self)
        while missing and (following := next(others, None)) is not None:
            with suppress(PackingError, ReadError, SettingsError):
                packing = packing_of(following[1])
                missing = [rule for rule in missing if not rule.select(packing).any()]
        if not missing:
            return []
        message = f"no particle of any frame has {spelt_rules(missing, first.packing)}"
        if len(missing) == len(rules):
            raise SettingsError(f"boundary: {message}")
        return [Note("no_such_boundary", f"`boundary`: {message}")]

    def no_such_frames(self) -> SettingsError:
        """The error for a choice without any frame."""
        count = len(self.source)
        if count == 0 and isinstance(self.source, FollowedSeries):
            return NoChosenFrameError(self.source.lack)
        if count == 0:
            return SettingsError(f"expected frames, found none in {self.name or 'the source'}")
        numbers = "1 frame, 0" if count == 1 else f"{count} frames, 0 to {count - 1}"
        what = f"the series has no frame in {as_written(self.settings.frames)}"
        return NoChosenFrameError(f"{what}: {self.name or 'the packing'} has {numbers}")


def number_of_reference(source: Series | _Stream, settings: Settings) -> int | None:
    """
    The number of the reference frame, if the user names one, counted from 0.

    Raises
    ------
    NoReferenceError
        If the series has no such frame, or if it counts from an end that nobody knows yet.
    """
    named, still_come = settings.reference, isinstance(source, FollowedSeries | _Stream)
    if named is None or (named >= 0 and still_come):
        return named
    if still_come:
        what = f"{named} counts from the end, which nobody knows while frames are still to come"
        raise NoReferenceError(f"reference: {what}: name a frame from the beginning")
    count = len(source)
    if not -count <= named < count:
        raise no_such_reference(named, source.name, count)
    return named % count


def no_such_reference(number: int, name: str, count: int) -> NoReferenceError:
    """The error for a reference frame that does not exist."""
    has = f"{name or 'the source'} has {counted(count, 'frame')}"
    return NoReferenceError(f"reference: there is no frame {number}: {has}, counted from 0")


def doubts_of_frame(frame: Unread, sample: Sample, settings: Settings) -> list[Note]:
    """What looks wrong in a frame before anything is measured."""
    # a packing made of arrays has the cell that its maker wants
    notes = doubts_of(sample, not isinstance(frame, Packing) and frame.cell_is_named)
    if settings.boundary:
        return notes
    if not isinstance(frame, Packing) and (hint := cell_hint(sample, frame.carries)):
        notes.append(Note("no_cell", hint, kind=ScanfabNote))
    return notes + unnamed_boundary(sample.packing)


def packing_of(frame: Unread) -> Packing:
    """The packing of a frame; a frame in a file is read."""
    return frame if isinstance(frame, Packing) else frame.read()


def sample_of(frame: Unread, settings: Settings) -> Sample:
    """Read a frame, find its contacts if no file lists them, and sort its particles."""
    packing = packing_of(frame)
    if packing.contacts is None:
        packing = find_contacts(packing, settings.contact_tolerance)
    boundary = select_boundary(packing, settings.boundary)
    rule = installed_rules()[settings.rattlers]
    return Sample(packing, boundary, settings.min_contacts, rule, settings.min_force)


def chosen_frames(source: Series | _Stream, frames: slice) -> range:
    """The numbers of the chosen frames, in the order of the source."""
    chosen = source.numbers_of(frames)
    return chosen if chosen.step > 0 else chosen[::-1]


def of_whole(series: Series, settings: Settings) -> tuple[Series, Settings]:
    """
    The whole series for a slice of it, and settings that choose the frames of the slice.

    So RV, rmin and L0 are those of the whole series, no matter how frames are chosen.
    """
    if series.is_whole:
        return series, settings
    chosen = chosen_frames(series, settings.frames)
    stop = None if chosen.stop >= ENDLESS else chosen.stop
    step = None if chosen.step == 1 else chosen.step
    return series.whole, replace(settings, frames=slice(chosen.start, stop, step))


def samples(source: Source, **options: Any) -> Iterator[tuple[int, Sample]]:
    """
    Yield the chosen frames as samples, as :func:`scanfab.compute` sees them.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        One frame, or many.
    **options
        Options of :func:`scanfab.compute`; only ``boundary``, ``min_contacts``, ``rattlers``,
        ``min_force``, ``contact_tolerance``, ``frames`` and ``on_error`` are used.

    Yields
    ------
    number : int
        Number of the frame in the series, from 0.
    sample : Sample
        Its particles, sorted into grains, boundary and rattlers, and its contacts, which are found
        by geometry if no file lists them. Only one sample is in memory at a time.

    Raises
    ------
    ScanfabError
        If a frame cannot be read (with ``on_error="skip"`` it is skipped), or if there is none.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.read_series("sample_data/liggghts_periodic")
    >>> for number, sample in scanfab.samples(series[:2]):
    ...     print(number, sample)
    0 Sample: 800 grains, 60 rattlers (fewer than 2 contacts)
    1 Sample: 800 grains, 54 rattlers (fewer than 2 contacts)
    """
    # no generator function: an error in an option is raised at once, not with the first frame
    frames = Frames(source, Settings(**options))
    found = ((number, frames.sample(number, frame)) for number, frame in frames.due())
    return ((number, sample) for number, sample in found if sample is not None)
