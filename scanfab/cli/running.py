"""A computation under way: its rows, those of earlier runs among them, and how far it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scanfab.cli.options import usage_errors

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.compute import Observer
    from scanfab.pipeline.resume import FinishedTable
    from scanfab.pipeline.settings import Settings
    from scanfab.table.result_file import ResultFile
    from scanfab.table.table import Row

__all__ = ["Run"]


class Run:
    """
    The series of one command, and what becomes of their rows.

    Rows come from three places: from FILE.part, which holds the first ones as an interrupted run
    has left them; from a complete FILE, where its frames are asked for again; all others from now.
    """

    def __init__(
        self,
        series: list[Series],
        settings: Settings,
        vtk_folder: Path | None,
        resume: bool,
        keep: bool,
    ) -> None:
        from scanfab.pipeline.manifest import Inputs
        from scanfab.pipeline.resume import InputsOfRows

        self.series = series
        self.settings = settings
        self.resume = resume
        self.found = False
        """Whether any row has a void fabric."""
        self.skipped = False
        """Whether an earlier run has skipped frames."""
        self.kept: list[dict[str, Any]] = []
        """The rows, if they are wanted."""
        self.part: list[dict[str, Any]] = []
        """Rows that stand in FILE.part."""
        self.table: FinishedTable | None = None
        """The complete FILE."""
        self.is_over = False
        """Whether all rows have come: the table is being made of them."""
        self.done = 0
        """Finished frames."""
        self.inputs = Inputs()
        """What the files hold, as far as rows have come."""
        self._told = InputsOfRows(series, settings, self.inputs)
        self._keep = keep
        self._observers = _vtk_folders(vtk_folder, series, settings, resume)

    def go_on(self, result: ResultFile, asked: dict[str, Any]) -> dict[str, Any]:
        """
        Find the rows of earlier runs; returns what is asked for with their frames.

        A part is of the run that was interrupted last, so it counts, whatever FILE holds.
        """
        from scanfab.base.errors import SettingsError
        from scanfab.pipeline.manifest import default_settings, with_frames
        from scanfab.pipeline.resume import check_part, finished_table

        if result.path.is_file():
            try:
                self.table = finished_table(result.path, asked, self.series, self.settings)
                frames = self.table.with_frames(self.series, self.settings.frames)
                self.settings = replace(self.settings, frames=frames)
                asked = with_frames(asked, frames)
            except SettingsError:
                if not result.has_part:
                    raise
                self.table = None
        rows_per_frame = self.settings.rows_per_frame
        self.part = result.finished_rows(asked, rows_per_frame, default_settings())
        of_part = {"settings": asked, "inputs": result.recorded_inputs()}
        check_part(result.part, of_part, self.part, self.series, self.settings)
        self.found = any(row["alpha_vs"] is not None for row in self.part)
        if self.table is not None:
            self.found = self.found or self.table.has_void_fabric
        self.skipped = self._has_gaps(self.part)
        self.kept = list(self.part) if self._keep else []
        self.done = len(self.part) // self.settings.rows_per_frame
        return asked

    def _has_gaps(self, done: list[dict[str, Any]]) -> bool:
        """Whether an earlier run has skipped frames between those that it has written."""
        from scanfab.pipeline.frames import chosen_frames

        for one in self.series:
            written = {row["frame"] for row in done if row["source"] == one.name}
            if not written:
                continue
            chosen = chosen_frames(one, self.settings.frames)
            due = range(chosen.start, max(written) + 1, chosen.step)
            if len(due) > len(written):
                return True
        return False

    def new_inputs(self, row: Row) -> list[dict[str, Any]]:
        """What files hold that a row comes from, each once."""
        return self._told.new(row)

    def frames(self) -> int:
        """About how many frames there are to be finished, those of earlier runs among them."""
        frames = self.settings.frames
        return sum(len(range(one.frames_expected())[frames]) for one in self.series)

    def standing(self) -> str:
        """How many frames are finished, for the sentence that tells of an interruption."""
        if self.is_over:
            return "after the last frame, before the table was complete"
        return f"after {self.done} of {max(self.frames(), self.done)} frames"

    def rows(self) -> Iterator[Row]:
        """The rows behind those of FILE.part."""
        from scanfab.cli.talk import working

        with working(self.frames, self.done) as advance:
            for number, row in enumerate(self._rows(), start=1):
                self.found = self.found or row.alpha_vs is not None
                if self._keep:
                    self.kept.append(dict(row))
                yield row
                if number % self.settings.rows_per_frame == 0:
                    self.done += 1
                    advance(new=not self._is_taken_over(row))
        self.is_over = True

    def _is_taken_over(self, row: Row) -> bool:
        """Whether a row stands in the complete FILE."""
        return self.table is not None and row.frame in self.table.rows[row.source]

    def _rows(self) -> Iterator[Row]:
        from scanfab.pipeline.compute import compute_rows

        last = self.part[-1] if self.part else None
        names = [one.name for one in self.series]
        first = names.index(last["source"]) if last is not None else 0
        for one, observe in list(zip(self.series, self._observers, strict=True))[first:]:
            start = last["frame"] + 1 if last is not None and one.name == last["source"] else 0
            of_table = {} if self.table is None else self.table.rows[one.name]
            ready = {frame: rows for frame, rows in of_table.items() if frame >= start}
            done = {*range(start), *ready}
            computed = compute_rows(one, self.settings, done=done, observe=observe)
            yield from _in_order(ready, computed)


def _in_order(ready: dict[int, list[Row]], computed: Iterator[Row]) -> Iterator[Row]:
    """Rows that are there and rows that come, by frame."""
    waiting = sorted(ready, reverse=True)
    for row in computed:
        while waiting and waiting[-1] < row.frame:
            yield from ready[waiting.pop()]
        yield row
    while waiting:
        yield from ready[waiting.pop()]


def _vtk_folders(
    folder: Path | None, series: list[Series], settings: Settings, resume: bool
) -> list[Observer | None]:
    """What writes the ParaView files of each series, in folders of their own if several."""
    if folder is None:
        return [None] * len(series)
    from scanfab.viz.paraview import VtkFolder

    folders = [folder / f"series-{number}" for number in range(1, len(series) + 1)]
    with usage_errors():
        return [
            VtkFolder(one, settings.axis, resume)
            for one in (folders if len(series) > 1 else [folder])
        ]
