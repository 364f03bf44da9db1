"""The computation of a table under way: its rows, those of earlier runs among them, its files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabNote, SettingsError
from scanfab.base.files import check_folder
from scanfab.io.follow import FollowedSeries
from scanfab.io.series import Series
from scanfab.pipeline.compute import Observer, compute_rows
from scanfab.pipeline.frames import NoChosenFrameError, chosen_frames
from scanfab.pipeline.manifest import (
    Inputs,
    asked_for,
    default_settings,
    manifest,
    with_frames,
    write_manifest,
)
from scanfab.pipeline.resume import FinishedTable, InputsOfRows, check_part, finished_table
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.told import Told
from scanfab.table.reading import read_rows
from scanfab.table.result_file import ResultFile
from scanfab.table.row import Row
from scanfab.table.writing import ALL

Advance = Callable[..., object]
"""Called after each finished frame, with ``new=False`` if an earlier run has computed it."""


class Job:
    """
    One table of some series, computed frame by frame; an interrupted one can be gone on with.

    Rows come from three places: from FILE.part, which holds the first ones as an interrupted run
    has left them; from a complete FILE, where its frames are asked for again; all others from now.

    Parameters
    ----------
    series : sequence of Series
        With names of their own.
    settings : Settings
        Of all of them.
    result : ResultFile, optional
        The file of the rows; without it they are to be taken from :meth:`rows`.
    sources, reading
        What the series were opened by, for the manifest: as of :func:`asked_for`.
    resume : bool, optional
        Go on with what earlier runs have left.
    manifest_path : Path, optional
        A manifest there too.
    observers : sequence of callable, optional
        For each series what is called with the result of each frame that is computed now.
    told : Told, optional
        What is told meanwhile, for the manifest.
    keep : bool, optional
        Keep all rows in memory too.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.

    Raises
    ------
    SettingsError
        If two series have one name, or the folder of the manifest does not exist.
    """

    def __init__(
        self,
        series: Sequence[Series],
        settings: Settings,
        result: ResultFile | None = None,
        *,
        sources: Sequence[str],
        reading: Mapping[str, Any],
        resume: bool = False,
        manifest_path: Path | None = None,
        observers: Sequence[Observer] = (),
        told: Told | None = None,
        keep: bool = False,
        executor: Executor | None = None,
    ) -> None:
        names = [one.name for one in series]
        for name in names:
            if names.count(name) > 1:
                raise SettingsError(
                    f"{name}: named twice among the series: the rows of a table are told apart by "
                    f"their source and frame"
                )
        if manifest_path is not None:
            check_folder(manifest_path)
        self.series = series
        self.settings = settings
        self.result = result
        self.resume = resume
        excerpt = ALL if result is None else result.excerpt
        self.asked = asked_for(sources, reading, settings, excerpt)
        """What decides the bytes of the result."""
        self.done = 0
        """Finished frames, those of earlier runs among them."""
        self.is_over = False
        """Whether all rows have come: the table is being made of them."""
        self.table: FinishedTable | None = None
        """The complete FILE that is gone on with."""
        self.kept: list[dict[str, Any]] = []
        """The rows, if they are to be kept."""
        self.found_void_fabric = False
        """Whether any row has one."""
        self._told = told or Told()
        self._keep = keep
        self._executor = executor
        self._observers: Sequence[Observer | None] = observers or [None] * len(series)
        self._part: list[dict[str, Any]] = []
        self._has_gaps = False
        self._inputs = Inputs()
        self._inputs_of_rows = InputsOfRows(series, settings, self._inputs)
        self._manifests = [
            *([] if result is None else [result.manifest]),
            *([] if manifest_path is None else [manifest_path]),
        ]

    @property
    def is_good(self) -> bool:
        """Whether no frame was skipped, now or by an earlier run, and one has a void fabric."""
        skipped = bool(self._told.skipped) or self._has_gaps
        # a table without frames, of a job that none was left for, lacks nothing
        return not skipped and (self.found_void_fabric or not self.done)

    def frames(self) -> int:
        """About how many frames there are to be finished, those of earlier runs among them."""
        frames = self.settings.frames
        expected = sum(len(range(one.frames_expected())[frames]) for one in self.series)
        return max(expected, self.done)

    @contextmanager
    def begun(self) -> Iterator[None]:
        """
        Keep other runs away from the file in the block; if resumed, find what they have left.

        Raises
        ------
        ScanfabError
            If another run writes to the file.
        SettingsError
            If what is there was made with other settings or of other inputs.
        """
        with nullcontext() if self.result is None else self.result.alone():
            if self.resume and self.result is not None:
                self._find_rows(self.result)
            yield

    def rows(self, advance: Advance = lambda new: None) -> Iterator[Row]:
        """The rows behind those of FILE.part; a frame is finished once its rows are taken."""
        for number, row in enumerate(self._rows(), start=1):
            self.found_void_fabric = self.found_void_fabric or row.alpha_vs is not None
            if self._keep:
                self.kept.append(dict(row))
            yield row
            if number % self.settings.rows_per_frame == 0:
                self.done += 1
                advance(new=not self._is_taken_over(row))
        self.is_over = True
        for one in self.series:
            if isinstance(one, FollowedSeries):
                one.end()

    def write(self, advance: Advance = lambda new: None) -> None:
        """
        Write the rows to the file as they come; it is complete or untouched.

        Raises
        ------
        ScanfabError
            If a frame cannot be computed; what is finished stays in FILE.part.
        OSError
            If the file cannot be written to.
        """
        result = self.result
        assert result is not None
        # it loses its manifest when it is replaced
        replaces = result.has_table and not self.resume
        with result.writer(self.asked, self.resume, self._save_manifest) as writer:
            for row in self.rows(advance):
                if replaces:
                    _note_replaced(result.path)
                    replaces = False
                result.record(self._inputs_of_rows.new(row))
                writer.write(row)
            if replaces and read_rows(result.path):
                raise SettingsError(
                    f"{result.path}: this run has no rows, and the table that is there stays as it "
                    f"is: choose frames that there are (`frames`), or another file"
                )

    def save_manifests(self, more: Mapping[str, Any] | None = None) -> None:
        """Write the manifest beside the file, and where it was asked for, with some ``more``."""
        for path in self._manifests:
            self._save_manifest(path, more)

    def _save_manifest(self, path: Path, more: Mapping[str, Any] | None = None) -> None:
        # what was told of the rows that an earlier run has finished
        before = [] if self.table is None else self.table.warnings
        texts = [*dict.fromkeys([*before, *self._told.warnings])]
        found = manifest(self.asked, self.series, texts, self._told.notes, self._inputs)
        write_manifest(path, {**found, **(more or {})})

    @property
    def _there(self) -> list[Series]:
        """The series as they are now, also those that are followed."""
        return [one.as_it_is if isinstance(one, FollowedSeries) else one for one in self.series]

    def _find_rows(self, result: ResultFile) -> None:
        """
        The rows of earlier runs; what is asked for gets their frames too.

        A part is of the run that was interrupted last, so it counts, whatever FILE holds.
        """
        series = self._there
        if result.path.is_file():
            try:
                self.table = finished_table(result.path, self.asked, series, self.settings)
                frames = self.table.with_frames(series, self.settings.frames)
                self.settings = replace(self.settings, frames=frames)
                self.asked = with_frames(self.asked, frames)
            except (SettingsError, ReadError):
                if not result.has_part:
                    raise
                self.table = None
        rows_per_frame = self.settings.rows_per_frame
        self._part = result.finished_rows(self.asked, rows_per_frame, default_settings())
        of_part = {"settings": self.asked, "inputs": result.recorded_inputs()}
        check_part(result.part, of_part, self._part, series, self.settings)
        in_part = any(row["alpha_vs"] is not None for row in self._part)
        in_table = self.table is not None and self.table.has_void_fabric
        self.found_void_fabric = in_part or in_table
        self._has_gaps = any(map(self._lacks_frames, series))
        self.kept = list(self._part) if self._keep else []
        self.done = len(self._part) // self.settings.rows_per_frame

    def _lacks_frames(self, series: Series) -> bool:
        """Whether FILE.part lacks frames of a series before the last one that it has."""
        written = {row["frame"] for row in self._part if row["source"] == series.name}
        if not written:
            return False
        chosen = chosen_frames(series, self.settings.frames)
        return len(range(chosen.start, max(written) + 1, chosen.step)) > len(written)

    def _is_taken_over(self, row: Row) -> bool:
        """Whether a row stands in the complete FILE."""
        return self.table is not None and row.frame in self.table.rows[row.source]

    def _rows(self) -> Iterator[Row]:
        last = self._part[-1] if self._part else None
        names = [one.name for one in self.series]
        first = names.index(last["source"]) if last is not None else 0
        for one, observe in list(zip(self.series, self._observers, strict=True))[first:]:
            start = last["frame"] + 1 if last is not None and one.name == last["source"] else 0
            of_table = {} if self.table is None else self.table.rows[one.name]
            ready = {frame: rows for frame, rows in of_table.items() if frame >= start}
            done = {*range(start), *ready}
            computed = compute_rows(
                one, self.settings, done=done, observe=observe, executor=self._executor
            )
            try:
                yield from _in_order(ready, computed)
            except NoChosenFrameError as none:
                # of an array of more jobs than frames some have nothing to do
                text = str(none).removeprefix("frames: ")
                warnings.warn(f"{text}: it has no row in this table", ScanfabNote, stacklevel=3)


def _in_order(ready: dict[int, list[Row]], computed: Iterator[Row]) -> Iterator[Row]:
    """Rows that are there and rows that come, by frame."""
    waiting = sorted(ready, reverse=True)
    for row in computed:
        while waiting and waiting[-1] < row.frame:
            yield from ready[waiting.pop()]
        yield row
    while waiting:
        yield from ready[waiting.pop()]


def _note_replaced(output: Path) -> None:
    warnings.warn(
        f"{output}: the table that is there will be replaced at the end of this run; `resume` "
        f"would go on with it",
        ScanfabNote,
        stacklevel=3,
    )
