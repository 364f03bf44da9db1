"""merge_tables(): the parts of a job array as one table, with the bytes of one run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import ReadError, SettingsError, warn
from scanfab.base.files import check_folder
from scanfab.base.spelling import counted
from scanfab.io.families import PathLike
from scanfab.io.options import parse_frames
from scanfab.pipeline.record import (
    FREE,
    FrameRows,
    as_json,
    read_finished,
    rows_by_frame,
    write_manifest,
)
from scanfab.pipeline.repeat import restored_settings
from scanfab.pipeline.settings import Settings
from scanfab.table.formats import format_of
from scanfab.table.row import Row
from scanfab.table.table import Table
from scanfab.table.writing import Excerpt, ResultFile, differing_settings, is_unfinished, part_of


class _Part(NamedTuple):
    """The table of one job, and its manifest."""

    path: Path
    manifest: Mapping[str, Any]
    settings: Settings
    rows: FrameRows
    columns: frozenset[str] | None
    """Those that were written; None without a row."""
    counts: dict[str, int]
    """How many frames each series has."""

    @property
    def asked(self) -> dict[str, Any]:
        """Its settings as the manifest lists them."""
        return dict(self.manifest["settings"])

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
        excerpt = self.excerpt.for_format(format_of(output), columns)
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


def check_output(output: Path, paths: Sequence[Path]) -> None:
    """SettingsError if the output cannot be written, or would replace a part."""
    format_of(output)
    check_folder(output)
    if output.resolve() in [path.resolve() for path in paths]:
        raise SettingsError(f"{output}: is one of the parts: name another `output=FILE`")


def merged(paths: Sequence[Path], frames: slice) -> Merged:
    """The table that :func:`merge_tables` makes of some parts."""
    if not paths:
        raise SettingsError("expected the parts of a table, found none")
    parts = [_read(path) for path in dict.fromkeys(paths)]
    first = parts[0]
    for part in parts[1:]:
        _check_like(first, part)
    inputs = _joined_inputs(parts)
    series: dict[str, int] = {}
    for part in parts:
        series |= {name: max(count, series.get(name, 0)) for name, count in part.counts.items()}
    rows = [
        row
        for source, count in series.items()
        for row in _rows(source, range(count)[frames], parts)
    ]
    sources = list(dict.fromkeys(str(one) for part in parts for one in part.asked["sources"]))
    asked = {**first.asked, "frames": as_json(frames), "sources": sources}
    told = {
        name: list(dict.fromkeys(text for part in parts for text in part.manifest[name]))
        for name in ("warnings", "notes")
    }
    found = {**first.manifest, "settings": asked, "inputs": inputs, **told, "frames": series}
    excerpt = Excerpt(tuple(asked.get("fields") or ()), asked.get("digits", Excerpt.digits))
    every = frozenset(one.name for one in first.settings.columns)
    columns = every.intersection(*(part.columns for part in parts if part.columns is not None))
    return Merged(rows, first.settings, excerpt, found, columns)


def _read(path: Path) -> _Part:
    if is_unfinished(path):
        raise ReadError(
            f"{path}: is not finished: {part_of(path).name} is there, which holds the rows of a "
            f"run under way, or of one that was interrupted: the same command with `resume` goes "
            f"on with it"
        )
    if not path.exists():
        raise ReadError(f"{path}: there is no such part: its job has not been run, or has failed")
    manifest, rows = read_finished(
        path, lambda reason: ReadError(f"{path}: {reason}: run its job again")
    )
    try:
        settings = restored_settings(manifest["settings"])
    except SettingsError as error:
        raise ReadError(f"{path}: {error}") from None
    found, broken = rows_by_frame(rows, settings)
    for source, frame, count in broken:
        raise ReadError(
            f"{path}: expected {settings.rows_per_frame} rows of frame {frame} of {source}, one "
            f"after the other, found {count}: run its job again"
        )
    counts: dict[str, int] = {}
    for source, frame in found:
        counts[source] = max(counts.get(source, 0), frame + 1)
    counts |= manifest.get("frames", {})
    return _Part(path, manifest, settings, found, frozenset(rows[0]) if rows else None, counts)


def _check_like(first: _Part, part: _Part) -> None:
    """ReadError if two parts are not of one table."""
    if differing := differing_settings(first.asked, part.asked, FREE):
        raise ReadError(
            f"{part.path}: was made with other settings ({', '.join(differing)}) than {first.path}"
        )
    shared = [source for source in part.counts if source in first.counts]
    sources, others = part.asked["sources"], first.asked["sources"]
    if shared and sources != others:
        raise ReadError(
            f"{part.path}: its series {shared[0]} was made of other files than that of "
            f"{first.path}: {', '.join(map(str, sources[:3]))} in place of "
            f"{', '.join(map(str, others[:3]))}"
        )


def _joined_inputs(parts: Sequence[_Part]) -> list[Mapping[str, Any]]:
    """The inputs of all parts; ReadError if a file has changed between two jobs."""
    known: dict[str, tuple[Mapping[str, Any], Path]] = {}
    for part in parts:
        for one in part.manifest["inputs"]:
            before, other = known.setdefault(str(one.get("path")), (one, part.path))
            if before.get("sha256") != one.get("sha256"):
                raise ReadError(
                    f"{part.path}: was made of another {one.get('path')} than {other}: it has "
                    f"changed between the two: run these jobs again"
                )
    return [known[path][0] for path in sorted(known)]


def _rows(source: str, chosen: range, parts: Sequence[_Part]) -> Iterator[Row]:
    """The rows of one series in the order of its frames, each once."""
    own = [part for part in parts if source in part.counts]
    for frame in chosen if chosen.step > 0 else chosen[::-1]:
        having = [part for part in own if (source, frame) in part.rows]
        for part in having[1:]:
            _check_same(having[0], part, source, frame)
        if having:
            yield from having[0].rows[source, frame]
        else:
            _check_skipped(source, frame, own)


def _check_same(first: _Part, part: _Part, source: str, frame: int) -> None:
    """ReadError if a frame has other values in two parts."""
    for before, now in zip(first.rows[source, frame], part.rows[source, frame], strict=True):
        for name in before:
            if before[name] != now[name]:
                raise ReadError(
                    f"{part.path}: frame {frame} of {source} is in {first.path} too, with other "
                    f"values: {name} is {now[name]} here and {before[name]} there"
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
    warn(f"{asked.path}: frame {frame} of {source} was skipped, see its manifest")
