"""compute(): the frames of a series side by side, as rows of the fabric table in their order."""

from __future__ import annotations

import logging
import os
import platform
import time
import warnings
from collections import deque
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import SKIPPED, Note, PackingError, ReadError, tell
from scanfab.base.option import options_of, takes_options, unusable
from scanfab.io.frame import Frame
from scanfab.packing.bodies import Grouping, regrouped
from scanfab.packing.cell import Cell
from scanfab.packing.escaped import ESCAPED
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.pipeline.cluster import DaskExecutor, DeadWorkersError
from scanfab.pipeline.frame import FrameResult, compute_frame
from scanfab.pipeline.frames import Frames, Source
from scanfab.pipeline.plan import Plan, make_plan, plan_without_grains
from scanfab.pipeline.settings import MAX_CHORDS, Settings
from scanfab.pipeline.strain import Flips
from scanfab.pipeline.told import heard_by_thread
from scanfab.scan.directions import DirectionRule
from scanfab.table.row import Row
from scanfab.table.table import Table

LOGGER = logging.getLogger("scanfab")

Observer = Callable[[FrameResult], None]


@takes_options(options_of(Settings))
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
    tolerance: float = 1e-4,
    max_chords: float = MAX_CHORDS,
    min_contacts: int = 2,
    rattlers: str = "count",
    min_force: float = 0.0,
    contact_tolerance: float = 0.0,
    axis: str | Sequence[float] | None = None,
    with_: str | Sequence[str] | None = None,
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
    source : Packing, Series or iterable of Packing
        One frame, or many: what :func:`scanfab.read_series` returns, or packings from anywhere, for
        instance a generator that yields those of a running simulation. One frame a worker is in
        memory, unless `frames` counts from the end of an iterable.
    executor : concurrent.futures.Executor, optional
        Computes the frames in place of threads of this process, `workers` of them at a time, each
        scanned by one thread; that of :func:`scanfab.dask_executor` as many as its workers take.
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
    return Table(compute_rows(source, settings, executor=executor))


def compute_rows(source: Source, settings: Settings, **more: Any) -> Iterator[Row]:
    """The rows of :func:`compute_frames`, one by one."""
    for rows in compute_frames(source, settings, **more):
        yield from rows


def compute_frames(
    source: Source,
    settings: Settings,
    *,
    done: Container[int] = (),
    observe: Observer | None = None,
    executor: Executor | None = None,
) -> Iterator[list[Row]]:
    """
    The rows of :func:`compute`, those of each frame as soon as they may come, in their order.

    Parameters
    ----------
    source, settings, executor
        As for :func:`compute`.
    done : container of int, optional
        Leave out these frames, which an earlier run has computed.
    observe : callable, optional
        Called with the :class:`FrameResult` of each frame, where that is computed.

    Yields
    ------
    list of Row
        None are empty: frames that are skipped are left out.
    """
    run = _Run(Frames(source, settings))
    with _pool(settings.workers, executor) as pool:
        for computed in in_order(pool, run.jobs(done, observe), settings.on_error == "skip"):
            run.tell(computed)
            if computed.rows:
                yield computed.rows
    if not run.has_grains:
        tell([run.frames.without_grains()], run.frames.name)


@dataclass(frozen=True, eq=False)
class _Computed:
    """What comes back of a frame, also from another process."""

    number: int
    rows: list[Row] = field(default_factory=list)
    notes: tuple[Note, ...] = ()
    cell: Cell | None = None
    """None also if the frame has no grains."""
    grouping: Grouping | None = None
    """None also if each sphere is a grain."""
    heard: tuple[Warning, ...] = ()
    """Warnings of another process, where nobody hears them."""


@dataclass(frozen=True, eq=False)
class _FrameJob:
    """One frame to be computed, here or in another process."""

    frame: Sample | Packing | Frame
    plan: Plan
    number: int
    source: str
    observe: Observer | None
    file: Frame | None = None
    """Where another process finds the frame, if it lies in files."""
    home: tuple[str, int] = field(default_factory=lambda: _here())
    """The machine and process that hears warnings."""

    def __str__(self) -> str:
        return f"frame {self.number}"

    def __getstate__(self) -> dict[str, Any]:
        # what was read here, is read again there
        if self.file is None:
            return dict(vars(self))
        alone = self.file.alone()
        return {**vars(self), "frame": alone, "file": alone}

    @property
    def path(self) -> Path | None:
        """Where the frame is read from, if it lies in a file."""
        return None if self.file is None else self.file.snapshot.path.absolute()

    def __call__(self, threads: int) -> _Computed:
        plan = replace(self.plan, workers=threads)
        if _here() == self.home:
            return self._computed(plan)
        with heard_by_thread() as caught:
            found = self._computed(plan)
        return replace(found, heard=tuple(caught))

    def _computed(self, plan: Plan) -> _Computed:
        begun = time.perf_counter()
        found = compute_frame(self.frame, plan, number=self.number, source=self.source)
        seconds = time.perf_counter() - begun
        grains = found.sample.number(found.sample.grains)
        LOGGER.info("%s: frame %d: %d grains in %.2g s", self.source, self.number, grains, seconds)
        if self.observe is not None:
            self.observe(found)
        packing, grouping = found.sample.packing, None
        if packing.bodies is not None:
            grouping = Grouping(packing.id, packing.id[packing.bodies.head])
        cell = packing.cell if grains else None
        return _Computed(self.number, found.rows, found.notes, cell, grouping)


