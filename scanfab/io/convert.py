"""convert(): frames of a series, or packings from anywhere, as files of another format."""

from __future__ import annotations

import csv
import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabNote, SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.option import refuse_unknown
from scanfab.io.beside import (
    columns_csv,
    columns_file,
    contacts_csv,
    contacts_file,
    frame_csv,
    frame_file,
    is_columns_file,
    is_contacts_file,
    is_frame_file,
)
from scanfab.io.families import names_a_step
from scanfab.io.files import bare_name
from scanfab.io.opening import READING, read_series
from scanfab.io.options import parse_frames
from scanfab.io.registry import installed_readers
from scanfab.io.series import Series
from scanfab.io.unpacking import COMPRESSED_SUFFIXES
from scanfab.io.writer import Writer
from scanfab.io.writers.registry import installed_writers, writer_for, writer_named
from scanfab.io.written import more_columns, own_columns, parts_of
from scanfab.packing.packing import Packing

PathLike = str | os.PathLike[str]
STEP = "{step}"


def convert(
    source: PathLike | Series | Packing | Iterable[Packing],
    out: PathLike,
    *,
    to: str | None = None,
    frames: str | int | slice | None = None,
    after: Callable[[], object] = lambda: None,
    **reading: Any,
) -> list[Path]:
    """
    Write frames in another format; nothing of the common table is lost.

    What a format cannot hold lies beside each file, where whoever reads it finds it by itself:
    contacts in ``STEM.contacts.csv``, cell, step and time in ``STEM.frame.csv``, columns in
    ``STEM.columns.csv``. What lies nowhere is told by a note.

    Parameters
    ----------
    source : path, Series, Packing or iterable of Packing
        What to write.
    out : path
        A file for one frame; a folder, or a name with ``{step}``, for a file each. A frame without
        a step goes by its number.
    to : str, optional
        Name of the format; without it the suffix of ``out`` says it. A folder needs it.
    frames : str, int or slice, optional
        Which, as a Python slice; all by default.
    after : callable, optional
        Called when a frame is written.
    **reading
        How to read paths; see :func:`scanfab.read_series`.

    Returns
    -------
    list of Path
        The files that hold grains, in the order of the frames.

    Raises
    ------
    SettingsError
        If there is no such format, several frames are to go into one file, or two have one step.
    ReadError, PackingError
        If a frame cannot be read; files are complete or untouched.
    OSError
        If a file cannot be written.

    Examples
    --------
    >>> import scanfab, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = scanfab.convert(
    ...         "sample_data/liggghts_periodic/dump_30000.txt.gz", f"{folder}/grains.vtp"
    ...     )
    ...     packing = scanfab.read(written[0])
    >>> written[0].name, len(packing), packing.step
    ('grains.vtp', 800, 30000)
    """
    place = _Place(Path(out), to)
    refuse_unknown("convert", reading, [*READING, "to", "frames"])
    chosen = parse_frames(frames)
    found = _packings(source, chosen, reading)
    written: dict[Path, int] = {}
    held: Packing | None = None
    for number, packing in found:
        if not place.is_series:
            # one file: all must be known to be one before it is touched
            if held is not None:
                raise SettingsError(
                    f"{out}: there are several frames for one file: name a folder, or a file with "
                    f"{STEP} in its name, or choose one with `frames`"
                )
            held = packing
            continue
        path = place.file(number, packing)
        if path in written:
            raise SettingsError(
                f"{path}: the frames {written[path]} and {number} have the same step: choose with "
                f"`frames`"
            )
        save_packing(packing, path, place.writer)
        written[path] = number
        after()
    if held is not None:
        save_packing(held, place.out, place.writer)
        written[place.out] = 0
        after()
    if not written:
        raise SettingsError("`frames` chooses none: there is nothing to write")
    return list(written)


class _Place:
    """Where frames go, and in which format."""

    def __init__(self, out: Path, to: str | None) -> None:
        self.out = out
        is_folder = out.is_dir() or str(out).endswith(os.sep) or (to is not None and not out.suffix)
        self.is_folder = is_folder and STEP not in out.name
        self.is_series = self.is_folder or STEP in out.name
        if to is not None:
            self.writer = writer_named(to)
        elif self.is_folder:
            names = ", ".join(installed_writers())
            raise SettingsError(f"{out}: a folder has no format: name it with `to`, one of {names}")
        else:
            self.writer = writer_for(out)
        if self.is_folder:
            check_folder(out if not out.is_dir() else out / "frame")
        else:
            check_folder(out)

    def file(self, number: int, packing: Packing) -> Path:
        """The file of one frame."""
        step = number if packing.step is None else packing.step
        if not self.is_folder:
            return self.out.with_name(self.out.name.replace(STEP, str(step)))
        self.out.mkdir(exist_ok=True)
        return self.out / f"frame_{step}{self.writer.extensions[0]}"


def _packings(source: Any, chosen: slice, reading: dict[str, Any]) -> Iterator[tuple[int, Packing]]:
    """The chosen frames with their numbers."""
    if isinstance(source, str | os.PathLike):
        source = read_series(source, **reading)
    elif reading:
        raise SettingsError(f"`{next(iter(reading))}` is for files that are yet to be read")
    if isinstance(source, Series):
        _tell_left_out(source)
        part = source[chosen]
        return ((frame.number, frame.read()) for frame in part)
    packings = [source] if isinstance(source, Packing) else source
    if not isinstance(packings, Iterable):
        raise SettingsError(f"source: expected a path, a Series or packings, found {source!r}")
    bounds = (chosen.start, chosen.stop, chosen.step)
    if any(bound is not None and bound < 0 for bound in bounds):
        # counted from the end, which has to come first
        return iter(list(_numbered(packings))[chosen])
    return islice(_numbered(packings), *bounds)


