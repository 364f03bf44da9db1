"""The computation of a table under way: new rows, those of earlier runs, and the files for them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import check_folder
from scanfab.io.follow import FollowedSeries
from scanfab.io.series import Series
from scanfab.pipeline.compute import Observer, compute_frames
from scanfab.pipeline.frames import NoChosenFrameError, chosen_frames
from scanfab.pipeline.part import PartFile
from scanfab.pipeline.record import (
    FREE,
    FrameRows,
    Record,
    check_inputs,
    differing_settings,
    input_entry,
    manifest,
    named_files,
    read_table,
    write_manifest,
)
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.told import Told
from scanfab.pipeline.values import as_written
from scanfab.table.formats import read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, check_output, manifest_of, write_rows

Advance = Callable[[], object]


@dataclass(eq=False)
class Job:
    """
    One table of some series, computed frame by frame; an interrupted one can be gone on with.

    Each frame that FILE.part or a complete FILE holds is taken over; all others are computed. In
    the end FILE is written with all rows in the order of series and frames.

    Raises
    ------
    SettingsError
        If two series have one name, or a file cannot be written where it is asked for.
    """

    series: Sequence[Series]
    """With names of their own."""
    settings: Settings
    """Of all of them."""
    asked: dict[str, Any]
    """What decides the bytes of the table: from :func:`asked_for`."""
    output: Path | None = None
    """The file of the rows; without it they are to be taken from :meth:`rows`."""
    excerpt: Excerpt = ALL
    """Which columns of the rows are written, and with how many digits."""
    resume: bool = False
    """Whether to go on with what earlier runs have left."""
    manifest_path: Path | None = None
    """A manifest there too."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """Further entries of the manifest."""
    observers: Sequence[Observer] = ()
    """For each series what is called with the result of each frame that is computed now."""
    told: Told = field(default_factory=Told)
    """What is told meanwhile, for the manifest."""
    executor: Executor | None = None
    """As for :func:`scanfab.compute`."""

    finished: FrameRows = field(default_factory=dict, init=False)
    """The rows of the finished frames, those of earlier runs among them."""
    taken_over: int = field(default=0, init=False)
    """How many frames earlier runs have finished."""
    is_over: bool = field(default=False, init=False)
    """Whether all rows have come: the table is being made of them."""
    found_void_fabric: bool = field(default=False, init=False)
    """Whether any row has one."""
    warned_before: Sequence[str] | None = field(default=None, init=False)
    """The warnings of the complete FILE that is gone on with, if there is one."""

    def __post_init__(self) -> None:
        names = [one.name for one in self.series]
        for name in names:
            if names.count(name) > 1:
                raise SettingsError(
                    f"{name}: named twice among the series: the rows of a table are told apart by "
                    f"their source and frame"
                )
        if self.manifest_path is not None:
            check_folder(self.manifest_path)
        if self.output is not None:
            check_output(self.output)
            self._part = PartFile(self.output)

    @property
    def is_good(self) -> bool:
        """Whether no frame was skipped, and one has a void fabric."""
        # a table without frames, of a job that none was left for, lacks nothing
        return not self.told.skipped and (self.found_void_fabric or not self.finished)

    @property
    def done(self) -> int:
        """How many frames are finished, those of earlier runs among them."""
        return len(self.finished)

    @property
    def every_row(self) -> list[Row]:
        """The rows of all finished frames, in the order of the series and of their frames."""
        place = {one.name: number for number, one in enumerate(self.series)}
        frames = sorted(self.finished, key=lambda key: (place[key[0]], key[1]))
        return [row for key in frames for row in self.finished[key]]

    def frames(self) -> int:
        """About how many frames there are to be finished, those of earlier runs among them."""
        frames = self.settings.frames
        expected = sum(len(range(one.frames_expected())[frames]) for one in self.series)
        return max(expected, self.done)

    @contextmanager
    def begun(self, needed: Iterable[str] = ()) -> Iterator[None]:
        """
        Keep other runs away from the file in the block; if resumed, find what they have left.

        Parameters
        ----------
        needed : iterable of str, optional
            Columns that a complete FILE must have.

        Raises
        ------
        ScanfabError
            If another run writes to the file.
        SettingsError
            If the rows there were made with other settings or of other inputs.
        """
        if self.output is None:
            yield
            return
        with self._part.alone():
            if self.resume:
                self._take_over(self.output, needed)
                self.taken_over = self.done
            yield

    def rows(self, advance: Advance = lambda: None) -> Iterator[Row]:
        """The rows that are computed now; a frame is finished once its rows are taken."""
        for _, rows in self._computed(advance):
            yield from rows

    def write(self, advance: Advance = lambda: None) -> None:
        """
        Write the rows to the file as they come, in a block of :meth:`begun`.

        Raises
        ------
        ScanfabError
            If a frame cannot be computed; what is finished stays in FILE.part.
        OSError
            If the file cannot be written to.
        """
        assert self.output is not None
        replaces = not self.resume and manifest_of(self.output).is_file() and self.output.is_file()
        if replaces:
            note(
                f"{self.output}: the table that is there will be replaced at the end of this run; "
                f"`resume` would go on with it"
            )
        if not (self.resume and self._part.frames):
            self._part.begin(self.asked)
        known = set[Path]()
        for one, rows in self._computed(advance):
            files = [*named_files(self.asked), *one.files(rows[0].frame, known)]
            new = [file for file in dict.fromkeys(files) if file not in known]
            self._part.add([input_entry(file) for file in new], rows)
            known.update(new)
        if replaces and not self.finished and read_rows(self.output):
            raise SettingsError(
                f"{self.output}: this run has no rows, and the table that is there stays as it "
                f"is: choose frames that there are (`frames`), or another file"
            )
        columns = self.settings.columns
        write_rows(self.output, self.every_row, columns, self.excerpt, self.save_manifests)
        self._part.remove()

    def save_manifests(self) -> None:
        """Write the manifest where it was asked for, and beside the file."""
        warned = [*(self.warned_before or ()), *self.told.warnings]
        found = manifest(self.asked, self.series, list(dict.fromkeys(warned)), self.told.notes)
        if self.manifest_path is not None:
            write_manifest(self.manifest_path, {**found, **self.more})
        if self.output is not None:
            outdated = self.output if self.warned_before is None else None
            write_manifest(manifest_of(self.output), {**found, **self.more}, outdated)

    def _computed(self, advance: Advance) -> Iterator[tuple[Series, list[Row]]]:
        """The rows of each frame that is computed now, with its series."""
        for place, one in enumerate(self.series):
            done = {frame for source, frame in self.finished if source == one.name}
            observe = self.observers[place] if self.observers else None
            words: Any = {"done": done, "observe": observe, "executor": self.executor}
            try:
                for rows in compute_frames(one, self.settings, **words):
                    yield one, rows
                    self._finish({(one.name, rows[0].frame): rows})
                    advance()
            except NoChosenFrameError as none:
                # of an array of more jobs than frames some have nothing to do
                note(f"{str(none).removeprefix('frames: ')}: it has no row in this table")
        self.is_over = True
        for one in self.series:
            if isinstance(one, FollowedSeries):
                one.end()

    def _finish(self, frames: FrameRows) -> None:
        self.finished |= frames
        every = (row for rows in frames.values() for row in rows)
        self.found_void_fabric |= any(
            (row.alpha_vs, row.alpha_vs_axial) != (None, None) for row in every
        )

    def _take_over(self, output: Path, needed: Iterable[str]) -> None:
        """Take over the frames of a complete FILE, and of FILE.part."""
        # the series as they are now, also those that are followed
        series = [one.as_it_is if isinstance(one, FollowedSeries) else one for one in self.series]
        if output.is_file():
            try:
                self._take_table(output, series, needed)
            except (SettingsError, ReadError):
                # the run that was interrupted last has left FILE.part, whatever made FILE
                if not self._part.frames:
                    raise
        if self._part.frames:
            frames = self._checked(self._part.read(), series)
            chosen = {one.name: chosen_frames(one, self.settings.frames) for one in series}
            for source, frame in sorted(frames):
                if frame not in chosen[source]:
                    reason = f"it holds frame {frame}, which is not chosen now"
                    raise _refusal(self._part.path, reason)
            self._finish(frames)

    def _take_table(self, path: Path, series: Sequence[Series], needed: Iterable[str]) -> None:
        record = read_table(path, partial(_refusal, path))
        frames = self._checked(record, series, FREE)
        lacking = [name for name in needed if name not in record.columns]
        if frames and lacking:
            raise SettingsError(
                f"{path}: its rows lack {', '.join(lacking)} (`fields`), which the figure needs: "
                f"leave out `plot`, or `resume` to compute all frames again"
            )
        frames_asked = _joined_frames(record, frames, self.settings.frames, series)
        self.settings = replace(self.settings, frames=frames_asked)
        self.asked = {**self.asked, "frames": as_written(frames_asked)}
        self.warned_before = [str(text) for text in record.manifest["warnings"]]
        self._finish(frames)
        # a choice of columns may say nothing of the void fabric
        if not {"alpha_vs", "alpha_vs_axial"} & record.columns:
            self.found_void_fabric |= bool(frames)

    def _checked(
        self, record: Record, series: Sequence[Series], free: Sequence[str] = ()
    ) -> FrameRows:
        """The complete frames of a record, if they are those that this run would compute."""
        refuse = partial(_refusal, record.path)
        if differing := differing_settings(record.manifest["settings"], self.asked, free):
            raise refuse(f"it was made with other settings ({differing})")
        others = {source for source, _ in record.rows} - {one.name for one in series}
        if others:
            raise refuse(f"its source {min(others)} is not named now")
        count = self.settings.rows_per_frame
        frames = {key: rows for key, rows in record.rows.items() if len(rows) == count}
        if record.rows:
            check_inputs(record._replace(rows=frames), series, refuse)
        return frames


def _refusal(path: Path, reason: str) -> SettingsError:
    """The error for rows that a run cannot go on with."""
    return SettingsError(
        f"{path}: `resume` cannot go on with it: {reason}: name another `output=FILE`, or leave "
        f"out `resume` to compute all frames again"
    )


def _joined_frames(
    record: Record, frames: FrameRows, chosen: slice, series: Sequence[Series]
) -> slice:
    """
    The frames of a complete FILE and those that are chosen now, as one slice.

    Raises
    ------
    SettingsError
        If together they make none: no frame of FILE may be lost.
    """
    known = {frame for _, frame in frames}
    last = max(known, default=0)
    now = {frame for one in series for frame in range(len(one))[chosen]}
    if known <= now:
        return chosen
    # frames that were skipped leave no hole
    then = {frame for one in series for frame in range(len(one))[record.settings.frames]}
    every = sorted(known | now | {frame for frame in then if frame < last})
    steps = {right - left for left, right in pairwise(every)} or {1}
    if len(steps) > 1:
        raise SettingsError(
            f"frames: {record.path} holds frames {min(known)} to {last}, which with those chosen "
            f"now make no slice A:B:C: choose `frames` so that they do, or another `output=FILE`"
        )
    (step,) = steps
    stop = None if chosen.stop is None else every[-1] + 1
    return slice(every[0], stop, None if step == 1 else step)
