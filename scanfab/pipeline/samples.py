"""Frames as samples, for those who scan them by hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from scanfab.packing.sample import Sample
from scanfab.pipeline.frames import Frames, Source
from scanfab.pipeline.settings import Settings


def samples(source: Source, **options: Any) -> Iterator[tuple[int, Sample]]:
    """
    The chosen frames as samples, one in memory at a time, as :func:`scanfab.compute` sees them.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        One frame, or many.
    **options
        Those of :func:`scanfab.compute`, of which ``boundary``, ``min_contacts``,
        ``rattlers``, ``min_force``, ``contact_tolerance``, ``frames`` and ``on_error`` count.

    Yields
    ------
    number : int
        Of the frame in the series, from 0.
    sample : Sample
        Its particles, told apart; contacts that no file lists are found by geometry.

    Raises
    ------
    ScanfabError
        If a frame cannot be read (with ``on_error="skip"`` it is passed over), or if there is none.
    TypeError
        If there is no such option; names the nearest that there is.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.read_series("sample_data/liggghts_periodic")
    >>> for number, sample in scanfab.samples(series[:2]):
    ...     print(number, sample)
    0 Sample: 800 grains, 60 rattlers (fewer than 2 contacts)
    1 Sample: 800 grains, 54 rattlers (fewer than 2 contacts)
    """
    # what is wrong with an option is told at once, not with the first frame
    return _told_apart(Frames(source, Settings(**options)))


def _told_apart(frames: Frames) -> Iterator[tuple[int, Sample]]:
    for number, frame in frames.due():
        sample = frames.sample(number, frame)
        if sample is not None:
            yield number, sample
