"""
Which rows of a table are there, and what made them: settings, versions, inputs with size and hash.

FILE.manifest.json says it of a complete FILE, and FILE.part of its own rows: both are read as a
:class:`Record`. By it a run that goes on with finished rows, and a merge of several tables, tell
whether the rows are those that they would compute now.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import ReadError, ScanfabError, SettingsError
from scanfab.base.files import whole_file
from scanfab.base.option import options_of
from scanfab.io.series import Series
from scanfab.pipeline.maps.settings import MapSettings, is_map
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import SHAPES, STRAIN_MODES, as_written
from scanfab.table.columns import row_of
from scanfab.table.formats import read_rows
from scanfab.table.row import Row
from scanfab.table.writing import ALL, Excerpt, manifest_of

PACKAGES = (
    "scanfab", "numpy", "numba", "scipy", "meshio", "pyvista", "click", "rich", "h5py",
    "matplotlib", "jinja2", "polars",
)  # fmt: skip
# Settings that may differ where rows are taken over from a complete table or merged: such rows are
# of other frames, or of other series, and their inputs are compared by content.
FREE = ("frames", "sources")
# bytes of a file that are read at a time
PIECE = 1 << 20

FrameRows = dict[tuple[str, int], list[Row]]
"""The rows of each frame, by its source and number."""
Refuse = Callable[[str], ScanfabError]
"""The error for rows that cannot be used, made from the reason."""


class Record(NamedTuple):
    """Finished rows by source and frame, and what made them."""

    path: Path
    """Of the table, or of its FILE.part."""
    settings: Settings
    manifest: dict[str, Any]
    """Of FILE.part only ``settings`` and ``inputs``."""
    rows: FrameRows
    """The rows of a frame may be fewer than it has."""
    columns: frozenset[str]
    """Those that were written; none without a row."""

    @classmethod
    def of(cls, path: Path, manifest: dict[str, Any], rows: Sequence[Mapping[str, Any]]) -> Record:
        """A record of rows as they were read; SettingsError for settings that cannot be used."""
        settings, found = restored_settings(manifest["settings"]), FrameRows()
        for row in rows:
            complete = row_of(settings.columns, row)
            found.setdefault((row["source"], row["frame"]), []).append(complete)
        return cls(path, settings, manifest, found, frozenset(rows[0] if rows else ()))


def asked_for(
    sources: Sequence[str],
    reading: Mapping[str, Any],
    settings: Settings,
    excerpt: Excerpt = ALL,
) -> dict[str, Any]:
    """
    The settings that decide the bytes of a result, as users write them, in the types of JSON.

    Parameters
    ----------
    sources : sequence of str
        As given.
    reading : mapping
        Options of ``read_series``.
    settings : Settings
        Of the computation. The number of workers changes no result, so it is left out.
    excerpt : Excerpt, optional
        Columns and digits of the result.
    """
    names = [one.name for one in options_of(type(settings)) if one.decides]
    written = {name: as_written(getattr(settings, name)) for name in names}
    if settings.directions is not None:
        written["directions"] = settings.directions.asked_as
    named = {"scanfab": version("scanfab"), "sources": list(sources)}
    found = {**named, **reading, **written, **excerpt.asked()}
    return dict(json.loads(json.dumps(found, default=os.fspath)))


def differing_settings(
    before: Mapping[str, Any], asked: Mapping[str, Any], but: Collection[str] = ()
) -> str:
    """The names of the settings that differ, ``but`` for some, in alphabetical order."""
    names = {name for name in (*before, *asked) if before.get(name) != asked.get(name)}
    names.difference_update(but)
    return ", ".join(sorted("version of scanfab" if n == "scanfab" else n for n in names))


def restored_settings(asked: Mapping[str, Any]) -> Settings:
    """
    The settings of a manifest.

    Raises
    ------
    SettingsError
        If one of them cannot be used any more.
    """
    kind = MapSettings if is_map(asked) else Settings
    try:
        return kind(**{name: asked[name] for name in kind.__dataclass_fields__ if name in asked})
    except (AttributeError, TypeError, ValueError) as error:
        raise SettingsError(f"the settings of the manifest cannot be used: {error}") from None


def named_files(asked: Mapping[str, Any]) -> list[Path]:
    """The files that the settings name: of strains (``strain``), of a surface (``rv_shape``)."""
    strain, shape = asked.get("strain", "auto"), asked.get("rv_shape", "sphere")
    named = ((strain, STRAIN_MODES), (shape, SHAPES))
    return [Path(name) for name, words in named if name not in words]


def input_entry(path: Path) -> dict[str, Any]:
    """Size and hash of a file, as a manifest lists it; it is read again only if it has changed."""
    found = path.stat()
    return dict(_entry(path, found.st_size, found.st_mtime_ns))


@cache
def _entry(path: Path, size: int, _changed: int) -> dict[str, Any]:
    # a simulation may write more meanwhile
    return {"path": str(path), "size": size, "sha256": _hash(path, size)[0]}


def _hash(path: Path, size: int) -> tuple[str, bool]:
    """The SHA-256 of the first bytes of a file, and whether a line ends with them."""
    digest, piece = hashlib.sha256(), b"\n"
    with open(path, "rb") as stream:
        while size and (piece := stream.read(min(size, PIECE))):
            digest.update(piece)
            size -= len(piece)
        ends = piece.endswith(b"\n") or stream.read(1) in (b"", b"\r", b"\n")
    return digest.hexdigest(), ends


def manifest(
    asked: Mapping[str, Any],
    series: Iterable[Series],
    warnings: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> dict[str, Any]:
    """
    The manifest of a finished result.

    Parameters
    ----------
    asked : mapping
        From :func:`asked_for`.
    series : iterable of Series
        What was read.
    warnings, notes : sequence of str, optional
        What the user was told.
    """
    series = list(series)
    files = {*named_files(asked), *(path for one in series for path in one.files())}
    versions = {name: version(name) for name in PACKAGES}
    return {
        "settings": asked,
        "seed": asked["seed"],
        "versions": {"python": platform.python_version(), **versions},
        "inputs": [input_entry(path) for path in sorted(files)],
        "warnings": list(warnings),
        "notes": list(notes),
        # of the whole series, so that a merge of parts knows which frames are missing
        "frames": {one.name: len(one) for one in series},
    }


def write_manifest(path: Path, found: Mapping[str, Any], outdated: Path | None = None) -> None:
    """
    Write a manifest as JSON; the file is complete or untouched.

    An ``outdated`` table, which it does not describe, is removed before the manifest appears: they
    would look like a pair if the process were killed between the two.
    """
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # file names may hold bytes that are no text
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        if outdated is not None and outdated.is_file():
            outdated.unlink()


def read_manifest(table: Path) -> dict[str, Any] | None:
    """
    The manifest beside a table; None if there is none.

    Raises
    ------
    ReadError
        If it is not a manifest.
    """
    path = manifest_of(table)
    if not path.is_file():
        return None
    try:
        found = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ReadError(f"{path}: cannot be read as JSON: {error}") from None
    # the settings are checked where they are used
    kinds = {"settings": dict, "inputs": list, "versions": dict, "warnings": list}
    if (
        not isinstance(found, dict)
        or not all(isinstance(found.get(name, kind()), kind) for name, kind in kinds.items())
        or not isinstance(found.get("settings", {}).get("sources"), list)
        or not all(isinstance(one, dict) for one in found.get("inputs", []))
    ):
        raise ReadError(f"{path}: expected a manifest of scanfab compute, found something else")
    return found


def read_table(table: Path, refuse: Refuse) -> Record:
    """The record of a finished table, whose manifest is beside it."""
    found = read_manifest(table)
    if found is None:
        raise refuse(f"there is no {table.name}.manifest.json, which says what made it")
    rows = read_rows(table, whole=True)
    if rows and not {"source", "frame"} <= set(rows[0]):
        raise refuse("it lacks the columns source and frame, which tell its rows apart")
    return Record.of(table, {"inputs": [], "warnings": [], "notes": [], **found}, rows)


def check_inputs(record: Record, series: Sequence[Series], refuse: Refuse) -> None:
    """
    Refuse rows whose inputs are not what they were.

    New frames may have come behind the last one, as files or at the end of the last file. A file
    whose frame was skipped may have been mended, and a file of cells or strains may have new lines.

    Parameters
    ----------
    record : Record
        The rows, and the files that were read for them.
    series : sequence of Series
        What is read now.
    refuse : callable
        Makes the error.
    """
    before = {str(one.get("path")): one for one in record.manifest["inputs"]}
    named = named_files(record.manifest["settings"])
    cells = [one.cells.path for one in series if one.cells is not None]
    read = {str(file) for file in named} | {str(file) for one in series for file in one.files()}
    for gone in before.keys() - read:
        raise refuse(f"{gone} is not among the files that are read now")
    for one in series:
        _check_frames(one, before, record.rows, refuse)
    # new lines may name the strain of a frame that had none
    lacks_strain = any(row.strain is None for some in record.rows.values() for row in some)
    for file in (*named, *cells):
        may_grow = file in cells or (str(file) == record.settings.strain and not lacks_strain)
        if not _is_same(file, before, may_grow, by_lines=True):
            raise refuse(f"{file} has changed since, in more than new lines at its end")


def _check_frames(
    series: Series, before: Mapping[str, Any], rows: FrameRows, refuse: Refuse
) -> None:
    """Refuse what has changed of the files of a series, and of those read with them."""
    steps = [step for step, file in series.grains.files.items() if str(file) in before]
    last = max((step for step in steps if step is not None), default=None)
    for family in (series.grains, *series.contacts):
        for step, file in family.files.items():
            if str(file) not in before:
                if steps and (step is None or last is None or step <= last):
                    raise refuse(f"{file} is new, and not behind the last frame")
                continue
            beside = series.beside(file) if family is series.grains else []
            changed = [one for one in beside if not _is_same(one, before)]
            if not _is_same(file, before, may_grow=step is None or step == last):
                changed.append(file)
            # a broken file counts as one frame: if it has more now, later frames have other numbers
            numbers = [frame.number for frame in series if changed and frame.name_step == step]
            if changed and (len(numbers) != 1 or (series.name, numbers[0]) in rows):
                is_new = str(changed[0]) not in before
                what = "is new, beside the grains" if is_new else "has changed since"
                raise refuse(f"{changed[0]} {what}")


def _is_same(
    file: Path, before: Mapping[str, Any], may_grow: bool = False, by_lines: bool = False
) -> bool:
    """Whether a file is what it was, or begins as it was: with whole lines if ``by_lines``."""
    known = before.get(str(file), {})
    size, length = known.get("size"), file.stat().st_size
    if not isinstance(size, int) or length < size or (length > size and not may_grow):
        return False
    digest, ends_line = _hash(file, size)
    # a number at the end may have got more digits
    return digest == known.get("sha256") and (ends_line or not by_lines)
