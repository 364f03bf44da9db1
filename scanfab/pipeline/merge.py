"""merge_tables(): the parts of a job array as one table, with the bytes of one run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError, warn
from scanfab.io.families import PathLike
from scanfab.io.options import parse_frames
from scanfab.pipeline.record import (
    FREE,
    Record,
    differing_settings,
    is_unfinished,
    part_of,
    read_table,
    write_manifest,
)
from scanfab.pipeline.values import as_written
from scanfab.table.row import Row
from scanfab.table.table import Table
from scanfab.table.writing import Excerpt, check_output, manifest_of, write_rows


class Merged(NamedTuple):
    """The rows of one table, and how it is written."""

    rows: list[Row]
    columns: list[Column]
    """Those that all parts have."""
    excerpt: Excerpt
    manifest: dict[str, Any]

    def save(self, output: Path) -> None:
        """Write the table and its manifest; each is complete or untouched."""
        write = partial(write_manifest, manifest_of(output), self.manifest)
        write_rows(output, self.rows, self.columns, self.excerpt, write)


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
        check_no_part(Path(output), paths)
    found = merged(paths, parse_frames(frames))
    if output is not None:
        found.save(Path(output))
    return Table(found.rows, found.columns)


def check_no_part(output: Path, paths: Sequence[Path]) -> None:
    """SettingsError if the output cannot be written, or would replace a part."""
    check_output(output)
    if output.resolve() in [path.resolve() for path in paths]:
        raise SettingsError(f"{output}: is one of the parts: name another `output=FILE`")


def merged(paths: Sequence[Path], frames: slice) -> Merged:
    """The table that :func:`merge_tables` makes of some parts."""
    if not paths:
        raise SettingsError("expected the parts of a table, found none")
    parts = [_read(path) for path in dict.fromkeys(paths)]
    first, asked = parts[0], parts[0].manifest["settings"]
    inputs: dict[str, tuple[Mapping[str, Any], Path]] = {}
    counts: dict[str, int] = {}
    for part in parts:
        if differing := differing_settings(asked, part.manifest["settings"], FREE):
            raise ReadError(f"{part.path}: has other settings ({differing}) than {first.path}")
        for one in part.manifest["inputs"]:
            before, other = inputs.setdefault(str(one.get("path")), (one, part.path))
            if before.get("sha256") != one.get("sha256"):
                name = f"{one.get('path')} has changed between the jobs"
                raise ReadError(f"{part.path}: {name} of it and of {other}: run them again")
        for source, count in part.manifest["frames"].items():
            counts[source] = max(count, counts.get(source, 0))
    rows = [
        row
        for source, count in counts.items()
        for frame in sorted(range(count)[frames])
        for row in _rows_of(source, frame, parts)
    ]
    sources = _each_once(part.manifest["settings"]["sources"] for part in parts)
    manifest = {
        **first.manifest,
        "settings": {**asked, "frames": as_written(frames), "sources": sources},
        "inputs": [inputs[path][0] for path in sorted(inputs)],
        "warnings": _each_once(part.manifest["warnings"] for part in parts),
        "notes": _each_once(part.manifest["notes"] for part in parts),
        "frames": counts,
    }
    columns, lists = first.settings.columns, [part.columns for part in parts if part.rows]
    fields = asked.get("fields") or [one.name for one in columns]
    fields = [name for name in fields if all(name in names for names in lists)]
    excerpt = Excerpt(tuple(fields), asked.get("digits", Excerpt.digits))
    return Merged(rows, excerpt.columns(columns), excerpt, manifest)


def _each_once(lists: Iterable[Iterable[Any]]) -> list[str]:
    return list(dict.fromkeys(str(one) for some in lists for one in some))


def _read(path: Path) -> Record:
    """The record of a part; ReadError if it is not finished."""
    if is_unfinished(path):
        raise ReadError(
            f"{path}: is not finished, as {part_of(path).name} is there: the same command with "
            f"`resume` goes on with it"
        )
    if not path.exists():
        raise ReadError(f"{path}: there is no such part: run its job")
    try:
        part = read_table(path)
    except SettingsError as error:
        raise ReadError(str(error)) from None
    count = part.settings.rows_per_frame
    for (source, frame), rows in part.rows.items():
        if len(rows) != count:
            found = f"expected {count} rows of frame {frame} of {source}, found {len(rows)}"
            raise ReadError(f"{path}: {found}: run its job again")
    return part


def _rows_of(source: str, frame: int, parts: Sequence[Record]) -> list[Row]:
    """The rows of a frame; none if its job has skipped it, and ReadError if they are missing."""
    what, key = f"frame {frame} of {source}", (source, frame)
    having = [part for part in parts if key in part.rows]
    for part in having[1:]:
        for before, now in zip(having[0].rows[key], part.rows[key], strict=True):
            if differing := [name for name in before if before[name] != now[name]]:
                name, first = differing[0], having[0].path
                values = f"{name} is {now[name]} here and {before[name]} there"
                raise ReadError(f"{part.path}: {what} has other values than in {first}: {values}")
    if having:
        return having[0].rows[key]
    for part in parts:
        count = part.manifest["frames"].get(source, 0)
        if frame in range(count)[part.settings.frames]:
            if part.settings.on_error != "skip":
                raise ReadError(f"{part.path}: lacks {what}: run its job again")
            warn(f"{part.path}: {what} was skipped, see its manifest")
            return []
    raise ReadError(f"{what} is in none of the parts: name all of them, or choose `frames`")
