"""Rows that a run goes on with: whether they are what it would give now."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

from scanfab.base.column import Column
from scanfab.base.errors import SettingsError
from scanfab.io.series import Series
from scanfab.pipeline.frames import chosen_frames
from scanfab.pipeline.manifest import Inputs, default_settings, strain_file, surface_file
from scanfab.pipeline.repeat import read_manifest
from scanfab.pipeline.settings import Settings
from scanfab.table.reading import read_finished_rows
from scanfab.table.result_file import differing_settings
from scanfab.table.row import Row

# what may differ: inputs are compared by what they hold, and more frames are the point of it
FREE = ("frames", "sources")


@dataclass(frozen=True)
class FinishedTable:
    """The rows of a complete table, of frames that have all of theirs."""

    path: Path
    rows: dict[str, dict[int, list[Row]]]
    """By source and frame."""
    frames: slice
    """What was asked for."""
    warnings: list[str]
    """What its manifest says that the user was told."""

    columns: frozenset[str]
    """Those that were written."""

    @property
    def has_void_fabric(self) -> bool:
        """Whether any row has one; where no column tells, none is known to have none."""
        telling = {"alpha_vs", "alpha_vs_axial"} & self.columns
        rows = [row for frames in self.rows.values() for some in frames.values() for row in some]
        return any(
            not telling or any(getattr(row, name) is not None for name in telling) for row in rows
        )

    def check_columns(self, needed: Iterable[str]) -> None:
        """SettingsError if columns that a figure needs were not written."""
        lacking = [name for name in needed if name not in self.columns]
        if any(self.rows.values()) and lacking:
            raise SettingsError(
                f"{self.path}: its rows lack {', '.join(lacking)} (`fields`), which the figure "
                f"needs: leave out `plot`, or `resume` to compute all frames again"
            )

    def with_frames(self, series: Sequence[Series], chosen: slice) -> slice:
        """
        The frames of the table and those that are chosen now, as one slice.

        Raises
        ------
        SettingsError
            If together they make none: no frame of the table may be lost.
        """
        known = {frame for frames in self.rows.values() for frame in frames}
        if not known or all(known <= set(_up_to(one, chosen, max(known))) for one in series):
            return chosen
        last = max(known)
        more = {frame for one in series for frame in _up_to(one, chosen, last + 1)}
        # frames that were skipped leave no hole
        asked = {frame for one in series for frame in _up_to(one, self.frames, last)}
        every = sorted(known | more | {frame for frame in asked if frame < last})
        steps = {right - left for left, right in pairwise(every)} or {1}
        if len(steps) > 1:
            raise SettingsError(
                f"frames: {self.path} holds frames {min(known)} to {last}, which with those "
                f"chosen now make no slice A:B:C: choose `frames` so that they do, or another "
                f"`output=FILE`"
            )
        endless = chosen.stop is None
        step = steps.pop()
        return slice(every[0], None if endless else every[-1] + 1, None if step == 1 else step)


def _up_to(series: Series, frames: slice, last: int) -> list[int]:
    """The chosen frames, of a slice without an end those up to a number and the next one."""
    chosen = chosen_frames(series, frames)
    if frames.stop is None and (frames.start or 0) >= 0 and (frames.step or 1) > 0:
        chosen = chosen[: max(len(range(chosen.start, last + 1, chosen.step)), 1)]
    return list(chosen)


def finished_table(
    path: Path, asked: Mapping[str, Any], series: Sequence[Series], settings: Settings
) -> FinishedTable:
    """
    The finished rows of a complete table.

    Parameters
    ----------
    path : Path
        The table; ``path.manifest.json`` says what it was made of.
    asked : mapping
        What is asked for now.
    series : sequence of Series
        What is read now.
    settings : Settings
        Of the computation.

    Raises
    ------
    SettingsError
        If other settings or other inputs made it, or if nobody knows what did.
    """
    manifest = read_manifest(path)
    if manifest is None:
        raise _refused(path, f"there is no {path.name}.manifest.json, which says what made it")
    before = {**default_settings(), **manifest["settings"]}
    differing = differing_settings(before, dict(asked), FREE)
    if differing:
        raise _refused(path, f"it was made with other settings ({', '.join(differing)})")
    rows = read_finished_rows(path)
    if rows and not {"source", "frame"} <= set(rows[0]):
        raise _refused(path, "it lacks the columns source and frame, which tell its frames")
    found = _by_frame(path, rows, series, settings)
    _check_inputs(path, manifest, series, found)
    frames = slice(*(manifest["settings"].get("frames") or (None,)))
    told = [str(one) for one in manifest.get("warnings", [])]
    return FinishedTable(path, found, frames, told, frozenset(rows[0] if rows else ()))


def check_part(
    part: Path,
    manifest: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    series: Sequence[Series],
    settings: Settings,
) -> None:
    """
    Refuse the part of an interrupted run whose inputs are not what they were.

    Parameters
    ----------
    part : Path
        For messages.
    manifest : mapping
        Settings and inputs of its rows.
    rows : sequence of mapping
        Of frames that have all of theirs.
    series : sequence of Series
        What is read now.
    settings : Settings
        Of the computation.

    Raises
    ------
    SettingsError
        If other inputs made them, or if their frames are not among those chosen now.
    """
    if not rows:
        return
    found = _by_frame(part, rows, series, settings)
    names = [one.name for one in series]
    over = names[: names.index(rows[-1]["source"])]
    _check_inputs(part, manifest, series, found, over)
    for one in series:
        chosen = chosen_frames(one, settings.frames)  # may have no end
        other = [frame for frame in found[one.name] if frame not in chosen]
        if other:
            raise _refused(part, f"it holds frame {min(other)}, which is not chosen now")


class InputsOfRows:
    """What the files of rows hold, each told once, before the first row that is of it."""

    def __init__(self, series: Sequence[Series], settings: Settings, inputs: Inputs) -> None:
        self._series = {one.name: one for one in series}
        self._inputs = inputs
        self._before: tuple[str, int] | None = None
        chosen = {"strain": settings.strain, "rv_shape": settings.rv_shape}
        files = (strain_file(chosen), surface_file(chosen))
        self._named = [file for file in files if file is not None]
        self._told: set[Path] = set()

    def new(self, row: Row) -> list[dict[str, Any]]:
        """What has not been told yet of the frames up to that of a row."""
        if self._before == (row.source, row.frame):
            return []
        self._before = row.source, row.frame
        found = [file for file in self._files(row) if file not in self._told]
        self._told.update(found)
        return [self._inputs.entry(file) for file in dict.fromkeys(found)]

    def _files(self, row: Row) -> Iterator[Path]:
        yield from self._named
        for name, one in self._series.items():
            if one.cells is not None:
                yield one.cells.path
            if name == row.source:
                yield from self._through(one, row.frame)
                return
            # a series that is over; if nothing of it has been told, an earlier run has done that
            yield from one.files()

    def _through(self, series: Series, frame: int) -> Iterator[Path]:
        for file, is_grains in series.files_through(frame):
            if file in self._told:
                continue
            yield file
            if is_grains:
                yield from series.beside(file)


def _by_frame(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    series: Sequence[Series],
    settings: Settings,
) -> dict[str, dict[int, list[Row]]]:
    """Rows by source and frame, of frames that have all of theirs."""
    found: dict[str, dict[int, list[Row]]] = {one.name: {} for one in series}
    for (source, frame), group in groupby(rows, key=lambda row: (row["source"], row["frame"])):
        if source not in found:
            raise _refused(path, f"its source {source} is not named now")
        own = [written_row(row, settings.columns) for row in group]
        if len(own) == settings.rows_per_frame:
            found[source][frame] = own
    return found


def written_row(values: Mapping[str, Any], columns: Collection[Column]) -> Row:
    """A row as it was written; columns that were not are empty, and are not written again."""
    return Row(**{one.name: values.get(one.name) for one in columns})


def _refused(path: Path, reason: str) -> SettingsError:
    return SettingsError(
        f"{path}: `resume` cannot go on with it: {reason}: name another `output=FILE`, or leave "
        f"out `resume` to compute all frames again"
    )


def _check_inputs(
    path: Path,
    manifest: Mapping[str, Any],
    series: Sequence[Series],
    rows: Mapping[str, Mapping[int, list[Row]]],
    over: Collection[str] = (),
) -> None:
    """
    Refuse rows whose inputs are not what they were, but for frames behind the last one.

    Behind the frames of a series that is ``over`` stand those of the next: nothing may have come.
    """
    before = {str(one.get("path")): one for one in manifest.get("inputs", [])}
    strains = strain_file(manifest["settings"])
    numbers = [strains, *(one.cells.path for one in series if one.cells is not None)]
    tables = [file for file in numbers if file is not None]
    surface = surface_file(manifest["settings"])
    surfaces = [] if surface is None else [surface]
    read = {*tables, *surfaces, *(file for one in series for file in one.files())}
    for gone in before.keys() - {str(file) for file in read}:
        raise _refused(path, f"{gone} is not among the files that are read now")
    for one in series:
        _check_frames(path, before, one, rows[one.name], one.name in over)
    for file in surfaces:
        if not _is_same(file, before.get(str(file))):
            raise _refused(path, f"{file} has changed since")
    every = [row for frames in rows.values() for some in frames.values() for row in some]
    for file in tables:
        # a longer one may name the strains of frames that had none
        may_grow = file != strains or all(row.strain is not None for row in every)
        if not _is_same(file, before.get(str(file)), may_grow, by_lines=True):
            raise _refused(path, f"{file} has changed since, in more than new lines at its end")


def _check_frames(
    path: Path,
    before: Mapping[str, Any],
    series: Series,
    rows: Mapping[int, list[Row]],
    is_over: bool,
) -> None:
    """Refuse what has changed of the files of a series, and what lies beside them."""
    grains = series.grains.files
    steps = [step for step, file in grains.items() if str(file) in before]
    last = max((step for step in steps if step is not None), default=None)
    for step, file in (f for one in (series.grains, *series.contacts) for f in one.files.items()):
        known, is_last = before.get(str(file)), step is None or step == last
        if known is None and steps and (step is None or last is None or step <= last):
            raise _refused(path, f"{file} is new, and not behind the last frame")
        if known is None and is_over:
            raise _refused(path, f"{file} is new, and rows of the next source are there already")
        if known is None:
            continue
        beside = series.beside(file) if grains.get(step) == file else []
        changed = [one for one in beside if not _is_same(one, before.get(str(one)))]
        if not _is_same(file, known, may_grow=is_last and not is_over):
            changed.append(file)
        if changed and not _was_skipped(series, step, rows):
            what = "has changed since" if str(changed[0]) in before else "is new, beside the grains"
            raise _refused(path, f"{changed[0]} {what}")


def _is_same(
    file: Path, before: Mapping[str, Any] | None, may_grow: bool = False, by_lines: bool = False
) -> bool:
    """Whether a file is what it was, or begins as it was; snapshots or lines have come behind."""
    if before is None:
        return False
    size, length = before.get("size"), file.stat().st_size
    if not isinstance(size, int) or length < size or (length > size and not may_grow):
        return False
    digest = hashlib.sha256()
    with open(file, "rb") as stream:
        part = b"\n"
        while size and (part := stream.read(min(size, 1 << 20))):
            digest.update(part)
            size -= len(part)
        # a number at the end may have got more digits
        if by_lines and not part.endswith(b"\n") and stream.read(1) not in (b"", b"\r", b"\n"):
            return False
    return digest.hexdigest() == before.get("sha256")


def _was_skipped(series: Series, step: int | None, rows: Mapping[int, Any]) -> bool:
    """Whether the files of a step have given no row: a broken file may have been mended."""
    frames = [number for number, frame in enumerate(series) if frame.name_step == step]
    # a broken file counts as one frame: if there are more, later ones have other numbers now
    return len(frames) == 1 and frames[0] not in rows
