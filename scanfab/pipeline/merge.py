"""merge_tables(): the parts of a job array as one table, with the bytes of one run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.column import Column
from scanfab.base.errors import ReadError, SettingsError, warn
from scanfab.base.spelling import counted
from scanfab.io.families import PathLike
from scanfab.io.options import parse_frames
from scanfab.pipeline.part import is_unfinished, part_of
from scanfab.pipeline.record import FREE, Record, differing_settings, read_table, write_manifest
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
    first = parts[0]
    asked = first.manifest["settings"]
    for part in parts[1:]:
        if differing := differing_settings(asked, part.manifest["settings"], FREE):
            raise ReadError(
                f"{part.path}: was made with other settings ({differing}) than {first.path}"
            )
    inputs, counts = _joined_inputs(parts), dict[str, int]()
    for part in parts:
        for name, count in _counts(part).items():
            counts[name] = max(count, counts.get(name, 0))
    rows = [
        row
        for source, count in counts.items()
        for row in _rows(source, range(count)[frames], parts)
    ]
    sources = _each_once(part.manifest["settings"]["sources"] for part in parts)
    manifest = {
        **first.manifest,
        "settings": {**asked, "frames": as_written(frames), "sources": sources},
        "inputs": inputs,
        "warnings": _each_once(part.manifest["warnings"] for part in parts),
        "notes": _each_once(part.manifest["notes"] for part in parts),
        "frames": counts,
    }
    fields = asked.get("fields") or [one.name for one in first.settings.columns]
    for part in parts:
        fields = [name for name in fields if name in part.columns or not part.rows]
    excerpt = Excerpt(tuple(fields), asked.get("digits", Excerpt.digits))
    return Merged(rows, excerpt.columns(first.settings.columns), excerpt, manifest)


def _each_once(lists: Iterable[Iterable[Any]]) -> list[str]:
    return list(dict.fromkeys(str(one) for some in lists for one in some))


def _read(path: Path) -> Record:
    """The record of a part; ReadError if it is not finished."""
    if is_unfinished(path):
        raise ReadError(
            f"{path}: is not finished: {part_of(path).name} is there, which holds the rows of a "
            f"run under way, or of one that was interrupted: the same command with `resume` goes "
            f"on with it"
        )
    if not path.exists():
        raise ReadError(f"{path}: there is no such part: its job has not been run, or has failed")
    try:
        part = read_table(path, lambda reason: ReadError(f"{path}: {reason}: run its job again"))
    except SettingsError as error:
        raise ReadError(f"{path}: {error}") from None
    for (source, frame), rows in part.rows.items():
        if len(rows) != part.settings.rows_per_frame:
            raise ReadError(
                f"{path}: expected {part.settings.rows_per_frame} rows of frame {frame} of "
                f"{source}, found {len(rows)}: run its job again"
            )
    return part


def _counts(part: Record) -> dict[str, int]:
    """How many frames each series of a part has, also those that it was not to compute."""
    ends = {source: frame + 1 for source, frame in sorted(part.rows)}
    return {**ends, **part.manifest.get("frames", {})}


def _joined_inputs(parts: Sequence[Record]) -> list[Mapping[str, Any]]:
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


def _rows(source: str, chosen: range, parts: Sequence[Record]) -> Iterator[Row]:
    """The rows of one series in the order of its frames, each once."""
    own = [part for part in parts if source in _counts(part)]
    for frame in chosen if chosen.step > 0 else chosen[::-1]:
        having = [part for part in own if (source, frame) in part.rows]
        if not having:
            _check_skipped(source, frame, own)
            continue
        first, rows = having[0], having[0].rows[source, frame]
        for part in having[1:]:
            for before, now in zip(rows, part.rows[source, frame], strict=True):
                for name in [name for name in before if before[name] != now[name]]:
                    raise ReadError(
                        f"{part.path}: frame {frame} of {source} is in {first.path} too, with "
                        f"other values: {name} is {now[name]} here and {before[name]} there"
                    )
        yield from rows


def _check_skipped(source: str, frame: int, parts: Sequence[Record]) -> None:
    """ReadError for a frame without rows, unless a job was to compute it and has skipped it."""
    asked = [part for part in parts if frame in range(_counts(part)[source])[part.settings.frames]]
    if not asked:
        named = ", ".join(str(part.path) for part in parts[:3])
        named += ", ..." if len(parts) > 3 else ""
        raise ReadError(
            f"frame {frame} of {source} is missing: it is in none of the "
            f"{counted(len(parts), 'part')} ({named}): name all parts, or with `frames` the frames "
            f"that the table is to have"
        )
    if asked[0].settings.on_error != "skip":
        raise ReadError(f"{asked[0].path}: lacks frame {frame} of {source}: run its job again")
    warn(f"{asked[0].path}: frame {frame} of {source} was skipped, see its manifest")
