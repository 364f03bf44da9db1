"""The computation of a table: new rows, rows of earlier runs, and the files that hold them."""

from __future__ import annotations

import platform
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from itertools import islice, repeat
from pathlib import Path
from typing import Any

from scanfab.base.errors import SettingsError, note
from scanfab.base.files import check_folder, refuse_inputs
from scanfab.io.follow import FollowedSeries
from scanfab.io.series import Series
from scanfab.pipeline.compute import Observer, compute_frames
from scanfab.pipeline.frames import NoChosenFrameError, number_of_reference, of_whole
from scanfab.pipeline.options import Told
from scanfab.pipeline.record import (
    FrameRows,
    PartFile,
    Record,
    asked_for,
    input_entry,
    named_files,
    part_of,
    read_table,
    write_manifest,
)
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import as_written
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, check_output, manifest_of, write_rows

Advance = Callable[[], object]

# packages whose versions a manifest lists
PACKAGES = (
    "scanfab", "numpy", "numba", "scipy", "meshio", "pyvista", "click", "rich", "h5py",
    "matplotlib", "jinja2", "polars",
)  # fmt: skip


@dataclass(eq=False)
class Job:
    """
    One table of one or several series, computed frame by frame; it can resume an interrupted run.

    Frames that FILE.part or a complete FILE holds are taken over, and all others are computed. At
    the end FILE is written with all rows, in the order of series and frames.

    Raises
    ------
    SettingsError
        If two series have the same name, if they differ in options of reading or in the frames that
        they stand for, or if a file cannot be written.
    """

    series: Sequence[Series]
    """Slices of series become whole series; then `settings` choose the frames of the slices."""
    settings: Settings
    output: Path | None = None
    """FILE; without it no rows are written."""
    excerpt: Excerpt = ALL
    """Columns and digits of the rows in FILE."""
    resume: bool = False
    """Whether to take over the rows of earlier runs."""
    manifest_path: Path | None = None
    """A further file for the manifest."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """Further entries of the manifest."""
    drawn: Sequence[Path] = ()
    """Figures and other files that are made besides, for the check that no input is replaced."""
    observers: Sequence[Observer] = ()
    """One function for each series, called with the result of each frame that is computed now."""
    told: Told = field(default_factory=Told)
    """Warnings and notes so far, for the manifest."""
    executor: Executor | None = None
    """As for :func:`scanfab.compute`."""

    asked: dict[str, Any] = field(init=False)
    """The settings that decide the bytes of the table, from :func:`asked_for`."""
    finished: FrameRows = field(default_factory=dict, init=False)
    """The rows of all finished frames, including those of earlier runs."""
    resumed: Record | None = field(default=None, init=False)
    """The complete FILE that is resumed, if there is one."""
    _part: PartFile | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        parts = [of_whole(one, self.settings) for one in self.series]
        self.series, self.settings = [one for one, _ in parts], parts[0][1]
        same = parts[0][0].options, self.settings
        if any((one.options, settings) != same for one, settings in parts):
            must = "must be read with the same options, and be parts of the same frames"
            raise SettingsError(f"the series of one table {must}: make a table of each")
        names = [one.name for one in self.series]
        if twice := {name for name in names if names.count(name) > 1}:
            raise SettingsError(f"{min(twice)}: named twice among the series of one table")
        sources = [source for one in self.series for source in one.sources or (one.name,)]
        reading = self.series[0].options
        self.asked = asked_for(sources, reading, self.settings, self.excerpt)
        # counted from the start, so that a longer series has another reference
        references = [number_of_reference(one, self.settings) for one in self.series]
        if len(set(references)) == 1:
            self.asked["reference"] = references[0]
        else:
            self.asked["references"] = references
        if self.manifest_path is not None:
            check_folder(self.manifest_path)
        outputs = [*self.drawn, self.manifest_path, self.output]
        if self.output is not None:
            check_output(self.output)
            self._part = PartFile(self.output)
            outputs += [manifest_of(self.output), part_of(self.output)]
        inputs = [path for one in self.series for path in one.files()]
        if listed := self.more.get("settings_file"):
            inputs.append(Path(listed["path"]))
        refuse_inputs(outputs, [*inputs, *named_files(self.asked)])

    @property
    def found_void_fabric(self) -> bool:
        """Whether any row has a void fabric; also if a FILE that is resumed has no such columns."""
        names = ("alpha_vs", "alpha_vs_axial")
        written = self.excerpt.fields or names
        if self.resumed is not None and self.resumed.rows and not {*names} & {*written}:
            return True
        rows = (row for rows in self.finished.values() for row in rows)
        return any(row[name] is not None for row in rows for name in names)

    @property
    def is_good(self) -> bool:
        """Whether no frame was skipped and any row has a void fabric, or there are no frames."""
        return not self.told.skipped and (self.found_void_fabric or not self.finished)

    @property
    def done(self) -> int:
        """Number of finished frames, including those of earlier runs."""
        return len(self.finished)

    @property
    def every_row(self) -> list[Row]:
        """The rows of all finished frames, in the order of series and frames."""
        place = {one.name: number for number, one in enumerate(self.series)}
        frames = sorted(self.finished, key=lambda key: (place[key[0]], key[1]))
        return [row for key in frames for row in self.finished[key]]

    def frames(self) -> int:
        """Estimate the number of frames of the table, including those of earlier runs."""
        frames = self.settings.frames
        expected = sum(len(range(one.frames_expected())[frames]) for one in self.series)
        return max(expected, self.done)

    @contextmanager
    def begun(self) -> Iterator[None]:
        """
        Keep other runs away from FILE inside the block; to resume, take over the finished rows.

        Raises
        ------
        ScanfabError
            If another run writes to the file.
        SettingsError
            If the rows were made with other settings or of other inputs.
        """
        if self._part is None:
            yield
            return
        with self._part.alone():
            if self.resume:
                self._take_over(self._part)
            yield

    def rows(self, advance: Advance = lambda: None) -> Generator[Row, None, None]:
        """
        Compute the missing rows, write FILE and the manifests, and yield what is computed now.

        With FILE, this must be inside a block of :meth:`begun`. Without it, a frame is finished
        once its rows are taken.

        Raises
        ------
        ScanfabError
            If a frame cannot be computed; finished frames stay in FILE.part.
        OSError
            If the file cannot be written to.
        """
        part, known = self._part, set[Path]()
        if part is not None and not (self.resume and part.holds_frames):
            part.begin(self.asked)
            if self.resumed is not None:
                part.add(self.resumed.manifest["inputs"], self.every_row)
        for one, rows in self._computed():
            frame = rows[0].frame
            if part is not None:
                files = dict.fromkeys((*named_files(self.asked), *one.files(frame, known)))
                part.add([input_entry(file) for file in files if file not in known], rows)
                known.update(files)
            yield from rows
            self.finished[one.name, frame] = rows
            advance()
        for one in self.series:
            if isinstance(one, FollowedSeries):
                one.end()
        if part is None:
            self._save_manifests()
            return
        columns = self.settings.columns
        write_rows(part.output, self.every_row, columns, self.excerpt, self._save_manifests)
        part.remove()

    def _save_manifests(self) -> None:
        """Write the manifest beside FILE, and where the user asked for it."""
        files = {*named_files(self.asked), *(path for one in self.series for path in one.files())}
        versions = {name: version(name) for name in PACKAGES}
        before = [] if self.resumed is None else map(str, self.resumed.manifest["warnings"])
        found = {
            "settings": {**self.asked, "frames": as_written(self.settings.frames)},
            "seed": self.asked["seed"],
            "versions": {"python": platform.python_version(), **versions},
            "inputs": [input_entry(path) for path in sorted(files)],
            "warnings": list(dict.fromkeys([*before, *self.told.warnings])),
            "notes": self.told.notes,
            # of the whole series, so that a merge of parts knows which frames are missing
            "frames": {one.name: len(one) for one in self.series},
            **self.more,
        }
        if self.manifest_path is not None:
            write_manifest(self.manifest_path, found)
        if self.output is not None:
            outdated = self.output if self.resumed is None else None
            write_manifest(manifest_of(self.output), found, outdated)

    def _computed(self) -> Iterator[tuple[Series, list[Row]]]:
        """The rows of each frame that is computed now, with its series."""
        observers = self.observers or repeat(None)
        for one, observe in zip(self.series, observers, strict=False):
            computed = compute_frames(
                one,
                self.settings,
                done={frame for source, frame in self.finished if source == one.name},
                observe=observe,
                executor=self.executor,
                name=one.name if len(self.series) > 1 else "",
            )
            try:
                yield from zip(repeat(one), computed)
            except NoChosenFrameError as none:
                # an array of more jobs than frames has jobs without frames
                note(f"{none}, so the table has no rows of it")

    def _take_over(self, part: PartFile) -> None:
        """
        Take over the frames that FILE.part holds, else those of a complete FILE.

        SettingsError is raised if this run would compute other rows.
        """
        if part.holds_frames:
            record = part.read()
        elif part.output.is_file():
            record = self.resumed = read_table(part.output)
        else:
            return
        # a followed series counts with the files that exist now
        series = [one.as_it_is if isinstance(one, FollowedSeries) else one for one in self.series]
        for reason in _objections(record, self.asked, series):
            advice = "name another `output=FILE`, or leave out `resume` to compute all again"
            raise SettingsError(f"{record.path}: `resume` cannot go on with it: {reason}: {advice}")
        count = record.settings.rows_per_frame
        self.finished = {key: rows for key, rows in record.rows.items() if len(rows) == count}
        frames = _joined_frames(record, self.settings.frames, [len(one) for one in series])
        self.settings = replace(self.settings, frames=frames)


def _objections(
    record: Record, asked: Mapping[str, Any], series: Sequence[Series]
) -> Iterator[str]:
    """
    Reasons why a run would compute other rows than those of a record; none if it would not.

    These changes are allowed: new frames behind the last one, as files or at the end of the last
    file; a repaired file whose frame was skipped; new lines in a file of cells or strains.

    Parameters
    ----------
    record : Record
        The record of an earlier run.
    asked : mapping
        The settings of this run.
    series : sequence of Series
        The series of this run.
    """
    if differing := record.differing(asked):
        yield f"it was made with other settings ({differing})"
    if not record.rows:
        return
    for source in sorted({source for source, _ in record.rows} - {one.name for one in series}):
        yield f"its source {source} is not named now"
    named, cells = named_files(asked), [one.cells.path for one in series if one.cells is not None]
    read = {str(file) for file in (*named, *(file for one in series for file in one.files()))}
    for gone in sorted(record.inputs.keys() - read):
        yield f"{gone} is not among the files that are read now"
    for one in series:
        yield from _changed_files(one, record)
    # a new line may give a strain to a frame that had none
    lacks_strain = any(row.strain is None for rows in record.rows.values() for row in rows)
    for file in (*named, *cells):
        may_grow = file in cells or (str(file) == asked["strain"] and not lacks_strain)
        if not record.has(file, may_grow, by_lines=True):
            yield f"{file} has changed since, in more than new lines at its end"


def _changed_files(series: Series, record: Record) -> Iterator[str]:
    """Changes in the files of a series up to the last frame of a record; not in its cells."""
    finished = [frame for source, frame in record.rows if source == series.name]
    frames = list(islice(series, max(finished, default=-1) + 1))
    families = (series.grains, *series.contacts)
    steps = {file: step for family in families for step, file in family.files.items()}
    known = [step for step, file in series.grains.files.items() if str(file) in record.inputs]
    files = set(series.files(len(frames) - 1)) if frames else set()
    for file in sorted(files - ({series.cells.path} if series.cells is not None else set())):
        step = steps.get(file, -1)
        if str(file) not in record.inputs:
            yield f"{file} is new, and not behind the last frame"
        elif not record.has(file, may_grow=step in [None, *known[-1:]]):
            # a broken file counts as one frame: if it has more now, later frames have other numbers
            numbers = [frame.number for frame in frames if frame.name_step == step]
            if len(numbers) != 1 or numbers[0] in finished:
                yield f"{file} has changed since"


def _joined_frames(record: Record, chosen: slice, counts: Sequence[int]) -> slice:
    """
    One slice for the frames of a complete FILE and those chosen now; ``counts`` are all frames.

    Raises
    ------
    SettingsError
        If there is no such slice: no frame of FILE may be lost.
    """
    known = {frame for _, frame in record.rows}
    now = {frame for count in counts for frame in range(count)[chosen]}
    if known <= now:
        return chosen
    # frames that were skipped leave no hole
    then = {frame for count in counts for frame in range(count)[record.settings.frames]}
    every = sorted(known | now | {frame for frame in then if frame < max(known)})
    step = every[1] - every[0] if len(every) > 1 else 1
    if every != list(range(every[0], every[-1] + 1, step)):
        has = f"{record.path} holds frames {min(known)} to {max(known)}"
        raise SettingsError(f"frames: {has}, which with those chosen now make no slice A:B:C")
    stop = None if chosen.stop is None else every[-1] + 1
    return slice(every[0], stop, None if step == 1 else step)