def _tell_left_out(series: Series) -> None:
    """A note for each kind of contact files: contacts have no columns but those of a packing."""
    for family in series.contacts:
        ask = getattr(family.reader, "left_out", None)
        file = next(iter(family.files.values()))
        names = ["whatever else stands there"] if ask is None else ask(file)
        if names:
            warnings.warn(
                f"{family.pattern}: contacts are kept as pairs, images and forces; left out: "
                f"{', '.join(names)}",
                ScanfabNote,
                stacklevel=3,
            )


def _numbered(packings: Iterable[Any]) -> Iterator[tuple[int, Packing]]:
    for number, packing in enumerate(packings):
        if not isinstance(packing, Packing):
            raise SettingsError(f"source: expected packings, found {packing!r} among them")
        yield number, packing


def save_packing(packing: Packing, path: Path, writer: Writer | None = None) -> None:
    """
    One packing into one file, with what lies beside it; all files are complete or untouched.

    Parameters
    ----------
    packing : Packing
        What to write.
    path : Path
        Where to.
    writer : Writer, optional
        By default the one that the suffix names.
    """
    writer = writer_for(path) if writer is None else writer
    beside: dict[Path, bytes] = {}
    with ExitStack() as files:
        # the first to be opened is the last to take its place: with the grains all is there
        part = files.enter_context(whole_file(path))
        left = writer.write(packing, part)
        if left.contacts and packing.contacts is not None:
            beside[contacts_file(path)] = contacts_csv(packing)
        is_numbered = left.no_step and packing.step is None and names_a_step(path)
        if left.frame or is_numbered or contacts_file(path) in beside:
            beside[frame_file(path)] = frame_csv(packing, with_contacts=left.contacts)
        if left.columns:
            beside[columns_file(path)] = columns_csv(packing, _columns(packing, left.columns))
        behind = _left_behind(path, set(beside))
        is_shared = _is_shared(path, packing, beside, behind)
        for file, data in beside.items():
            files.enter_context(whole_file(file)).write_bytes(data)
    for file in () if is_shared else behind:
        with suppress(OSError):
            file.unlink()
    notes = list(left.notes)
    if packing.wall_forces is not None:
        notes.append("the forces of contacts with walls are left out: no format has them")
    for note in notes:
        warnings.warn(f"{path.name}: {note}", ScanfabNote, stacklevel=3)


def _columns(packing: Packing, names: Iterable[str]) -> dict[str, Any]:
    """Columns by the names that writers give them, split into single ones."""
    own, _ = own_columns(packing)
    split = more_columns(packing)
    parts = {name: parts_of(name, values) for name, values in own.items()}
    return {part: split[part] for name in names for part in parts.get(name, [name])}


def _is_shared(
    path: Path, packing: Packing, beside: dict[Path, bytes], behind: Iterable[Path]
) -> bool:
    """
    Whether another file of this name lies there, to which what lies beside belongs as well.

    Raises
    ------
    SettingsError
        If that is of another packing: it would be lost, or taken for this one's.
    """
    stem = Path(bare_name(path)).stem
    there = [*filter(Path.is_file, beside), *behind]
    others = (path.with_name(f"{stem}{ending}") for ending in _grain_endings())
    other = next((one for one in others if there and one != path and one.is_file()), None)
    if other is None:
        return False
    own = {frame_file(path): frame_csv(packing)}
    if packing.contacts is not None:
        own[contacts_file(path)] = contacts_csv(packing)
    if columns_file(path) in there:
        own[columns_file(path)] = _same_columns(packing, columns_file(path))
    own |= beside
    lost = sorted(file.name for file in there if file.read_bytes() != own.get(file))
    if lost:
        raise SettingsError(
            f"{path}: {other.name} of the same name lies there, whose {' and '.join(lost)} would "
            f"be lost or taken for those of {path.name}: choose another name or folder"
        )
    return True


def _same_columns(packing: Packing, file: Path) -> bytes:
    """The packing's columns of the names that a file has; nothing if it lacks one of them."""
    names = next(csv.reader(file.read_text("utf-8", "replace").splitlines()[:1]), [])[1:]
    with suppress(KeyError):
        return columns_csv(packing, _columns(packing, names))
    return b""


@cache
def _grain_endings() -> list[str]:
    """Of files that may hold grains, packed or not."""
    formats = [*installed_writers().values(), *installed_readers().values()]
    endings = {ending for one in formats for ending in one.plugin.extensions}
    return sorted(ending + packed for ending in endings for packed in ("", *COMPRESSED_SUFFIXES))


def _left_behind(path: Path, written: set[Path]) -> list[Path]:
    """What an earlier packing of this name left beside it, and would be taken for this one's."""
    kinds = {
        contacts_file(path): is_contacts_file,
        frame_file(path): is_frame_file,
        columns_file(path): is_columns_file,
    }
    return [
        file
        for file, is_ours in kinds.items()
        if file not in written and file.is_file() and is_ours(file)
    ]
