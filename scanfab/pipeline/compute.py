"""compute(): the one place that knows all the steps, from packings to rows of the fabric table."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Protocol

from scanfab.base.errors import (
    PackingError,
    ReadError,
    ScanfabWarning,
    SettingsError,
    SkippedFrameWarning,
)
from scanfab.base.option import options_of, takes_options
from scanfab.base.threads import in_order
from scanfab.io.reader import Carries
from scanfab.io.series import Series
from scanfab.packing.boundary import enclosing_class, existing_values, select_boundary
from scanfab.packing.doubts import cell_doubt, doubts_of
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.packing.search import find_contacts
from scanfab.pipeline.frame import FrameResult, frame_result
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import MAX_CHORDS, Settings
from scanfab.pipeline.strain import Strains
from scanfab.scan.directions import DirectionRule
from scanfab.table.table import Row, Table

__all__ = [
    "FrameResult",
    "boundary_hint",
    "chosen_frames",
    "classify",
    "compute",
    "compute_rows",
    "frames_of",
    "no_such_frames",
    "refuse_unknown_boundary",
    "tell_doubts",
]

LOGGER = logging.getLogger("scanfab")

Observer = Callable[[FrameResult], None]


@takes_options(options_of(Settings))
def compute(
    source: Packing | Series,
    *,
    variants: str = "abcd",
    rv: float = 0.7,
    rv_radius: float | None = None,
    rv_center: Sequence[float] | None = None,
    boundary: str | Sequence[str] = (),
    cutoff: str | float = "1rmin",
    cutoffs: str | float | Iterable[str | float] | None = None,
    moment: int = 1,
    spacing: str | float = "auto",
    directions: str | int | DirectionRule = "auto",
    tolerance: float = 1e-4,
    max_chords: float = MAX_CHORDS,
    min_contacts: int = 2,
    contact_tolerance: float = 0.0,
    axis: str | Sequence[float] = "z",
    strain: str | Path = "auto",
    frames: str | int | slice | None = None,
    seed: int = 0,
    workers: int | None = None,
    on_error: str = "stop",
) -> Table:
    """
    The fabric table of a packing or of a series.

    The RV, ``rmin`` and the initial length L0 of a series are those of its first frame that has
    grains. In a loop over frames, ``compute(frame.read())``, each frame gets its own: hand over the
    series, or name ``rv_radius``, ``rv_center`` and ``cutoff`` as lengths.

    Parameters
    ----------
    source : Packing or Series
        One frame, or what :func:`scanfab.read_series` returns: one frame in memory at a time.
    {options}

    Returns
    -------
    Table
        A row for each frame and variant; lengths in the dump's unit, fabric dimensionless.

    Raises
    ------
    ScanfabError
        If a frame cannot be read, or the settings do not fit the packing.
    TypeError
        If there is no such option; names the nearest that there is.

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab import Packing, compute
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> table = compute(Packing(grid, 0.5), variants="c", contact_tolerance=1e-4, tolerance=0.01)
    >>> bool(table["alpha_c"][0] < 1e-12)
    True
    """
    given = locals()
    settings = Settings(**{option.name: given[option.name] for option in options_of(Settings)})
    return Table(compute_rows(source, settings))


def compute_rows(
    source: Packing | Series,
    settings: Settings,
    *,
    done: Container[int] = (),
    observe: Observer | None = None,
) -> Iterator[Row]:
    """
    The rows of :func:`compute`, in the order of the frames, each as soon as it may come.

    Parameters
    ----------
    source, settings
        As for :func:`compute`.
    done : container of int, optional
        Leave out these frames, which an earlier run has computed.
    observe : callable, optional
        Called with the :class:`FrameResult` of each frame, by the thread that computed it.
    """
    if not isinstance(source, Packing | Series):
        raise SettingsError(f"compute: expected a Packing or a Series, found {source!r}")
    run = _Run(source, settings, done, observe)
    jobs = run.jobs()
    with _Pool(settings.workers) as pool:
        for rows in pool.in_order(jobs):
            yield from rows
    run.finish()


class _Run:
    """
    One series under way.

    Frames are read one after the other until one has grains, which makes the plan; from there on
    they do not depend on one another.
    """

    def __init__(
        self,
        source: Packing | Series,
        settings: Settings,
        done: Container[int],
        observe: Observer | None,
    ) -> None:
        self.source = source
        self.settings = settings
        self.name = "" if isinstance(source, Packing) else source.name
        self.done = done
        self.observe = observe
        self.plan: Plan | None = None
        self.strains = Strains(settings)
        self.particles = 0
        self.found = False

    def jobs(self) -> Iterator[Callable[[int], list[Row]]]:
        """For each chosen frame what computes its rows, with a number of threads."""
        chosen = chosen_frames(self.source, self.settings.frames)
        for number, frame in frames_of(self.source):
            due = number in chosen
            self.found = self.found or due
            due = due and number not in self.done
            if self.plan is None:
                sample = self._read(number, frame.read)
                if sample is not None:
                    self._start(frame, sample)
                    if due:
                        yield partial(self._rows, number, sample)
            elif due:
                yield partial(self._read_rows, number, frame.read)
            if number >= chosen.stop - 1 and self.plan is not None:
                break

    def finish(self) -> None:
        """Complain of frames that do not exist, and of grains that were never met."""
        if not self.found:
            raise no_such_frames(self.source, self.settings.frames)
        if self.plan is None:
            _complain_of_no_grains(self.name, self.particles, self.settings)

    def _start(self, frame: Readable, sample: Sample) -> None:
        """Make the plan, if the frame has grains."""
        self.particles += len(sample.packing)
        if sample.grains.any():
            refuse_unknown_boundary(self.source, sample, self.settings)
            tell_doubts(frame, sample, self.settings)
            self.plan = make_plan(self.settings, sample)
            self.strains.start(sample)

    def _read(self, number: int, read: Callable[[], Packing]) -> Sample | None:
        """The frame; None if it cannot be read and such frames are to be skipped."""
        try:
            return classify(read(), self.settings)
        except (PackingError, ReadError) as error:
            if self.settings.on_error == "stop":
                raise
            warnings.warn(f"frame {number} skipped: {error}", SkippedFrameWarning, stacklevel=2)
            return None

    def _read_rows(self, number: int, read: Callable[[], Packing], threads: int) -> list[Row]:
        sample = self._read(number, read)
        return [] if sample is None else self._rows(number, sample, threads)

    def _rows(self, number: int, sample: Sample, threads: int) -> list[Row]:
        settings = replace(self.settings, workers=threads)
        strains = self.strains.at(number, sample)
        begun = time.perf_counter()
        result = frame_result(self.name, number, sample, self.plan, settings, *strains)
        seconds, grains = time.perf_counter() - begun, int(sample.grains.sum())
        LOGGER.info("%s: frame %d: %d grains in %.2g s", self.name, number, grains, seconds)
        if self.observe is not None:
            self.observe(result)
        return result.rows


class _Pool:
    """Threads that compute frames; with few frames, each has more of them for its scan."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool = ThreadPoolExecutor(workers)

    def __enter__(self) -> _Pool:
        return self

    def __exit__(self, *_: object) -> None:
        # an interrupted run does not wait for the frames under way
        self._pool.shutdown(wait=False, cancel_futures=True)

    def in_order(self, jobs: Iterator[Callable[[int], list[Row]]]) -> Iterator[list[Row]]:
        """The results in the order of the jobs, of which one a worker is under way."""
        first = list(islice(jobs, self.workers))
        threads = max(1, self.workers // max(len(first), 1))
        every = (partial(job, threads) for job in chain(first, jobs))
        return in_order(self._pool, every, self.workers)


def no_such_frames(source: Packing | Series, frames: slice) -> SettingsError:
    """The error for a slice that meets no frame."""
    count = 1 if isinstance(source, Packing) else sum(1 for _ in source)
    name = "the packing" if isinstance(source, Packing) else source.name
    has = "1 frame, 0" if count == 1 else f"{count} frames, 0 to {count - 1}"
    parts = [frames.start, frames.stop, *([] if frames.step is None else [frames.step])]
    spelt = ":".join("" if part is None else str(part) for part in parts)
    return SettingsError(f"frames: the series has no frame in {spelt}: {name} has {has}")


def _complain_of_no_grains(name: str, particles: int, settings: Settings) -> None:
    if particles:
        named = " or ".join(rule.text for rule in settings.boundary)
        raise SettingsError(
            f"boundary: {named} selects all particles of every frame: no grain is left"
        )
    warnings.warn(f"{name}: no frame has any grains", ScanfabWarning, stacklevel=3)


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


def frames_of(source: Packing | Series) -> Iterator[tuple[int, Readable]]:
    """The frames by number; a packing is one."""
    yield from enumerate([_Given(source)] if isinstance(source, Packing) else source)


def refuse_unknown_boundary(source: Packing | Series, first: Sample, settings: Settings) -> None:
    """
    SettingsError if no frame has any of the boundary's particles; a warning if one rule fits none.

    Particles may come in later frames, so those are looked through if the ``first`` has none.
    """
    missing = [rule for rule in settings.boundary if not rule.select(first.packing).any()]
    for _, frame in frames_of(source) if missing else ():
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
    if len(missing) == len(settings.boundary):
        raise SettingsError(message)
    warnings.warn(message, ScanfabWarning, stacklevel=3)


def tell_doubts(frame: Readable, sample: Sample, settings: Settings) -> None:
    """Warn of what looks wrong in a frame before anything is measured."""
    doubts = doubts_of(sample, cell_is_named=frame.cell_is_named)
    doubts.append(cell_doubt(sample, frame.carries))
    if not settings.boundary:
        doubts.append(boundary_hint(sample, settings) or "")
    for doubt in filter(None, doubts):
        warnings.warn(doubt, ScanfabWarning, stacklevel=3)


def chosen_frames(source: Packing | Series, frames: slice) -> range:
    """The frames to compute, in the order of the source."""
    bounds = (frames.start, frames.stop, frames.step)
    if any(bound is not None and bound < 0 for bound in bounds):
        count = 1 if isinstance(source, Packing) else sum(1 for _ in source)
        chosen = range(count)[frames]
        return chosen if chosen.step > 0 else chosen[::-1]
    # without counting the frames first: a dump may hold very many
    endless = 2**62
    return range(endless)[frames]


def classify(packing: Packing, settings: Settings) -> Sample:
    """Contacts and boundary of a frame."""
    if packing.contacts is None:
        packing = find_contacts(packing, settings.contact_tolerance)
    return Sample(packing, select_boundary(packing, settings.boundary), settings.min_contacts)


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
