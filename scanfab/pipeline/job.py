"""The computation of a table under way: new rows, those of earlier runs, and the files for them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import check_folder
from scanfab.io.follow import FollowedSeries
from scanfab.io.options import parse_frames
from scanfab.io.series import Series
from scanfab.pipeline.compute import Observer, compute_frames
from scanfab.pipeline.frames import NoChosenFrameError, chosen_frames
from scanfab.pipeline.part import PartFile
from scanfab.pipeline.record import (
    FREE,
    Finished,
    FrameRows,
    asked_for,
    check_inputs,
    differing_settings,
    input_entry,
    manifest,
    named_files,
    read_finished,
    rows_by_frame,
    write_manifest,
)
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.told import Told
from scanfab.pipeline.values import as_written
from scanfab.table.formats import read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, check_output, manifest_of, write_rows


class Job:
    """
    One table of some series, computed frame by frame; an interrupted one can be gone on with.

    Each frame that FILE.part or a complete FILE holds is taken over; all others are computed. In
    the end FILE is written with all rows in the order of series and frames.

    Parameters
    ----------
    series : sequence of Series
        With names of their own.
    settings : Settings
        Of all of them.
    output : Path, optional
        The file of the rows; without it they are to be taken from :meth:`rows`.
    excerpt : Excerpt, optional
        Which columns of them are written, and with how many digits.
    sources, reading
        What the series were opened by, for the manifest: as of :func:`asked_for`.
    resume : bool, optional
        Go on with what earlier runs have left.
    manifest_path : Path, optional
        A manifest there too.
    more : mapping, optional
        Further entries of the manifest.
    observers : sequence of callable, optional
        For each series what is called with the result of each frame that is computed now.
    told : Told, optional
        What is told meanwhile, for the manifest.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.

    Raises
    ------
    SettingsError
        If two series have one name, or a file cannot be written where it is asked for.
    """

    def __init__(
        self,
        series: Sequence[Series],
        settings: Settings,
        output: Path | None = None,
        excerpt: Excerpt = ALL,
        *,
        sources: Sequence[str],
        reading: Mapping[str, Any],
        resume: bool = False,
        manifest_path: Path | None = None,
        more: Mapping[str, Any] | None = None,
        observers: Sequence[Observer] = (),
        told: Told | None = None,
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
        if output is not None:
            check_output(output)
        self.series, self.settings, self.output, self.resume = series, settings, output, resume
        self.taken_over = 0
        """How many frames earlier runs have finished."""
        self.is_over = False
        """Whether all rows have come: the table is being made of them."""
        self.found_void_fabric = False
        """Whether any row has one."""
        self._part = None if output is None else PartFile(output)
        self._asked = asked_for(sources, reading, settings, excerpt)
        self._excerpt = excerpt
        self._finished: FrameRows = {}
        self._before: Mapping[str, Any] = {}
        """The manifest of the complete FILE whose rows are taken over."""
        self._manifest_path, self._more = manifest_path, more or {}
        self._told, self._executor = told or Told(), executor
        self._observers: Sequence[Observer | None] = observers or [None] * len(series)

    @property
    def is_good(self) -> bool:
        """Whether no frame was skipped, and one has a void fabric."""
        # a table without frames, of a job that none was left for, lacks nothing
        return not self._told.skipped and (self.found_void_fabric or not self.done)

    @property
    def done(self) -> int:
        """How many frames are finished, those of earlier runs among them."""
        return len(self._finished)

    @property
    def every_row(self) -> list[Row]:
        """The rows of all finished frames, in the order of the series and of their frames."""
        place = {one.name: number for number, one in enumerate(self.series)}
        frames = sorted(self._finished, key=lambda key: (place[key[0]], key[1]))
        return [row for key in frames for row in self._finished[key]]

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
        if self._part is None:
            yield
            return
        with self._part.alone():
            if self.resume:
                self._take_over(self._part, needed)
            yield

    def rows(self, advance: Callable[[], object] = lambda: None) -> Iterator[Row]:
        """The rows that are computed now; a frame is finished once its rows are taken."""
        for rows in self._computed(advance):
            yield from rows

    def write(self, advance: Callable[[], object] = lambda: None) -> None:
        """
        Write the rows to the file as they come, in a block of :meth:`begun`.

        Raises
        ------
        ScanfabError
            If a frame cannot be computed; what is finished stays in FILE.part.
        OSError
            If the file cannot be written to.
        """
        output, part, known = self.output, self._part, set[Path]()
        assert output is not None
        assert part is not None
        if not (self.resume and part.frames):
            part.begin(self._asked)
        replaces = not self.resume and output.is_file() and manifest_of(output).is_file()
        for rows in self._computed(advance):
            if replaces:
                note(
                    f"{output}: the table that is there will be replaced at the end of this run; "
                    f"`resume` would go on with it"
                )
                replaces = False
            part.add(self._new_inputs(rows[0], known), rows)
        if replaces and read_rows(output):
            raise SettingsError(
                f"{output}: this run has no rows, and the table that is there stays as it is: "
                f"choose frames that there are (`frames`), or another file"
            )
        rows = self.every_row
        write_rows(output, rows, self.settings.columns, self._excerpt, self.save_manifests)
        part.remove()

    def save_manifests(self) -> None:
        """Write the manifest where it was asked for, and beside the file."""
        texts = dict.fromkeys([*map(str, self._before.get("warnings", [])), *self._told.warnings])
        found = manifest(self._asked, self.series, list(texts), self._told.notes)
        if self._manifest_path is not None:
            write_manifest(self._manifest_path, {**found, **self._more})
        if self.output is not None:
            outdated = None if self._before else self.output
            write_manifest(manifest_of(self.output), {**found, **self._more}, outdated)

    def _computed(self, advance: Callable[[], object]) -> Iterator[list[Row]]:
        """The rows of each frame that is computed now."""
        for one, observe in zip(self.series, self._observers, strict=True):
            done = {frame for source, frame in self._finished if source == one.name}
            try:
                for rows in compute_frames(
                    one, self.settings, done=done, observe=observe, executor=self._executor
                ):
                    yield rows
                    self._finish({(one.name, rows[0].frame): rows})
                    advance()
            except NoChosenFrameError as none:
                # of an array of more jobs than frames some have nothing to do
                note(f"{str(none).removeprefix('frames: ')}: it has no row in this table")
        self.is_over = True
        for one in self.series:
            if isinstance(one, FollowedSeries):
                one.end()

    def _finish(self, frames: FrameRows, tells: bool = True) -> None:
        """Add finished frames; without a column that ``tells``, they count as having a fabric."""
        self._finished |= frames
        every = [row for rows in frames.values() for row in rows]
        has_fabric = any((row.alpha_vs, row.alpha_vs_axial) != (None, None) for row in every)
        self.found_void_fabric |= has_fabric or (bool(every) and not tells)

    def _new_inputs(self, row: Row, known: set[Path]) -> list[dict[str, Any]]:
        """Size and hash of the files up to the frame of a row that are not ``known`` yet."""
        strains, surfaces = named_files(self._asked)
        found = [*strains, *surfaces]
        for one in self.series:
            if one.name == row.source:
                found += one.files(row.frame, known)
                break
            found += one.files()
        new = [file for file in dict.fromkeys(found) if file not in known]
        known.update(new)
        return [input_entry(file) for file in new]

    def _take_over(self, part: PartFile, needed: Iterable[str]) -> None:
        """Take over the frames of a complete FILE, and of FILE.part."""
        # the series as they are now, also those that are followed
        series = [one.as_it_is if isinstance(one, FollowedSeries) else one for one in self.series]
        if part.output.is_file():
            try:
                self._take_table(part.output, series, needed)
            except (SettingsError, ReadError):
                # the run that was interrupted last has left FILE.part, whatever made FILE
                if not part.frames:
                    raise
        if part.frames:
            frames = self._checked(part.path, part.read(), series)
            chosen = {one.name: chosen_frames(one, self.settings.frames) for one in series}
            for source, frame in sorted(frames):
                if frame not in chosen[source]:
                    reason = f"it holds frame {frame}, which is not chosen now"
                    raise _refusal(part.path, reason)
            self._finish(frames)
        self.taken_over = self.done

    def _take_table(self, path: Path, series: Sequence[Series], needed: Iterable[str]) -> None:
        found = read_finished(path, partial(_refusal, path))
        frames = self._checked(path, found, series, FREE)
        columns = set(found.rows[0]) if found.rows else set()
        if frames and (lacking := [name for name in needed if name not in columns]):
            raise SettingsError(
                f"{path}: its rows lack {', '.join(lacking)} (`fields`), which the figure needs: "
                f"leave out `plot`, or `resume` to compute all frames again"
            )
        joined = self._joined_frames(path, {frame for _, frame in frames}, found.asked, series)
        self.settings = replace(self.settings, frames=joined)
        self._asked = {**self._asked, "frames": as_written(joined)}
        self._before = found.manifest
        self._finish(frames, tells=bool({"alpha_vs", "alpha_vs_axial"} & columns))

    def _checked(
        self, path: Path, found: Finished, series: Sequence[Series], free: Sequence[str] = ()
    ) -> FrameRows:
        """The rows of finished frames, if they are those that this run would compute."""
        if differing := differing_settings(found.asked, self._asked, free):
            raise _refusal(path, f"it was made with other settings ({differing})")
        frames = rows_by_frame(found.rows, self.settings.columns)
        frames = {
            k: rows for k, rows in frames.items() if len(rows) == self.settings.rows_per_frame
        }
        others = {source for source, _ in frames} - {one.name for one in series}
        if others:
            raise _refusal(path, f"its source {min(others)} is not named now")
        if found.rows:
            refuse = partial(_refusal, path)
            check_inputs(found.inputs, found.asked, series, frames, refuse)
        return frames

    def _joined_frames(
        self, path: Path, known: set[int], before: Mapping[str, Any], series: Sequence[Series]
    ) -> slice:
        """
        The frames of a complete FILE and those that are chosen now, as one slice.

        Raises
        ------
        SettingsError
            If together they make none: no frame of FILE may be lost.
        """
        chosen, last = self.settings.frames, max(known, default=0)
        now = {frame for one in series for frame in range(len(one))[chosen]}
        if known <= now:
            return chosen
        # frames that were skipped leave no hole
        then = parse_frames(before.get("frames"))
        skipped = {frame for one in series for frame in range(len(one))[then] if frame < last}
        every = sorted(known | now | skipped)
        steps = {right - left for left, right in pairwise(every)} or {1}
        if len(steps) > 1:
            raise SettingsError(
                f"frames: {path} holds frames {min(known)} to {last}, which with those chosen now "
                f"make no slice A:B:C: choose `frames` so that they do, or another `output=FILE`"
            )
        (step,) = steps
        stop = None if chosen.stop is None else every[-1] + 1
        return slice(every[0], stop, None if step == 1 else step)


def _refusal(path: Path, reason: str) -> SettingsError:
    """The error for rows that a run cannot go on with."""
    return SettingsError(
        f"{path}: `resume` cannot go on with it: {reason}: name another `output=FILE`, or leave "
        f"out `resume` to compute all frames again"
    )
