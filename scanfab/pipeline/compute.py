"""compute(): the one place that knows all the steps, from packings to rows of the fabric table."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path

from scanfab.base.option import options_of, takes_options
from scanfab.base.threads import in_order
from scanfab.io.series import Series
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.pipeline.frame import FrameResult, frame_result
from scanfab.pipeline.frames import Frames, Readable
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import MAX_CHORDS, Settings
from scanfab.pipeline.strain import Strains
from scanfab.scan.directions import DirectionRule
from scanfab.table.table import Row, Table

__all__ = ["FrameResult", "compute", "compute_rows"]

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
    rattlers: str = "count",
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
    run = _Run(Frames(source, settings), done, observe)
    with _Pool(settings.workers) as pool:
        for rows in pool.in_order(run.jobs()):
            yield from rows
    if run.plan is None:
        run.frames.complain_of_no_grains()


class _Run:
    """
    One series under way.

    The first frame that has grains makes the plan; from there on frames do not depend on one
    another.
    """

    def __init__(self, frames: Frames, done: Container[int], observe: Observer | None) -> None:
        self.frames = frames
        self.settings = frames.settings
        self.done = done
        self.observe = observe
        self.plan: Plan | None = None
        self.strains = Strains(frames.settings)

    def jobs(self) -> Iterator[Callable[[int], list[Row]]]:
        """For each chosen frame what computes its rows, with a number of threads."""
        first = self.frames.first()
        if first is not None:
            self._start(*first[1:])
        for number, frame in self.frames.due():
            if number not in self.done:
                yield partial(self._rows, number, frame)

    def _start(self, frame: Readable, sample: Sample) -> None:
        """Make the plan."""
        self.frames.tell_doubts(frame, sample)
        self.plan = make_plan(self.settings, sample)
        self.strains.start(sample)

    def _rows(self, number: int, frame: Readable, threads: int) -> list[Row]:
        sample = self.frames.sample(number, frame)
        if sample is None:
            return []
        settings = replace(self.settings, workers=threads)
        strains = self.strains.at(number, sample)
        begun = time.perf_counter()
        result = frame_result(self.frames.name, number, sample, self.plan, settings, *strains)
        seconds, grains = time.perf_counter() - begun, int(sample.grains.sum())
        LOGGER.info("%s: frame %d: %d grains in %.2g s", self.frames.name, number, grains, seconds)
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
