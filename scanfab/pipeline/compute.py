"""compute() and fabric_map(): frames side by side in an executor, and their rows in order."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import (
    Note,
    PackingError,
    ReadError,
    SkippedFrameWarning,
    collected,
    tell,
)
from scanfab.base.option import options_of, takes_options, unusable
from scanfab.base.spelling import spelt_time
from scanfab.io.frame import Frame
from scanfab.io.reader import READING_OPTIONS
from scanfab.packing.sample import Sample
from scanfab.pipeline.cluster import DaskExecutor, DeadWorkersError
from scanfab.pipeline.frame import FrameResult, compute_frame
from scanfab.pipeline.frames import Frames, Source, Unread, doubts_of_frame
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.series_notes import Facts, SeriesNotes
from scanfab.pipeline.settings import Settings
from scanfab.scan.directions import DirectionRule
from scanfab.table.row import Row
from scanfab.table.table import Table

LOGGER = logging.getLogger("scanfab")

Observer = Callable[[FrameResult], None]

# a run that waits for a frame asks so often, in seconds, how many frames the workers can take
PAUSE = 2.0


@takes_options(options_of(Settings), READING_OPTIONS)
def compute(
    source: Source,
    *,
    executor: Executor | None = None,
    variants: str = "abcd",
    rv: str | float | Sequence[float] = 0.7,
    rv_radius: float | None = None,
    rv_center: str | Sequence[float] | None = None,
    rv_shape: str | Path = "sphere",
    rv_size: str | Sequence[float] | None = None,
    rv_axis: str | Sequence[float] | None = None,
    rv_follows: str = "none",
    edge: str = "clip",
    boundary: str | Sequence[str] = (),
    cutoff: str | float = "1rmin",
    cutoffs: str | float | Iterable[str | float] | None = None,
    moment: int = 1,
    spacing: str | float = "auto",
    directions: str | int | DirectionRule = "auto",
    tolerance: str | float = "auto",
    max_chords: float | None = None,
    min_contacts: int = 2,
    rattlers: str = "count",
    min_force: float = 0.0,
    contact_tolerance: float = 0.0,
    axis: str | Sequence[float] | None = None,
    with_: str | Sequence[str] | None = None,
    strain: str | Path = "auto",
    frames: str | int | slice | None = None,
    reference: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    on_error: str = "stop",
) -> Table:
    """
    Compute the fabric table of a packing or of a series.

    The first frame of a series that has grains decides its RV, ``rmin`` and initial length L0. In a
    loop over frames, ``compute(frame.read())``, each frame would have its own: pass the series, or
    give ``rv_radius``, ``rv_center`` and ``cutoff`` as lengths.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        One frame, or many: what :func:`scanfab.read_series` returns, or packings from anywhere, for
        instance from a generator that yields the packings of a running simulation. Only one frame
        per worker is in memory, unless `frames` counts from the end of an iterable.
    executor : concurrent.futures.Executor, optional
        Computes the frames, `workers` at a time, each with one thread. By default threads of this
        process do. An executor of :func:`scanfab.dask_executor` gets as many frames as its workers
        have threads.
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
        If there is no such option; the message suggests the most similar name.

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
    return Table(compute_rows(source, settings, executor=executor))


