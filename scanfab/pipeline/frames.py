"""The frames of one source as samples: the chosen ones, and the first that has grains."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

from scanfab.base.errors import (
    SKIPPED,
    Note,
    PackingError,
    ReadError,
    SettingsError,
    tell,
)
from scanfab.io.follow import FollowedSeries
from scanfab.io.reader import Carries
from scanfab.io.series import ENDLESS, Series
from scanfab.packing.boundary import enclosing_class, existing_values
from scanfab.packing.doubts import cell_doubt, doubts_of
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample, SampleRule
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import as_written

Source = Packing | Series | Iterable[Packing]
"""One frame, a series that is read frame by frame, or packings from anywhere."""


class NoChosenFrameError(SettingsError):
    """The series has frames, but none of those that were chosen."""


class Readable(Protocol):
    """A frame of a series, or a packing in its place."""

    @property
    def carries(self) -> Carries: ...

    @property
    def named(self) -> Mapping[str, bool]: ...

    def read(self) -> Packing: ...


@dataclass(frozen=True)
class _Given:
    """A packing made of arrays, whose maker knows its cell."""

    packing: Packing
    carries: Carries = "cell"
    named: Mapping[str, bool] = field(default_factory=dict)

    def read(self) -> Packing:
        return self.packing


class _Stream:
    """Packings that come one after the other, for instance out of a running simulation."""

    name = ""

    def __init__(self, packings: Iterable[Packing]) -> None:
        self._coming = iter(packings)
        self._kept: deque[_Given] = deque()
        self._number_taken = 0

    def __iter__(self) -> Iterator[_Given]:
        """Those that are not taken yet; what has come is kept until it is taken."""
        number = 0
        while number < len(self._kept) or self._kept_another():
            yield self._kept[number]
            number += 1

    def taken(self) -> Iterator[_Given]:
        """Each for the last time, so that no more of them are in memory than need be."""
        while self._kept or self._kept_another():
            self._number_taken += 1
            yield self._kept.popleft()

    def count(self) -> int:
        """How many there are in all."""
        return sum(1 for _ in self) + self._number_taken

    def _kept_another(self) -> bool:
        """Whether there was one more, which is kept now."""
        for packing in self._coming:
            if not isinstance(packing, Packing):
                raise SettingsError(f"expected packings, found {packing!r} among them")
            self._kept.append(_Given(packing))
            return True
        return False


class Frames:
    """
    One source, frame by frame, for all that look at samples; a packing is a series of one.

    Of damaged frames there is one rule: with ``on_error="stop"`` they are errors, with ``"skip"``
    they are told and passed over, whether they were chosen or lie before the first that has grains.
    No frame is read twice: what the search for that one has read is handed on.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        One frame, or many.
    settings : Settings
        ``frames``, ``on_error``, ``boundary``, ``min_contacts``, ``rattlers``,
        ``min_force`` and ``contact_tolerance`` count.

    Raises
    ------
    SettingsError
        If the source is something else.
    """

    def __init__(self, source: Source, settings: Settings) -> None:
        if isinstance(source, Packing):
            source = [source]
        if isinstance(source, str) or not isinstance(source, Iterable):
            raise SettingsError(
                f"expected a Packing, a Series or an iterable of packings, found {source!r}"
            )
        self.source: Series | _Stream
        if isinstance(source, Series):
            self.source, self.settings = of_whole(source, settings)
        else:
            self.source, self.settings = _Stream(source), settings
        if isinstance(self.source, FollowedSeries):
            self._refuse_from_end()
        self.name = self.source.name
        self.particles = 0
        """Of the frames that were read on the way to the first that has grains."""
        self._ready: dict[int, Sample | None] = {}

    def _refuse_from_end(self) -> None:
        frames = self.settings.frames
        if any((bound or 0) < 0 for bound in (frames.start, frames.stop, frames.step)):
            raise SettingsError(
                f"frames: {as_written(frames)} counts from the end of the series, which nobody "
                f"knows while it is followed: count from its start, as in 10: or ::5"
            )

    def __repr__(self) -> str:
        source, chosen = self.source, as_written(self.settings.frames)
        return f"Frames {chosen} of {source!r}"

    def __iter__(self) -> Iterator[tuple[int, Readable]]:
        """All frames with their numbers, not read."""
        return enumerate(self.source)

    @cached_property
    def chosen(self) -> range:
        """The numbers of the chosen frames; there may be fewer."""
        return chosen_frames(self.source, self.settings.frames)

    def due(self) -> Iterator[tuple[int, Readable]]:
        """
        The chosen frames with their numbers, not read; the last time that frames are gone through.

        Raises
        ------
        SettingsError
            At the end, if there is none.
        """
        return (one for one in self.as_they_come() if one is not None)

    def as_they_come(self) -> Iterator[tuple[int, Readable] | None]:
        """The same of a series that is followed, with None where the next is not there yet."""
        # where they are counted from the end, that comes first
        chosen, found, number = self.chosen, False, 0
        for frame in self._last_time():
            if frame is None:
                yield None
                continue
            if number in chosen:
                found = True
                yield number, frame
            if number >= chosen.stop - 1:
                break
            number += 1
        if not found:
            raise self.no_such_frames()

    def _last_time(self) -> Iterable[Readable | None]:
        """All frames, for the last time."""
        if isinstance(self.source, _Stream):
            return self.source.taken()
        if isinstance(self.source, FollowedSeries):
            return self.source.as_they_come()
        return self.source

    def one(self) -> tuple[int, Readable]:
        """The first chosen frame; SettingsError if there is none."""
        for number, frame in self:
            if number in self.chosen:
                return number, frame
        raise self.no_such_frames()

    def first(self) -> tuple[int, Readable, Sample] | None:
        """
        The first frame that has grains, of all; None without any.

        Raises
        ------
        SettingsError
            If the boundary is that of no frame.
        """
        for number, frame in self:
            sample = self.sample(number, frame)
            if number in self.chosen:
                self._ready[number] = sample
            if sample is None:
                continue
            self.particles += len(sample.packing)
            if sample.grains.any():
                tell(self.check_boundary(sample))
                return number, frame, sample
        return None

    def sample(self, number: int, frame: Readable) -> Sample | None:
        """A frame told apart; None if it is damaged and such frames are passed over."""
        if number in self._ready:
            return self._ready.pop(number)
        try:
            return self.read(frame)
        except (PackingError, ReadError) as error:
            if self.settings.on_error == "stop":
                raise
            tell([Note(SKIPPED, str(error))], f"frame {number}")
            return None

    def sample_if_read(self, number: int, frame: Readable) -> Sample | Readable | None:
        """What :meth:`sample` gives, of a frame that has been read; else the frame itself."""
        return self._ready.pop(number, frame)

    def notes(self, frame: Readable, sample: Sample) -> list[Note]:
        """What looks wrong in a frame before anything is measured."""
        notes = doubts_of(sample, **frame.named)
        if no_cell := cell_doubt(sample, frame.carries):
            notes.append(Note("no_cell", no_cell))
        if not self.settings.boundary:
            notes += boundary_hints(sample, self.settings)
        return notes

    def without_grains(self) -> Note:
        """What to tell where no frame has any; SettingsError if the boundary takes them all."""
        if self.particles:
            named = " or ".join(rule.text for rule in self.settings.boundary)
            raise SettingsError(
                f"boundary: {named} selects all particles of every frame: no grain is left"
            )
        return Note("no_grains", "no frame has any grains")

    def read(self, frame: Readable) -> Sample:
        """A frame told apart, by its contacts and the boundary; raises if it is damaged."""
        return sample_rule(self.settings).sample(frame.read())

    def check_boundary(self, first: Sample) -> list[Note]:
        """
        SettingsError if no frame has any of the boundary's particles.

        A note if one rule fits none. Particles may come in later frames, so those are looked
        through if the ``first`` has none.
        """
        rules = self.settings.boundary
        missing = [rule for rule in rules if not rule.select(first.packing).any()]
        for _, frame in self if missing else ():
            with suppress(PackingError, ReadError, SettingsError):
                packing = frame.read()
                missing = [rule for rule in missing if not rule.select(packing).any()]
            if not missing:
                break
        if not missing:
            return []
        named = " or ".join(rule.text for rule in missing)
        values = existing_values(first.packing, missing)
        message = f"no particle of any frame has {named}: {values}"
        if len(missing) == len(rules):
            raise SettingsError(f"boundary: {message}")
        return [Note("no_such_boundary", f"`boundary`: {message}")]

    def no_such_frames(self) -> SettingsError:
        """The error for a choice that meets no frame."""
        count = self.source.count() if isinstance(self.source, _Stream) else len(list(self.source))
        if count == 0 and isinstance(self.source, FollowedSeries):
            return NoChosenFrameError(self.source.lack)
        if count == 0:
            return SettingsError(f"expected frames, found none in {self.name or 'the source'}")
        name, frames = self.name or "the packing", self.settings.frames
        has = "1 frame, 0" if count == 1 else f"{count} frames, 0 to {count - 1}"
        return NoChosenFrameError(
            f"frames: the series has no frame in {as_written(frames)}: {name} has {has}"
        )


def sample_rule(settings: Settings) -> SampleRule:
    """What settings say of how particles are told apart."""
    return SampleRule(
        settings.boundary,
        settings.min_contacts,
        settings.rattlers,
        settings.min_force,
        settings.contact_tolerance,
    )


def chosen_frames(source: Iterable[Any], frames: slice) -> range:
    """The frames to compute, in the order of the source."""
    chosen = _numbers(source, frames)
    return chosen if chosen.step > 0 else chosen[::-1]


def _numbers(source: Iterable[Any], frames: slice) -> range:
    if isinstance(source, Series):
        return source.numbers_of(frames)
    bounds = (frames.start, frames.stop, frames.step)
    if any(bound is not None and bound < 0 for bound in bounds):
        return range(sum(1 for _ in source))[frames]
    # without counting the frames first: they may still come
    return range(ENDLESS)[frames]


def of_whole(series: Series, settings: Settings) -> tuple[Series, Settings]:
    """
    The whole of a series of which some frames are given, and settings that choose these.

    Which frames are asked for decides neither RV, rmin nor L0, whichever way it is said.
    """
    if series.is_whole:
        return series, settings
    chosen = chosen_frames(series, settings.frames)
    stop = None if chosen.stop >= ENDLESS else chosen.stop
    step = None if chosen.step == 1 else chosen.step
    return series.whole, replace(settings, frames=slice(chosen.start, stop, step))


def boundary_hints(sample: Sample, settings: Settings) -> list[Note]:
    """What to tell of boundary particles that are not named, or of a name that fits none."""
    if settings.boundary:
        named = " or ".join(rule.text for rule in settings.boundary)
        if sample.boundary.any():
            return []
        values = existing_values(sample.packing, settings.boundary)
        return [Note("no_such_boundary", f"`boundary`: no particle has {named}: {values}")]
    expression = enclosing_class(sample.packing)
    if expression is None:
        return []
    text = (
        f"the particles with {expression} enclose the others: if they are a boundary, "
        f'name them: `boundary="{expression}"`'
    )
    return [Note("unnamed_boundary", text)]
