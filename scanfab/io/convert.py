"""convert(): frames of a series, or packings from anywhere, as files of another format."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from itertools import islice
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabNote, SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.option import refuse_unknown
from scanfab.io import beside
from scanfab.io.families import names_a_step
from scanfab.io.files import COMPRESSED_SUFFIXES, bare_name
from scanfab.io.options import parse_frames
from scanfab.io.registry import installed_readers
from scanfab.io.series import Series
from scanfab.io.sources import READING, read_series
from scanfab.io.writer import Writer, installed_writers, writer_for, writer_named
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

    What a format has no place for goes into companion files, which whoever reads the file finds by
    itself: contacts into ``STEM.contacts.csv``, cell, step and time into ``STEM.frame.csv``,
    columns into ``STEM.columns.csv``. A note says what is lost nevertheless.

    Parameters
    ----------
    source : path, Series, Packing or iterable of Packing
        What to write.
    out : path
        A file for one frame; a folder, or a name with ``{step}``, for a file each. For a frame
        without a step its number is taken.
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
        If there is no such format, several frames are to go into one file, two have one step, or a
        companion file that belongs to another file of the name would be changed.
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
    out = Path(out)
    is_folder = out.is_dir() or str(out).endswith(os.sep) or (to is not None and not out.suffix)
    is_folder = is_folder and STEP not in out.name
    if is_folder and to is None:
        names = ", ".join(installed_writers())
        raise SettingsError(f"{out}: a folder has no format: name it with `to`, one of {names}")
    writer = writer_for(out) if to is None else writer_named(to)
    check_folder(out / "frame" if out.is_dir() else out)
    refuse_unknown("convert", reading, [*READING, "to", "frames"])
    found = _packings(source, parse_frames(frames), reading)
    written: dict[Path, int] = {}
    if not is_folder and STEP not in out.name:
        # there must be no second frame, which is known before the file is touched
        first = list(islice(found, 2))
        if len(first) > 1:
            raise SettingsError(
                f"{out}: there are several frames for one file: name a folder, or a file with "
                f"{STEP} in its name, or choose one with `frames`"
            )
        found = iter(first)
    for number, packing in found:
        path, step = out, str(number if packing.step is None else packing.step)
        if is_folder:
            out.mkdir(exist_ok=True)
            path = out / f"frame_{step}{writer.extensions[0]}"
        elif STEP in out.name:
            path = out.with_name(out.name.replace(STEP, step))
        if path in written:
            raise SettingsError(
                f"{path}: the frames {written[path]} and {number} have the same step: choose with "
                f"`frames`"
            )
        save_packing(packing, path, writer)
        written[path] = number
        after()
    if not written:
        raise SettingsError("`frames` chooses none: there is nothing to write")
    return list(written)


def _packings(source: Any, chosen: slice, reading: dict[str, Any]) -> Iterator[tuple[int, Packing]]:
    """The chosen frames with their numbers."""
    if isinstance(source, str | os.PathLike):
        source = read_series(source, **reading)
    elif reading:
        raise SettingsError(f"`{next(iter(reading))}` is for files that are yet to be read")
    if isinstance(source, Series):
        _tell_left_out(source)
        return ((frame.number, frame.read()) for frame in source[chosen])
    packings = [source] if isinstance(source, Packing) else source
    if not isinstance(packings, Iterable):
        raise SettingsError(f"source: expected a path, a Series or packings, found {source!r}")
    bounds = (chosen.start, chosen.stop, chosen.step)
    if any(bound is not None and bound < 0 for bound in bounds):
        # counted from the end, so that all must be known first
        return iter(list(_numbered(packings))[chosen])
    return islice(_numbered(packings), *bounds)


def _numbered(packings: Iterable[Any]) -> Iterator[tuple[int, Packing]]:
    for number, packing in enumerate(packings):
        if not isinstance(packing, Packing):
            raise SettingsError(f"source: expected packings, found {packing!r} among them")
        yield number, packing


def _tell_left_out(series: Series) -> None:
    """A note for each kind of contact files on the columns that a packing has no place for."""
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


def save_packing(packing: Packing, path: Path, writer: Writer | None = None) -> None:
    """
    One packing into one file, with its companion files; all files are complete or untouched.

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
    there = beside.companions_there(path)
    other = _other_grains(path) if there else None
    if other is not None:
        names = " and ".join(file.name for file in there)
        raise SettingsError(
            f"{path}: {names} may belong to {other.name}, which has the same name: choose another "
            f"name or folder"
        )
    with ExitStack() as files:
        # the first file to be opened is the last to take its place: with the grains all is there
        part = files.enter_context(whole_file(path))
        left = writer.write(packing, part)
        made: dict[Path, bytes] = {}
        if left.contacts and packing.contacts is not None:
            made[beside.contacts_file(path)] = beside.contacts_csv(packing)
        is_numbered = left.no_step and packing.step is None and names_a_step(path)
        if left.frame or is_numbered or made:
            made[beside.frame_file(path)] = beside.frame_csv(packing)
        if left.columns:
            made[beside.columns_file(path)] = beside.columns_csv(packing, left.columns)
        for file, data in made.items():
            files.enter_context(whole_file(file)).write_bytes(data)
    for file in there:
        if file not in made:
            # an earlier packing of this name has left it
            with suppress(OSError):
                file.unlink()
    notes = list(left.notes)
    if packing.wall_forces is not None:
        notes.append("the forces of contacts with walls are left out: no format has them")
    for note in notes:
        warnings.warn(f"{path.name}: {note}", ScanfabNote, stacklevel=3)


def _other_grains(path: Path) -> Path | None:
    """Another file with the same name and the ending of a format, to which companions belong."""
    formats = [*installed_writers().values(), *installed_readers().values()]
    endings = {ending for one in formats for ending in one.plugin.extensions}
    packed = sorted(ending + more for ending in endings for more in ("", *COMPRESSED_SUFFIXES))
    others = (path.with_name(f"{Path(bare_name(path)).stem}{ending}") for ending in packed)
    return next((one for one in others if one != path and one.is_file()), None)