def fabric_map(
    source: Source,
    *,
    grid: str | Sequence[int] | None = None,
    slices: int | None = None,
    shells: int | None = None,
    executor: Executor | None = None,
    **options: Any,
) -> Table:
    """
    Compute the fabric of a packing or of a series block by block.

    A void segment belongs to the block that holds its middle, a contact to the block of its contact
    point, and a grain to the block of its centre. Blocks tile the box around the grains in the
    first frame; along periodic vectors they tile the cell, and for variants c and d the box around
    the RV. The tolerance holds for the median block. A warning reports √F, the scatter of the
    blocks relative to their errors, and its p-value.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        As for :func:`scanfab.compute`.
    grid : str or three ints, optional
        Number of blocks along x, y and z.
    slices : int, optional
        Number of slices of equal thickness along `axis`.
    shells : int, optional
        Number of shells about the centre, out to half the smallest extent, or to the reach of the
        RV.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.
    **options
        Options of :func:`scanfab.compute` except `cutoffs` and `with_`; `variants` is ``"a"`` by
        default.

    Returns
    -------
    Table
        A row for each frame, variant and block; lengths in the dump's unit, fabric dimensionless.

    Raises
    ------
    ScanfabError
        If a frame cannot be read, the settings do not fit the packing, or blocks are smaller than
        a grain.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from scanfab import Cell, Packing, fabric_map, find_contacts
    >>> place = np.random.default_rng(0).uniform(0, 12, (400, 3))
    >>> packing = find_contacts(Packing(place, 0.7, cell=Cell([12.0] * 3)))
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     table = fabric_map(packing, slices=2, tolerance=0.01)
    >>> str(told[-1].message)
    'frame 0, variant a: too few blocks to tell whether the sample is homogeneous'
    >>> table["z"].tolist(), int(table["grains"].sum())
    ([3.0, 9.0], 400)
    """
    settings = MapSettings(grid=grid, slices=slices, shells=shells, **options)
    return Table(compute_rows(source, settings, executor=executor), settings.columns)


def compute_rows(
    source: Source,
    settings: Settings,
    *,
    observe: Observer | None = None,
    executor: Executor | None = None,
) -> Iterator[Row]:
    """The rows of :func:`compute_frames`, one by one."""
    for rows in compute_frames(source, settings, observe=observe, executor=executor):
        yield from rows


def compute_frames(
    source: Source,
    settings: Settings,
    *,
    done: Container[int] = (),
    observe: Observer | None = None,
    executor: Executor | None = None,
    name: str = "",
) -> Iterator[list[Row]]:
    """
    Compute the rows of :func:`compute`, frame by frame in the order of the series.

    Parameters
    ----------
    source, settings, executor
        As for :func:`compute`.
    done : container of int, optional
        Frames to leave out, because an earlier run has computed them.
    observe : callable, optional
        Called with the :class:`FrameResult` of each frame, in the process that computes it.
    name : str, optional
        The name of the series in the notes on its frames, if there are several series.

    Yields
    ------
    list of Row
        The rows of a frame as soon as it and all frames before it are computed; nothing for a frame
        that is skipped.
    """
    if not isinstance(executor, Executor | None):
        raise unusable("executor", "a concurrent.futures.Executor", executor)
    frames = Frames(source, settings)
    with collected() as told:
        number, _, first = frames.reference()
    plan = make_plan(settings, first)
    tell(plan.notes)
    smallest = float(first.packing.radius[first.grains].min())
    notes = SeriesNotes(frames.settings, name, (number, smallest))
    own = ThreadPoolExecutor(settings.workers)
    try:
        jobs = _jobs(frames, plan, done, observe, told, is_far=executor is not None)
        for computed in _in_order(jobs, executor or own, settings, own):
            notes.add(computed.number, computed.rows, computed.notes, computed.facts)
            if computed.rows:
                yield computed.rows
    finally:
        notes.end()
        # an interrupted run does not wait for the frames under way
        own.shutdown(wait=False, cancel_futures=True)


def _jobs(
    frames: Frames, plan: Plan, done: Container[int], observe: Observer | None, told: list[Note],
    is_far: bool,
) -> Iterator[_Job | None]:  # fmt: skip
    """
    The chosen frames that are not done; None while the next frame of a simulation is missing.

    ``told`` is what was said while the reference frame was read.
    """
    for due in frames.as_they_come():
        if due is None:
            yield None
            continue
        number, frame = due
        known = frames.ready.pop(number, frame)
        if number in done or known is None:
            continue
        sample = known if isinstance(known, Sample) else None
        if is_far and isinstance(frame, Frame):
            # another process reads the frame itself, even if it was read here
            frame, sample = frame.alone(), None
        already = told if sample is not None else []
        yield _Job(frame, sample, plan, number, frames.name, observe, already)


