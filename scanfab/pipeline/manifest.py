"""What a result was made of: settings, versions, and the inputs with size and hash."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from scanfab.base.files import whole_file
from scanfab.base.option import options_of
from scanfab.io.series import Series
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import STRAIN_MODES, UsualAxis
from scanfab.pipeline.window_settings import SHAPES
from scanfab.scan.directions import DirectionRule
from scanfab.table.writing import ALL, Excerpt

# bytes of a file that are read at a time
PART = 1 << 20
PACKAGES = (
    "scanfab", "numpy", "numba", "scipy", "meshio", "pyvista", "click", "rich", "h5py",
    "matplotlib", "jinja2", "polars",
)  # fmt: skip


def asked_for(
    sources: Sequence[str],
    reading: Mapping[str, Any],
    settings: Settings,
    excerpt: Excerpt = ALL,
) -> dict[str, Any]:
    """
    What decides the bytes of a result, as JSON can hold it: all but the number of workers.

    Parameters
    ----------
    sources : sequence of str
        As given.
    reading : mapping
        Options of ``read_series``.
    settings : Settings
        Of the computation.
    excerpt : Excerpt, optional
        Columns and digits of the result.
    """
    named = {"scanfab": version("scanfab"), "sources": list(sources)}
    return {**named, **_plain(dict(reading)), **_chosen(settings), **excerpt.asked()}


def default_settings() -> dict[str, Any]:
    """What an older manifest means that says nothing of a setting: there was no choice."""
    return _chosen(Settings())


def _chosen(settings: Settings) -> dict[str, Any]:
    return {
        one.name: _plain(getattr(settings, one.name))
        for one in options_of(type(settings))
        if one.meaning
    }


def with_frames(asked: dict[str, Any], frames: slice) -> dict[str, Any]:
    """What was asked for, of other frames."""
    return {**asked, "frames": _plain(frames)}


class Inputs:
    """Size and hash of files, each read once as long as it stays as it is."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}

    def entry(self, path: Path) -> dict[str, Any]:
        """A file as a manifest lists it."""
        found = path.stat()
        stamp = (found.st_size, found.st_mtime_ns)
        if path not in self._known or self._known[path][0] != stamp:
            entry = {"path": str(path), "size": found.st_size, "sha256": _hash(path, found.st_size)}
            self._known[path] = stamp, entry
        return self._known[path][1]


def manifest(
    asked: dict[str, Any],
    series: Iterable[Series],
    warnings: Sequence[str] = (),
    notes: Sequence[str] = (),
    inputs: Inputs | None = None,
) -> dict[str, Any]:
    """
    The manifest of a finished result.

    Parameters
    ----------
    asked : dict
        From :func:`asked_for`.
    series : iterable of Series
        What was read.
    warnings, notes : sequence of str, optional
        What the user was told.
    inputs : Inputs, optional
        Those that have been looked at already.
    """
    inputs, series = inputs or Inputs(), list(series)
    files = {path for one in series for path in one.files()}
    files.update(one for one in (strain_file(asked), surface_file(asked)) if one is not None)
    return {
        "settings": asked,
        "seed": asked["seed"],
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in PACKAGES},
        },
        "inputs": [inputs.entry(path) for path in sorted(files)],
        "warnings": list(warnings),
        "notes": list(notes),
        # of the whole series: who merges parts knows by it which frames are missing
        "frames": {one.name: len(one) for one in series},
    }


def write_manifest(path: Path, found: Mapping[str, Any]) -> None:
    """Write a manifest as JSON; the file is complete or untouched."""
    text = json.dumps(found, indent=1, ensure_ascii=False)
    with whole_file(path) as part:
        # names of files need be no text; what replaces their letters is how JSON spells them
        part.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")


def strain_file(asked: Mapping[str, Any]) -> Path | None:
    """The file of ``--strain FILE.csv``."""
    strain = asked.get("strain", "auto")
    return None if strain in STRAIN_MODES else Path(strain)


def surface_file(asked: Mapping[str, Any]) -> Path | None:
    """The file of ``--rv-shape FILE``."""
    shape = asked.get("rv_shape", "sphere")
    return None if shape in SHAPES else Path(shape)


def _plain(value: Any) -> Any:
    """A value in the types of JSON."""
    if isinstance(value, DirectionRule):
        return value.asked_as
    if isinstance(value, UsualAxis):
        # which axis that is, the grains decide
        return None
    if isinstance(value, slice):
        return [value.start, value.stop, value.step]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if hasattr(value, "__dataclass_fields__"):
        return _plain(asdict(value))
    return str(value) if isinstance(value, Path) else value


def _hash(path: Path, size: int) -> str:
    """Of so many bytes: a simulation may write more meanwhile."""
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        while size and (part := stream.read(min(size, PART))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest()
