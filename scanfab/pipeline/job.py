"""The computation of a table under way: new rows, those of earlier runs, and the files for them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, SettingsError, note
from scanfab.base.files import check_folder
from scanfab.io.follow import FollowedSeries
from scanfab.io.series import Series
from scanfab.pipeline.compute import Observer, compute_rows
from scanfab.pipeline.frames import NoChosenFrameError, chosen_frames
from scanfab.pipeline.record import (
    FREE,
    FrameRows,
    Inputs,
    Refuse,
    as_json,
    asked_for,
    check_inputs,
    default_settings,
    files_of_rows,
    manifest,
    named_files,
    read_finished,
    rows_by_frame,
    write_manifest,
)
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.told import Told
from scanfab.table.formats import read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, ResultFile, differing_settings, prepared_table


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
    result : ResultFile, optional
        The file of the rows; without it they are to be taken from :meth:`rows`.
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
        self.series = series
        self.settings = settings
        self.result = result
        self.resume = resume
        excerpt = ALL if result is None else result.excerpt
        self.asked = asked_for(sources, reading, settings, excerpt)
        """The settings that decide the bytes of the result."""
        self.taken_over = 0
        """How many frames earlier runs have finished."""
        self.is_over = False
        """Whether all rows have come: the table is being made of them."""
        self.found_void_fabric = False
        """Whether any row has one."""
        self._finished: FrameRows = {}
        self._keeps_table = False
        """Whether rows of a complete FILE are among them."""
        self._warnings: list[str] = []
        """What the user was told of the rows of a complete FILE."""
        self._more = more or {}
        self._told = told or Told()
        self._executor = executor
        self._observers: Sequence[Observer | None] = observers or [None] * len(series)
        self._inputs = Inputs()
        files = [] if result is None else [result.manifest]
        self._manifests = [*files, *([] if manifest_path is None else [manifest_path])]

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
        with nullcontext() if self.result is None else self.result.alone():
            if self.resume and self.result is not None:
                self._take_over(self.result, needed)
            yield

    def rows(self, advance: Callable[[], object] = lambda: None) -> Iterator[Row]:
        """The rows that are computed now; a frame is finished once its rows are taken."""
        for one, observe in zip(self.series, self._observers, strict=True):
            done = {frame for source, frame in self._finished if source == one.name}
            computed = compute_rows(
                one, self.settings, done=done, observe=observe, executor=self._executor
            )
            own: list[Row] = []
            try:
                for row in computed:
                    yield row
                    own.append(row)
                    if len(own) == self.settings.rows_per_frame:
                        self._finish({(row.source, row.frame): own})
                        own = []
                        advance()
            except NoChosenFrameError as none:
                # of an array of more jobs than frames some have nothing to do
                note(f"{str(none).removeprefix('frames: ')}: it has no row in this table")
        self.is_over = True
        for one in self.series:
            if isinstance(one, FollowedSeries):
                one.end()

    def write(self, advance: Callable[[], object] = lambda: None) -> None:
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
        replaces = not self.resume and result.path.is_file() and result.manifest.is_file()
        with result.alone():
            with result.writer(self.asked, self.resume):
                frame, known = None, set[Path]()
                for row in self.rows(advance):
                    if replaces:
                        note(
                            f"{result.path}: the table that is there will be replaced at the end "
                            f"of this run; `resume` would go on with it"
                        )
                        replaces = False
                    if frame != (row.source, row.frame):
                        frame = row.source, row.frame
                        result.record(self._new_inputs(row, known))
                    result.write(row)
                if replaces and read_rows(result.path):
                    raise SettingsError(
                        f"{result.path}: this run has no rows, and the table that is there stays "
                        f"as it is: choose frames that there are (`frames`), or another file"
                    )
            with prepared_table(result.path, self.every_row, result.columns, result.excerpt):
                self.save_manifests()
            result.remove_part()

    def save_manifests(self) -> None:
        """Write the manifest beside the file, and where it was asked for."""
        if not self._manifests:
            return
        texts = list(dict.fromkeys([*self._warnings, *self._told.warnings]))
        found = manifest(self.asked, self.series, texts, self._told.notes, self._inputs)
        outdated = None if self.result is None or self._keeps_table else self.result.path
        for path in self._manifests:
            write_manifest(path, {**found, **self._more}, outdated)

    def _finish(self, rows: FrameRows, tells: bool = True) -> None:
        """Add finished frames; without a column that ``tells``, they count as having a fabric."""
        self._finished |= rows
        every = [row for some in rows.values() for row in some]
        has_fabric = any((row.alpha_vs, row.alpha_vs_axial) != (None, None) for row in every)
        self.found_void_fabric |= has_fabric or (bool(every) and not tells)

    def _new_inputs(self, row: Row, known: set[Path]) -> list[dict[str, Any]]:
        """Size and hash of the files up to the frame of a row that are not ``known`` yet."""
        strains, surfaces = named_files(self.asked)
        found = [*strains, *surfaces, *files_of_rows(self.series, row, known)]
        new = [file for file in dict.fromkeys(found) if file not in known]
        known.update(new)
        return [self._inputs.entry(file) for file in new]

    def _take_over(self, result: ResultFile, needed: Iterable[str]) -> None:
        """Take over the frames of a complete FILE, and of FILE.part."""
        # the series as they are now, also those that are followed
        series = [one.as_it_is if isinstance(one, FollowedSeries) else one for one in self.series]
        if result.path.is_file():
            try:
                self._take_table(result.path, series, needed)
            except (SettingsError, ReadError):
                # the run that was interrupted last has left FILE.part, whatever made FILE
                if not result.has_part:
                    raise
        if result.has_part:
            self._take_part(result, series)
        self.taken_over = self.done

    def _take_table(self, path: Path, series: Sequence[Series], needed: Iterable[str]) -> None:
        refuse = _refusal(path)
        before, rows = read_finished(path, refuse)
        if differing := differing_settings(before["settings"], self.asked, FREE):
            raise refuse(f"it was made with other settings ({', '.join(differing)})")
        found = self._checked(rows, before["inputs"], before["settings"], series, refuse)
        columns = set(rows[0]) if rows else set()
        if found and (lacking := [name for name in needed if name not in columns]):
            raise SettingsError(
                f"{path}: its rows lack {', '.join(lacking)} (`fields`), which the figure needs: "
                f"leave out `plot`, or `resume` to compute all frames again"
            )
        frames = self._joined_frames(path, {frame for _, frame in found}, before, series)
        self.settings = replace(self.settings, frames=frames)
        self.asked = {**self.asked, "frames": as_json(frames)}
        self._warnings = [str(one) for one in before["warnings"]]
        self._keeps_table = True
        self._finish(found, tells=bool({"alpha_vs", "alpha_vs_axial"} & columns))

    def _take_part(self, result: ResultFile, series: Sequence[Series]) -> None:
        refuse = _refusal(result.part)
        rows, inputs = result.finished_rows(
            self.asked, self.settings.rows_per_frame, default_settings()
        )
        found = self._checked(rows, inputs, self.asked, series, refuse)
        chosen = {one.name: chosen_frames(one, self.settings.frames) for one in series}
        for source, frame in sorted(found):
            if frame not in chosen[source]:
                raise refuse(f"it holds frame {frame}, which is not chosen now")
        self._finish(found)

    def _checked(
        self,
        rows: Sequence[Mapping[str, Any]],
        inputs: Sequence[Mapping[str, Any]],
        asked: Mapping[str, Any],
        series: Sequence[Series],
        refuse: Refuse,
    ) -> FrameRows:
        """The rows of finished frames, if they are those that this run would compute."""
        found, _ = rows_by_frame(rows, self.settings)
        others = {source for source, _ in found} - {one.name for one in series}
        if others:
            raise refuse(f"its source {min(others)} is not named now")
        if rows:
            check_inputs(inputs, asked, series, found, refuse)
        return found

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
        if all(known <= set(_up_to(one, chosen, last)) for one in series):
            return chosen
        asked = slice(*(before["settings"].get("frames") or (None,)))
        more = {frame for one in series for frame in _up_to(one, chosen, last + 1)}
        # frames that were skipped leave no hole
        skipped = {frame for one in series for frame in _up_to(one, asked, last) if frame < last}
        every = sorted(known | more | skipped)
        steps = {right - left for left, right in pairwise(every)} or {1}
        if len(steps) > 1:
            raise SettingsError(
                f"frames: {path} holds frames {min(known)} to {last}, which with those chosen now "
                f"make no slice A:B:C: choose `frames` so that they do, or another `output=FILE`"
            )
        (step,) = steps
        stop = None if chosen.stop is None else every[-1] + 1
        return slice(every[0], stop, None if step == 1 else step)


def _up_to(series: Series, frames: slice, last: int) -> list[int]:
    """The chosen frames; of a slice without an end those up to a number, and at least one."""
    chosen = chosen_frames(series, frames)
    if frames.stop is None and (frames.start or 0) >= 0 and (frames.step or 1) > 0:
        chosen = chosen[: max(len(range(chosen.start, last + 1, chosen.step)), 1)]
    return list(chosen)


def _refusal(path: Path) -> Refuse:
    """Errors for rows that a run cannot go on with."""
    return lambda reason: SettingsError(
        f"{path}: `resume` cannot go on with it: {reason}: name another `output=FILE`, or leave "
        f"out `resume` to compute all frames again"
    )
