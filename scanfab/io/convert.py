"""convert(): frames of a series, or packings from anywhere, as files of another format."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from glob import escape
from itertools import islice
from pathlib import Path
from typing import Any

from scanfab.base.errors import SettingsError, note
from scanfab.base.files import check_folder, refuse_inputs, whole_file
from scanfab.base.option import refuse_unknown
from scanfab.io.families import PathLike
from scanfab.io.files import bare_name
from scanfab.io.formats.own import HEADS, companion_kind, companion_there, companions_of
from scanfab.io.reader import READING, parse_frames
from scanfab.io.series import Series, counts_from_end
from scanfab.io.sources import read_series
from scanfab.io.writer import Writer, writer_for, writer_named
from scanfab.packing.packing import Packing

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
    Write frames in another format without losing data.

    Data for which the format has no place go into companion files, which scanfab reads with the
    file: contacts into ``STEM.contacts.csv``, cell, step and time into ``STEM.frame.csv``, columns
    into ``STEM.columns.csv``. A note says what is lost nevertheless.

    Parameters
    ----------
    source : path, Series, Packing or iterable of Packing
        The frames to write.
    out : path
        A file for one frame. For several frames a folder, or a file name with ``{step}``, which
        becomes the step of the frame, or its number if it has no step.
    to : str, optional
        Name of the format; by default it follows from the suffix of ``out``. Needed for a folder.
    frames : str, int or slice, optional
        The frames to write, as a Python slice; all by default.
    after : callable, optional
        Called after each frame that was written.
    **reading
        Options for reading a path; see :func:`scanfab.read_series`.

    Returns
    -------
    list of Path
        The grain files, in the order of the frames.

    Raises
    ------
    SettingsError
        If there is no such format, ``out`` is one file for several frames, two frames have the same
        step, or a file of the source or a companion file of another grain file would be replaced.
    ReadError, PackingError
        If a frame cannot be read. Each file is complete or untouched.
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
    is_new = to is not None and not out.suffix and not out.exists()
    is_folder = STEP not in out.name and (out.is_dir() or is_new)
    if is_folder and to is None:
        raise SettingsError(f"{out}: a folder has no format: name one as `to`")
    writer = writer_for(out) if to is None else writer_named(to)
    pattern = out / f"frame_{STEP}{writer.extensions[0]}" if is_folder else out
    check_folder(pattern if out.is_dir() else out)
    refuse_unknown("convert", reading, [*READING, "to", "frames"])
    if isinstance(source, str | os.PathLike):
        source = read_series(source, **reading)
    elif reading:
        raise SettingsError(f"`{next(iter(reading))}` applies to files alone, not to packings")
    chosen = parse_frames("frames", frames)
    inputs = list(source.files()) if isinstance(source, Series) else []
    packings = _packings(source, chosen)
    if STEP not in pattern.name:
        # look for a second frame before the file is written
        first = list(islice(packings, 2))
        if len(first) > 1:
            where = f"a folder, or a file with {STEP} in its name, or one frame by `frames`"
            raise SettingsError(f"{out}: there are several frames for one file: name {where}")
        packings = iter(first)
    written: dict[Path, int] = {}
    for number, packing in packings:
        if not isinstance(packing, Packing):
            raise SettingsError(f"source: expected packings, found {packing!r} among them")
        step = number if packing.step is None else packing.step
        path = pattern.with_name(pattern.name.replace(STEP, str(step)))
        if path in written:
            both = f"{written[path]} and {number}"
            raise SettingsError(f"{path}: the frames {both} have the same step: choose by `frames`")
        refuse_inputs([path, *(companion_there(path, kind) for kind in HEADS)], inputs)
        path.parent.mkdir(exist_ok=True)
        save_packing(packing, path, writer)
        written[path] = number
        after()
    if not written:
        raise SettingsError("`frames` chooses none: there is nothing to write")
    return list(written)


def _packings(source: Any, chosen: slice) -> Iterator[tuple[int, Packing]]:
    """The chosen packings with the numbers of their frames."""
    if isinstance(source, Series):
        for family in source.contacts:
            if companion_kind(family.largest) is None:
                note(f"{family.pattern}: only pairs, images and forces of the contacts are written")
        return ((frame.number, frame.read()) for frame in source[chosen])
    packings = [source] if isinstance(source, Packing) else source
    if not isinstance(packings, Iterable):
        raise SettingsError(f"source: expected a path, a Series or packings, found {source!r}")
    if counts_from_end(chosen):
        return iter(list(enumerate(packings))[chosen])
    return islice(enumerate(packings), chosen.start, chosen.stop, chosen.step)


def save_packing(packing: Packing, path: Path, writer: Writer) -> None:
    """
    Write one packing to a grain file and its companion files; each is complete or untouched.
    """
    companions = [file for kind in HEADS if (file := companion_there(path, kind))]
    if companions and not path.exists():
        stem = escape(Path(bare_name(path)).stem)
        if others := {*path.parent.glob(f"{stem}.*")} - {*companions}:
            problem = f"{' and '.join(file.name for file in companions)} may belong to"
            advice = "choose another name, or remove them"
            raise SettingsError(f"{path}: {problem} {min(others).name}: {advice}")
    with ExitStack() as files:
        # the stack is unwound in reverse: the grain file appears last, after its companion files
        left = writer.write(packing, files.enter_context(whole_file(path)))
        made = companions_of(packing, path, left)
        for file, data in made.items():
            files.enter_context(whole_file(file)).write_bytes(data)
    for file in set(companions) - made.keys():
        # left over from an earlier packing of this name
        with suppress(OSError):
            file.unlink()
    for text in left.notes:
        note(f"{path.name}: {text}")
    if packing.wall_forces is not None:
        note(f"{path.name}: the forces of contacts with walls are left out: no format has them")