class _Computed(NamedTuple):
    """The result of a frame, which may come from another process."""

    number: int
    rows: list[Row]
    notes: Sequence[Note]
    facts: Facts | None = None
    """None if the frame has no grains."""


@dataclass(frozen=True, eq=False)
class _Job:
    """One frame to be computed, by a thread of this process or by another process."""

    frame: Unread
    sample: Sample | None
    """What is in the frame, if it was read already."""
    plan: Plan
    number: int
    source: str
    observe: Observer | None
    told: Sequence[Note]
    """What was said while it was read."""

    def __str__(self) -> str:
        return f"frame {self.number}"

    @property
    def path(self) -> Path | None:
        """The file of the frame, if it comes from a file."""
        return self.frame.snapshot.path if isinstance(self.frame, Frame) else None

    def __call__(self, threads: int) -> _Computed:
        begun = time.perf_counter()
        plan = replace(self.plan, workers=threads)
        with collected() as told:
            frame = self.sample or self.frame
            found = compute_frame(frame, plan, number=self.number, source=self.source)
        seconds, sample = time.perf_counter() - begun, found.sample
        grains = sample.number(sample.grains)
        spent = spelt_time(seconds)
        LOGGER.info("%s: frame %d: %d grains in %s", self.source, self.number, grains, spent)
        if self.observe is not None:
            self.observe(found)
        doubts = doubts_of_frame(self.frame, sample, plan.settings)
        notes = [*self.told, *told, *doubts, *found.notes]
        return _Computed(self.number, found.rows, notes, Facts.of(sample) if grains else None)


def _in_order(
    jobs: Iterator[_Job | None], executor: Executor, settings: Settings, own: Executor
) -> Iterator[_Computed]:
    """
    The results of jobs, in the order of the jobs.

    A job is None while the next job is missing; meanwhile results are returned. If the iterator of
    jobs raises an error, the results of the jobs under way come first. If there are fewer jobs than
    threads in the ``own`` executor, each job gets several threads.
    """
    waiting: deque[tuple[_Job, Future[_Computed]]] = deque()
    end: Exception | None = None
    try:
        while waiting or end is None:
            # only Dask knows how many threads its workers have
            known = executor.threads() if isinstance(executor, DaskExecutor) else settings.workers
            room = max(known, 1)
            fresh, computed = list[_Job](), None
            if waiting and (end or len(waiting) >= room):
                wait([waiting[0][1]], PAUSE)
            if waiting and waiting[0][1].done():
                computed = _result(executor, *waiting.popleft(), settings.on_error == "skip")
            try:
                while not end and len(waiting) + len(fresh) < room and (job := next(jobs)):
                    fresh.append(job)
            except Exception as error:
                end = error
            under_way = max(len(waiting) + len(fresh), 1)
            threads = max(settings.workers // under_way, 1) if executor is own else 1
            waiting.extend((job, executor.submit(job, threads)) for job in fresh)
            # yielded after the next jobs have started, because the caller may be slow
            if computed is not None:
                yield computed
        if not isinstance(end, StopIteration):
            raise end
    finally:
        # the executor may be used further
        for _, future in waiting:
            future.cancel()


def _result(executor: Executor, job: _Job, future: Future[_Computed], skips: bool) -> _Computed:
    """The result of a job; if it failed, the frame is skipped or the error is raised."""
    try:
        return future.result()
    except Exception as found:
        error = executor.explained(found, job) if isinstance(executor, DaskExecutor) else found
        if not skips or not isinstance(error, PackingError | ReadError | DeadWorkersError):
            raise error from None
        text = str(error).removeprefix(f"{job}: ")
        return _Computed(job.number, [], [Note("skipped", text, kind=SkippedFrameWarning)])
