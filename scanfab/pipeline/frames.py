"""The frames of one source as samples: the chosen ones, and the first that has grains."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

from scanfab.base.errors import (
    PackingError,
    ReadError,
    ScanfabWarning,
    SettingsError,
    SkippedFrameWarning,
)
from scanfab.io.reader import Carries
from scanfab.io.series import ENDLESS, Series
from scanfab.packing.boundary import enclosing_class, existing_values, select_boundary
from scanfab.packing.doubts import cell_doubt, doubts_of
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.packing.search import find_contacts
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import as_written

__all__ = ["Frames", "Readable", "boundary_hint", "chosen_frames", "of_whole"]


class Readable(Protocol):
    """A frame of a series, or a packing in its place."""

    @property
    def carries(self) -> Carries: ...

    @property
    def cell_is_named(self) -> bool: ...

    def read(self) -> Packing: ...


@dataclass(frozen=True)
class _Given:
    """A packing made of arrays, whose maker knows its cell."""

    packing: Packing
    carries: Carries = "cell"
    cell_is_named: bool = False

    def read(self) -> Packing:
        return self.packing


class Frames:
    """
    One source, frame by frame, for all that look at samples; a packing is a series of one.

    Of damaged frames there is one rule: with ``on_error="stop"`` they are errors, with ``"skip"``
    they are told and passed over, whether they were chosen or lie before the first that has grains.
    No frame is read twice: what the search for that one has read is handed on.

    Parameters
    ----------
    source : Packing or Series
        One frame, or many.
    settings : Settings
        ``frames``, ``on_error``, ``boundary``, ``min_contacts`` and ``contact_tolerance`` count.

    Raises
    ------
    SettingsError
        If the source is something else.
    """

    def __init__(self, source: Packing | Series, settings: Settings) -> None:
        if not isinstance(source, Packing | Series):
            raise SettingsError(f"expected a Packing or a Series, found {source!r}")
        self.source, self.settings = of_whole(source, settings)
        self.name = "" if isinstance(source, Packing) else source.name
        self.particles = 0
        """Of the frames that were read on the way to the first that has grains."""
        self._ready: dict[int, Sample | None] = {}

    def __repr__(self) -> str:
        source, chosen = self.source, as_written(self.settings.frames)
        return f"Frames {chosen} of {source!r}"

    def __iter__(self) -> Iterator[tuple[int, Readable]]:
        """All frames with their numbers, not read."""
        if isinstance(self.source, Packing):
            yield 0, _Given(self.source)
        else:
            yield from enumerate(self.source)

    @cached_property
    def chosen(self) -> range:
        """The numbers of the chosen frames; there may be fewer."""
        return chosen_frames(self.source, self.settings.frames)

    def due(self) -> Iterator[tuple[int, Readable]]:
        """
        The chosen frames with their numbers, not read.

        Raises
        ------
        SettingsError
            At the end, if there is none.
        """
        found = False
        for number, frame in self:
            if number in self.chosen:
                found = True
                yield number, frame
            if number >= self.chosen.stop - 1:
                break
        if not found:
            raise self.no_such_frames()

    def one(self) -> tuple[int, Readable]:
        """The first chosen frame; SettingsError if there is none."""
        return next(self.due())

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
                self.refuse_unknown_boundary(sample)
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
            warnings.warn(f"frame {number} skipped: {error}", SkippedFrameWarning, stacklevel=2)
            return None

    def tell_doubts(self, frame: Readable, sample: Sample) -> None:
        """Warn of what looks wrong in a frame before anything is measured."""
        doubts = doubts_of(sample, cell_is_named=frame.cell_is_named)
        doubts.append(cell_doubt(sample, frame.carries))
        if not self.settings.boundary:
            doubts.append(boundary_hint(sample, self.settings) or "")
        for doubt in filter(None, doubts):
            warnings.warn(doubt, ScanfabWarning, stacklevel=3)

    def complain_of_no_grains(self) -> None:
        """An error or a warning: no frame has any."""
        if self.particles:
            named = " or ".join(rule.text for rule in self.settings.boundary)
            raise SettingsError(
                f"boundary: {named} selects all particles of every frame: no grain is left"
            )
        warnings.warn(f"{self.name}: no frame has any grains", ScanfabWarning, stacklevel=3)

    def read(self, frame: Readable) -> Sample:
        """A frame told apart, by its contacts and the boundary; raises if it is damaged."""
        packing, settings = frame.read(), self.settings
        if packing.contacts is None:
            packing = find_contacts(packing, settings.contact_tolerance)
        return Sample(packing, select_boundary(packing, settings.boundary), settings.min_contacts)

    def refuse_unknown_boundary(self, first: Sample) -> None:
        """
        SettingsError if no frame has any of the boundary's particles.

        A warning if one rule fits none. Particles may come in later frames, so those are looked
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
            return
        named = " or ".join(rule.text for rule in missing)
        values = existing_values(first.packing, missing)
        message = f"boundary: no particle of any frame has {named}: {values}"
        if len(missing) == len(rules):
            raise SettingsError(message)
        warnings.warn(message, ScanfabWarning, stacklevel=4)

    def no_such_frames(self) -> SettingsError:
        """The error for a choice that meets no frame."""
        count = sum(1 for _ in self)
        name, frames = self.name or "the packing", self.settings.frames
        has = "1 frame, 0" if count == 1 else f"{count} frames, 0 to {count - 1}"
        return SettingsError(
            f"frames: the series has no frame in {as_written(frames)}: {name} has {has}"
        )


def chosen_frames(source: Packing | Series, frames: slice) -> range:
    """The frames to compute, in the order of the source."""
    chosen = range(1)[frames] if isinstance(source, Packing) else source.numbers_of(frames)
    return chosen if chosen.step > 0 else chosen[::-1]


def of_whole(source: Packing | Series, settings: Settings) -> tuple[Packing | Series, Settings]:
    """
    The whole of a series of which some frames are given, and settings that choose these.

    Which frames are asked for decides neither RV, rmin nor L0, whichever way it is said.
    """
    if isinstance(source, Packing) or source.is_whole:
        return source, settings
    chosen = chosen_frames(source, settings.frames)
    stop = None if chosen.stop >= ENDLESS else chosen.stop
    step = None if chosen.step == 1 else chosen.step
    return source.whole, replace(settings, frames=slice(chosen.start, stop, step))


def boundary_hint(sample: Sample, settings: Settings) -> str | None:
    """What to tell of boundary particles that are not named, or of a name that fits none."""
    if settings.boundary:
        named = " or ".join(rule.text for rule in settings.boundary)
        if sample.boundary.any():
            return None
        values = existing_values(sample.packing, settings.boundary)
        return f"boundary: no particle has {named}: {values}"
    expression = enclosing_class(sample.packing)
    if expression is None:
        return None
    return (
        f"the particles with {expression} enclose the others: if they are a boundary, "
        f'name them: `boundary="{expression}"`'
    )