def _here() -> tuple[str, int]:
    return platform.node(), os.getpid()


class _Run:
    """
    One series under way.

    The first frame that has grains makes the plan; from there on frames do not depend on one
    another.
    """

    def __init__(self, frames: Frames) -> None:
        self.frames = frames
        self.has_grains = False
        self._flips = Flips(frames.settings.frames.step)
        self._first_grouping: tuple[int, Grouping] | None = None
        self._told_once: set[str] = set()

    def jobs(self, done: Container[int], observe: Observer | None) -> Iterator[_FrameJob | None]:
        """The chosen frames that are not done; None where one is still to come."""
        plan = self._plan()
        for due in self.frames.as_they_come():
            if due is None:
                yield None
                continue
            number, frame = due
            known = self.frames.ready.pop(number, frame)
            if number not in done and known is not None:
                file = frame if isinstance(frame, Frame) else None
                yield _FrameJob(known, plan, number, self.frames.name, observe, file)

    def _plan(self) -> Plan:
        """Settings end here."""
        settings = self.frames.settings
        # an error in a file of strains comes before the first frame
        plan = plan_without_grains(settings)
        first = self.frames.first()
        if first is None:
            return plan
        self.has_grains = True
        _, frame, sample = first
        tell(self.frames.notes(frame, sample))
        plan = make_plan(settings, sample)
        tell(plan.notes)
        return plan

    def tell(self, computed: _Computed) -> None:
        """Tell what there is to tell of a frame."""
        for warning in computed.heard:
            warnings.warn(warning, stacklevel=3)
        # a grain that flew away goes on flying: once a series is enough
        notes = [one for one in computed.notes if one.code not in {ESCAPED} & self._told_once]
        self._told_once |= {one.code for one in notes}
        tell(notes, f"frame {computed.number}")
        tell(self._flips.notes(computed.number, computed.cell))
        if computed.grouping is None:
            return
        if self._first_grouping is None:
            self._first_grouping = computed.number, computed.grouping
        note = regrouped(*self._first_grouping, computed.grouping)
        if note is not None and note.code not in self._told_once:
            self._told_once.add(note.code)
            tell([note], f"frame {computed.number}")


@contextmanager
def _pool(workers: int, executor: Executor | None) -> Iterator[_Pool]:
    """What computes frames; with few frames, each has more threads of this process for its scan."""
    if isinstance(executor, DaskExecutor):
        yield _Pool(executor, executor.room)
    elif isinstance(executor, Executor):
        # how many processors there are elsewhere, only the executor knows
        yield _Pool(executor, lambda: workers)
    elif executor is not None:
        raise unusable("executor", "a concurrent.futures.Executor", executor)
    else:
        own = ThreadPoolExecutor(workers)
        try:
            yield _Pool(own, lambda: workers, workers)
        finally:
            # an interrupted run does not wait for the frames under way
            own.shutdown(wait=False, cancel_futures=True)


class _Pool(NamedTuple):
    """An executor, how many frames may be under way there, and the threads that they share."""

    executor: Executor
    room: Callable[[], int]
    threads: int = 1


def in_order(
    pool: _Pool, jobs: Iterator[_FrameJob | None], skips: bool = False
) -> Iterator[_Computed]:
    """
    The results of jobs, in the order of the jobs.

    Parameters
    ----------
    pool : _Pool
        Does the jobs.
    jobs : iterator
        None where the next job is not there yet: a result that is ready then comes meanwhile. If
        the jobs end in an error, the results of those under way come before it.
    skips : bool, optional
        A frame that cannot be computed is told, in place of an error.
    """
    waiting: deque[tuple[_FrameJob, Future[_Computed]]] = deque()
    ready: list[_Computed] = []
    over: Exception | None = None
    try:
        while waiting or ready or over is None:
            fresh: list[_FrameJob] = []
            room = pool.room() - len(waiting)
            try:
                while not over and len(fresh) < room and (job := next(jobs)) is not None:
                    fresh.append(job)
            except Exception as error:
                over = error
            threads = max(pool.threads // max(len(waiting) + len(fresh), 1), 1)
            waiting.extend((job, pool.executor.submit(job, threads)) for job in fresh)
            # the next jobs are begun before this, as whoever takes a result may be slow
            yield from ready
            ready.clear()
            if waiting and (waiting[0][1].done() or over or len(waiting) >= pool.room()):
                ready.append(_result(*waiting.popleft(), skips))
        if not isinstance(over, StopIteration):
            raise over
    finally:
        # the executor may go on for others
        for _, future in waiting:
            future.cancel()


def _result(job: _FrameJob, future: Future[_Computed], skips: bool) -> _Computed:
    """What has become of a frame; one that cannot be computed is skipped, or ends the run."""
    try:
        return future.result()
    except (PackingError, ReadError, DeadWorkersError) as error:
        if not skips:
            raise
        text = str(error).removeprefix(f"frame {job.number}: ")
        return _Computed(job.number, notes=(Note(SKIPPED, text),))
