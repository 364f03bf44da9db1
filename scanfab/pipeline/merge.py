"""merge_tables(): join the parts of a job array into one table, with the bytes of one run."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, SettingsError, warn
from scanfab.base.files import refuse_inputs
from scanfab.io.families import PathLike
from scanfab.io.reader import parse_frames
from scanfab.pipeline.record import Record, part_of, read_table, write_manifest
from scanfab.pipeline.values import as_written
from scanfab.table.row import Row
from scanfab.table.table import Table
from scanfab.table.writing import Excerpt, manifest_of, write_rows


def merge_tables(
    parts: PathLike | Sequence[PathLike],
    output: PathLike | None = None,
    *,
    frames: str | int | slice | None = None,
) -> Table:
    """
    Join the tables of a job array into one table, with the rows and bytes of a single run.

    Each job computes some frames (``scanfab compute dumps/ --frames I::N -o part_I.csv``). RV,
    ``rmin`` and initial length come from the whole series in every part, so the rows of all parts
    in the order of their frames are the table of a single run. Parts of several series become one
    table, one series after the other in the order in which they are named.

    Parameters
    ----------
    parts : path or sequence of paths
        Tables of any format, each with its manifest ``PART.manifest.json`` beside it.
    output : path, optional
        A file for the table; its manifest is written beside it. The suffix decides the format.
    frames : str, int or slice, optional
        Which frames of each series the table must have (default: all).

    Returns
    -------
    Table
        A row for each frame and variant.

    Raises
    ------
    ReadError
        If a part is not finished, was made with other settings or of other files, or has other
        values than another part for the same frame; or if a frame is in no part.
    SettingsError
        If the output cannot be a table, or is one of the parts.

    Examples
    --------
    >>> import scanfab, tempfile
    >>> series = scanfab.read_series("sample_data/liggghts_periodic")
    >>> words = {"variants": "c", "tolerance": 0.01}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for job in (0, 1):
    ...         part = f"{folder}/part_{job}.csv"
    ...         table = scanfab.compute_file(series, part, frames=f"{job}::2", **words)
    ...     table = scanfab.merge_tables([f"{folder}/part_{job}.csv" for job in (1, 0)])
    >>> table == scanfab.compute(series, **words)
    True
    """
    named = [parts] if isinstance(parts, str | os.PathLike) else parts
    paths = list(dict.fromkeys(map(Path, named)))
    if not paths:
        raise SettingsError("expected the parts of a table, found none")
    chosen = parse_frames("frames", frames)
    if output is not None:
        refuse_inputs([Path(output)], [*paths, *map(manifest_of, paths)])
    records = [_read(path) for path in paths]
    manifest = _joined_manifest(records, chosen)
    rows = [
        row
        for source, count in manifest["frames"].items()
        for frame in sorted(range(count)[chosen])
        for row in _rows_of(source, frame, records)
    ]
    asked, declared = manifest["settings"], records[0].settings.columns
    excerpt = Excerpt(tuple(asked.get("fields", ())), asked.get("digits", Excerpt.digits))
    if output is not None:
        save = partial(write_manifest, manifest_of(Path(output)), manifest)
        write_rows(Path(output), rows, declared, excerpt, save)
    return Table(rows, excerpt.columns(declared))


def _joined_manifest(records: Sequence[Record], frames: slice) -> dict[str, Any]:
    """The manifest of the merged table; ReadError if settings or inputs of the parts differ."""
    first, manifests = records[0], [record.manifest for record in records]
    inputs: dict[str, tuple[Mapping[str, Any], Path]] = {}
    counts: dict[str, int] = {}
    for record in records:
        if differing := first.differing(record.manifest["settings"]):
            raise ReadError(f"{record.path}: has other settings ({differing}) than {first.path}")
        for path, entry in record.inputs.items():
            before, part = inputs.setdefault(path, (entry, record.path))
            if before.get("sha256") != entry.get("sha256"):
                what = f"{path} has changed between the jobs of it and of {part}"
                raise ReadError(f"{record.path}: {what}: run them again")
        for source, count in record.manifest["frames"].items():
            counts[source] = max(count, counts.get(source, 0))

    def each_once(lists: Iterable[Iterable[Any]]) -> list[str]:
        return list(dict.fromkeys(str(item) for items in lists for item in items))

    sources = each_once(one["settings"]["sources"] for one in manifests)
    return {
        **manifests[0],
        "settings": {**manifests[0]["settings"], "frames": as_written(frames), "sources": sources},
        "inputs": [inputs[path][0] for path in sorted(inputs)],
        "warnings": each_once(one["warnings"] for one in manifests),
        "notes": each_once(one["notes"] for one in manifests),
        "frames": counts,
    }


def _read(path: Path) -> Record:
    """The record of a part; ReadError if it is not finished."""
    if part_of(path).exists():
        how = "the same command with `resume` goes on with it"
        raise ReadError(f"{path}: is not finished, as {part_of(path).name} is there: {how}")
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
    """The rows of a frame, empty if its job skipped it; ReadError if they are missing."""
    what, key = f"frame {frame} of {source}", (source, frame)
    having = [part for part in parts if key in part.rows]
    for part in having[1:]:
        for before, now in zip(having[0].rows[key], part.rows[key], strict=True):
            if differing := [name for name in before if before[name] != now[name]]:
                name, other = differing[0], f"{what} has other values than in {having[0].path}"
                values = f"{name} is {now[name]} here and {before[name]} there"
                raise ReadError(f"{part.path}: {other}: {values}")
    if having:
        return having[0].rows[key]
    for part in parts:
        if frame in range(part.manifest["frames"].get(source, 0))[part.settings.frames]:
            if part.settings.on_error != "skip":
                raise ReadError(f"{part.path}: lacks {what}: run its job again")
            warn(f"{part.path}: {what} was skipped, see its manifest")
            return []
    raise ReadError(f"{what} is in none of the parts: name all parts, or choose `frames`")
