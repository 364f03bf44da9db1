"""merge_tables(): the parts of a job array as one table, with the bytes of one run."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabWarning, SettingsError
from scanfab.base.files import check_folder
from scanfab.base.spelling import counted
from scanfab.io.families import PathLike
from scanfab.io.options import parse_frames
from scanfab.pipeline.manifest import default_settings, with_frames, write_manifest
from scanfab.pipeline.repeat import read_manifest, restored_settings
from scanfab.pipeline.resume import written_row
from scanfab.pipeline.settings import Settings
from scanfab.table.formats import format_of
from scanfab.table.reading import read_finished_rows
from scanfab.table.result_file import ResultFile, differing_settings, is_finished
from scanfab.table.row import Row
from scanfab.table.table import Table
from scanfab.table.writing import Excerpt

# what the parts of one table may differ in: their frames, and of which series these are
FREE = ("frames", "sources")


@dataclass(frozen=True, eq=False)
class _Part:
    """The table of one job, and its manifest."""

    path: Path
    manifest: Mapping[str, Any]
    asked: dict[str, Any]
    """Its settings."""
    settings: Settings
    rows: dict[tuple[str, int], list[Row]]
    """By source and frame."""
    columns: frozenset[str] | None
    """Those that were written; None without a row."""

    @property
    def sources(self) -> tuple[str, ...]:
        """What it was made of, as it was named."""
        return tuple(map(str, self.asked["sources"]))

    @property
    def counts(self) -> dict[str, int]:
        """How many frames each series has."""
        found = dict.fromkeys((source for source, _ in self.rows), 0)
        for source, frame in self.rows:
            found[source] = max(found[source], frame + 1)
        return {**found, **self.manifest.get("frames", {})}

    def frames(self, source: str) -> Iterable[int]:
        """The frames of a series that this job was to compute."""
        return range(self.counts.get(source, 0))[self.settings.frames]


@dataclass(frozen=True, eq=False)
class Merged:
    """The rows of one table, and how it is written."""

    rows: list[Row]
    settings: Settings
    excerpt: Excerpt
    manifest: dict[str, Any]
    columns: frozenset[str]
    """Those that all parts have."""

    @property
    def table(self) -> Table:
        """With the columns that were written."""
        columns = self.excerpt.columns(self.settings.columns)
        return Table(self.rows, [one for one in columns if one.name in self.columns])

    def save(self, output: Path) -> None:
        """Write the table and its manifest; each is complete or untouched."""
        columns = self.settings.columns
        result = ResultFile(output, columns, self.excerpt)
        excerpt = self.excerpt
        if not getattr(format_of(output), "holds_lists", False):
            excerpt = excerpt.without_lists(columns)
        lacking = [one.name for one in excerpt.columns(columns) if one.name not in self.columns]
        if lacking:
            raise SettingsError(
                f"{output}: a run would write {', '.join(lacking)} to it, which the format of the "
                f"parts cannot hold: name an output of theirs, or let the jobs write .jsonl"
            )
        result.save(self.rows)
        write_manifest(result.manifest, self.manifest)


def merge_tables(
    parts: PathLike | Sequence[PathLike],
    output: PathLike | None = None,
    *,
    frames: str | int | slice | None = None,
) -> Table:
    """
    The tables of a job array as one table: the rows, and the bytes, of one run.

    Each job computes some frames (``scanfab compute dumps/ --frames I::N -o part_I.csv``). The RV,
    ``rmin`` and the initial length are those of the whole series in every part, so the rows of all
    parts in the order of their frames are the table of a single run. Parts of several series become
    a table of all of them, one series after the other, in the order in which they are named.

    Parameters
    ----------
    parts : path or sequence of paths
        Tables of any format, each with its manifest ``PART.manifest.json`` beside it.
    output : path, optional
        A file for the table; its manifest is written beside it. The suffix is its format.
    frames : str, int or slice, optional
        Which frames of each series the table is to have, by default all.

    Returns
    -------
    Table
        A row for each frame and variant.

    Raises
    ------
    ReadError
        If a part is not finished, was made with other settings or of other files, or differs from
        another one in a frame that both have, or if a frame is in no part; nothing is written.
    SettingsError
        If the output cannot be a table, or is one of the parts.

    Examples
    --------
    >>> import scanfab, tempfile
    >>> series = scanfab.read_series("sample_data/liggghts_periodic")
    >>> words = {"variants": "a", "tolerance": 0.01}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for job in (0, 1):
    ...         part = f"{folder}/part_{job}.csv"
    ...         table = scanfab.compute_file(series, part, frames=f"{job}::2", **words)
    ...     table = scanfab.merge_tables([f"{folder}/part_{job}.csv" for job in (1, 0)])
    >>> table == scanfab.compute(series, **words)
    True
    """
    named = [parts] if isinstance(parts, str | os.PathLike) else parts
    paths = [Path(one) for one in named]
    if output is not None:
        check_output(Path(output), paths)
    found = merged(paths, parse_frames(frames))
    if output is not None:
        found.save(Path(output))
    return found.table


def merged(paths: Sequence[Path], frames: slice) -> Merged:
    """What :func:`merge_tables` makes of some parts."""
    if not paths:
        raise SettingsError("expected the parts of a table, found none")
    parts = [_read(path) for path in dict.fromkeys(paths)]
    first = parts[0]
    for part in parts[1:]:
        _check_like(first, part)
    _check_inputs(parts)
    series = _series(parts)
    rows = [row for source in series for row in _rows(source, frames, parts)]
    asked = with_frames(first.asked, frames)
    asked["sources"] = list(dict.fromkeys(one for part in parts for one in part.sources))
    excerpt = Excerpt(tuple(asked.get("fields") or ()), asked.get("digits", Excerpt.digits))
    found = {**first.manifest, "settings": asked, "frames": series}
    inputs = {one.get("path"): one for part in parts for one in part.manifest.get("inputs", [])}
    found["inputs"] = [inputs[path] for path in sorted(inputs)]
    for name in ("warnings", "notes"):
        told = (text for part in parts for text in part.manifest.get(name, []))
        found[name] = list(dict.fromkeys(told))
    every = frozenset(one.name for one in first.settings.columns)
    columns = every.intersection(*(part.columns for part in parts if part.columns is not None))
    return Merged(rows, first.settings, excerpt, found, columns)


def check_output(output: Path, paths: Sequence[Path]) -> None:
    """SettingsError if the output cannot be written, or would replace a part."""
    format_of(output)
    check_folder(output)
    if output.resolve() in [path.resolve() for path in paths]:
        raise SettingsError(f"{output}: is one of the parts: name another `output=FILE`")


def _read(path: Path) -> _Part:
    part = path.with_name(path.name + ".part")
    if part.exists() and not is_finished(path):
        raise ReadError(
            f"{path}: is not finished: {part.name} is there, which holds the rows of a run under "
            f"way, or of one that was interrupted: the same command with `resume` goes on with it"
        )
    if not path.exists():
        raise ReadError(f"{path}: there is no such part: its job has not been run, or has failed")
    manifest = read_manifest(path)
    if manifest is None:
        raise ReadError(
            f"{path}: expected {path.name}.manifest.json beside it, which says what made it, found "
            f"none: run its job again"
        )
    asked = {**default_settings(), **manifest["settings"]}
    try:
        settings = restored_settings(asked)
    except SettingsError as error:
        raise ReadError(f"{path}: {error}") from None
    rows = read_finished_rows(path)
    if rows and not {"source", "frame"} <= set(rows[0]):
        raise ReadError(f"{path}: lacks the columns source and frame, which tell its rows apart")
    columns = frozenset(rows[0]) if rows else None
    return _Part(path, manifest, asked, settings, _by_frame(path, rows, settings), columns)


def _by_frame(
    path: Path, rows: list[dict[str, Any]], settings: Settings
) -> dict[tuple[str, int], list[Row]]:
    found = {}
    for (source, frame), group in groupby(rows, key=lambda row: (row["source"], row["frame"])):
        own = [written_row(row, settings.columns) for row in group]
        if len(own) != settings.rows_per_frame or (source, frame) in found:
            raise ReadError(
                f"{path}: expected {settings.rows_per_frame} rows of frame {frame} of {source}, "
                f"one after the other, found {len(own)}: run its job again"
            )
        found[source, frame] = own
    return found


def _check_like(first: _Part, part: _Part) -> None:
    """ReadError if two parts are not of one table."""
    differing = differing_settings(first.asked, part.asked, FREE)
    if differing:
        raise ReadError(
            f"{part.path}: was made with other settings ({', '.join(differing)}) than {first.path}"
        )
    shared = [source for source in part.counts if source in first.counts]
    if shared and part.sources != first.sources:
        raise ReadError(
            f"{part.path}: its series {shared[0]} was made of other files than that of "
            f"{first.path}: {', '.join(part.sources[:3])} in place of "
            f"{', '.join(first.sources[:3])}"
        )


def _check_inputs(parts: Sequence[_Part]) -> None:
    """ReadError if a file has changed between two jobs."""
    known: dict[str, tuple[str, Path]] = {}
    for part in parts:
        for one in part.manifest.get("inputs", []):
            path, digest = str(one.get("path")), str(one.get("sha256"))
            before, other = known.setdefault(path, (digest, part.path))
            if before != digest:
                raise ReadError(
                    f"{part.path}: was made of another {path} than {other}: it has changed between "
                    f"the two: run these jobs again"
                )


def _series(parts: Sequence[_Part]) -> dict[str, int]:
    """How many frames each series has, in the order in which one command would name them."""
    found: dict[str, int] = {}
    for part in parts:
        for source, count in part.counts.items():
            found[source] = max(found.get(source, 0), count)
    return found


def _rows(source: str, frames: slice, parts: Sequence[_Part]) -> Iterator[Row]:
    """The rows of one series in the order of its frames, each once."""
    own = [part for part in parts if source in part.counts]
    chosen = range(max(part.counts[source] for part in own))[frames]
    for frame in chosen if chosen.step > 0 else chosen[::-1]:
        having = [part for part in own if (source, frame) in part.rows]
        for part in having[1:]:
            _check_same(having[0], part, source, frame)
        if having:
            yield from having[0].rows[source, frame]
        else:
            _check_skipped(source, frame, own)


def _check_same(first: _Part, part: _Part, source: str, frame: int) -> None:
    one, other = first.rows[source, frame], part.rows[source, frame]
    differing = next((pair for pair in zip(one, other, strict=True) if pair[0] != pair[1]), None)
    if differing is not None:
        before, now = differing
        name = next(name for name in before if before[name] != now[name])
        raise ReadError(
            f"{part.path}: frame {frame} of {source} is in {first.path} too, with other values: "
            f"{name} is {now[name]} here and {before[name]} there"
        )


def _check_skipped(source: str, frame: int, parts: Sequence[_Part]) -> None:
    """ReadError for a frame without rows, unless a job was to compute it and has skipped it."""
    asked = next((part for part in parts if frame in part.frames(source)), None)
    if asked is None:
        named = ", ".join(str(part.path) for part in parts[:3])
        named += ", ..." if len(parts) > 3 else ""
        raise ReadError(
            f"frame {frame} of {source} is missing: it is in none of the "
            f"{counted(len(parts), 'part')} ({named}): name all parts, or with `frames` the frames "
            f"that the table is to have"
        )
    if asked.settings.on_error != "skip":
        raise ReadError(f"{asked.path}: lacks frame {frame} of {source}: run its job again")
    warnings.warn(
        f"{asked.path}: frame {frame} of {source} was skipped, see its manifest",
        ScanfabWarning,
        stacklevel=6,
    )
