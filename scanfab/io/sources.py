"""From folders and files, as users name them, to series of frames."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.base.option import refuse_unknown, takes_options, unusable
from scanfab.io.choice import (
    choose_grains,
    contacts_beside,
    damaged_contacts,
    named_contacts,
    note_below,
    note_skipped,
    without_tables,
)
from scanfab.io.families import (
    PathLike,
    expanded,
    files_around,
    files_of,
    named_once,
    sort_into_families,
)
from scanfab.io.files import unpacking_up_to
from scanfab.io.formats.yade_cells import is_cell_file, refuse_as_numbers
from scanfab.io.frame_csv import FrameFile
from scanfab.io.options import READING_OPTIONS, take_reading
from scanfab.io.reader import ReadOptions
from scanfab.io.series import ContactsFrom, Series
from scanfab.packing.packing import Packing

READING = tuple(one.name for one in READING_OPTIONS)
"""The options of :func:`read_series`, by which commands and manifests know them too."""


def read(path: PathLike, *, frame: int = 0, **options: Any) -> Packing:
    """
    Read one frame.

    Parameters
    ----------
    path : path
        A particle file; its contact file beside it is read too, as by :func:`read_series`.
    frame : int, optional
        Which snapshot, if the file holds several; negative from the end.
    **options
        See :func:`read_series`.

    Returns
    -------
    Packing

    Raises
    ------
    ScanfabError
        If the file cannot be read, or has no such frame.

    Examples
    --------
    >>> import scanfab
    >>> packing = scanfab.read(
    ...     "sample_data/yade_triaxial/triaxial-spheres-00000000.vtk.gz",
    ...     contacts="sample_data/yade_triaxial/triaxial-intrs-00000000.vtk.gz",
    ... )
    >>> len(packing)
    1800
    """
    refuse_unknown("read", options, [*READING, "frame"])
    return read_series(path, **options)[frame].read()


@takes_options(READING_OPTIONS)
def read_series(
    source: PathLike | Sequence[PathLike],
    *,
    format: str | None = None,
    contacts: str | PathLike = "auto",
    columns: dict[str, str] | None = None,
    contact_columns: str | None = None,
    skip: int = 0,
    radius: float | None = None,
    cell: tuple[float, ...] | PathLike | None = None,
    periodic: str | None = None,
    bodies: str | None = None,
    dim: str | int = "auto",
    max_unpacked: float | None = None,
) -> Series:
    """
    Open a series of frames: a folder, a file, or several files.

    Parameters
    ----------
    source : path or sequence of paths
        A folder with one series, or its files; globs too. A file that is named twice is read once,
        with a warning. Contact files beside single grain files are taken if their names say by a
        step, or by how they begin, that they are theirs.
    format : str, optional
        Name of the reader; by content if not given.
    contacts : str or path, optional
        ``auto``: from contact files if there are any, else by geometry; ``file``; ``geometric``; or
        a file, folder or glob, matched by step.
    columns : dict, optional
        Standard names to the file's own, such as ``{"radius": "c_rad"}``; of tables without names
        their numbers from 1, such as ``{"x": 1, "y": 2, "z": 3, "diameter": 4}``.
    contact_columns : str, optional
        Keywords of LIGGGHTS' ``compute pair/gran/local``, or LAMMPS' columns by their meaning:
        ``"id1=c_ids[1],id2=c_ids[2]"``, which serves tables too.
    skip : int, optional
        Lines before the table, of tables of text.
    radius : float, optional
        Radius for dumps without one, dump's length unit.
    cell : tuple of float or path, optional
        LX LY LZ or LX LY LZ XY XZ YZ, for formats that do not carry it; or a CSV file with the cell
        of each frame: columns ``step`` or ``frame``, ``lx ly lz``, and ``xy xz yz`` if tilted.
    periodic : str, optional
        Letters out of xyz.
    bodies : str, optional
        Column that says which clump a sphere belongs to: whole numbers, negative for a sphere that
        is a grain of its own. By default ``id_multisphere``, ``clumpId``, ``clump_id`` or
        ``clump``, if there is one; ``id`` makes each sphere a grain.
    dim : {"auto", 2, 3}, optional
        2: discs, whose centres share one coordinate. ``auto``: 2 if those of the first frame that
        has any do so, at least ten, and share no second one; with a note. One for all frames.
    max_unpacked : float, optional
        How many times its compressed size a file may grow to, 1000 by default. If it is given,
        lines of text may also be longer than 16 MiB.

    Returns
    -------
    Series

    Raises
    ------
    UnknownFormatError
        If no reader knows the files.
    ReadError
        If there is no series, or more than one.
    SettingsError
        If an option has a value that cannot be used.
    TypeError
        If there is no such option; names the nearest that there is.

    Examples
    --------
    >>> import scanfab
    >>> folder = "sample_data/liggghts_periodic"
    >>> series = scanfab.read_series([f"{folder}/dump_{step}.txt.gz" for step in (60000, 30000)])
    >>> [frame.read().step for frame in series]
    [30000, 60000]
    """
    arguments = locals()
    reading = {name: arguments[name] for name in READING}
    checked = take_reading(dict(reading))
    named_cell = checked["cell"]
    one_cell = named_cell if isinstance(named_cell, tuple) else None
    cells = None if named_cell is None or one_cell is not None else _cell_file(named_cell)
    options = ReadOptions(
        checked["columns"] or {},
        contact_columns,
        checked["radius"],
        one_cell,
        periodic,
        bodies,
        checked["skip"],
        checked["max_unpacked"],
    )
    with unpacking_up_to(options.max_unpacked):
        return _series(_given(source), contacts, options, cells, reading, checked["dim"])


def open_sources(sources: Sequence[PathLike], **options: Any) -> list[Series]:
    """
    The series of a command line: one for each folder, and one for all single files together.

    Parameters
    ----------
    sources : sequence of paths
        Folders, files and globs; a source that is named twice is read once, with a warning.
    **options
        See :func:`read_series`.
    """
    groups: list[list[PathLike]] = []
    files: list[PathLike] = []
    for source in named_once(sources):
        if Path(source).is_dir():
            groups.append([source])
        else:
            if not files:
                groups.append(files)
            files.append(source)
    return [read_series(group, **options) for group in groups]


def _given(source: PathLike | Sequence[PathLike]) -> list[PathLike]:
    """What is named, one by one."""
    one = isinstance(source, str | os.PathLike) or not isinstance(source, Iterable)
    given: list[Any] = [source] if one else list(source)  # type: ignore[arg-type]
    if not given or not all(isinstance(path, str | os.PathLike) for path in given):
        raise unusable("source", "the path of a folder or file, or several of files", source)
    return given


def _cell_file(path: PathLike) -> FrameFile:
    """The cells of a CSV file."""
    if is_cell_file(Path(path)):
        raise refuse_as_numbers(Path(path))
    try:
        return FrameFile(Path(path), ["lx", "ly", "lz"], ["xy", "xz", "yz"], positive=3)
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {os.strerror(error.errno or 0)}") from None


def _series(
    given: Sequence[PathLike],
    contacts: str | PathLike,
    options: ReadOptions,
    cells: FrameFile | None,
    reading: dict[str, Any],
    dim: str | int,
) -> Series:
    """The series of what is named: its files sorted out."""
    format, paths = reading["format"], [Path(one) for one in named_once(given)]
    name = as_text(os.fspath(given[0]) if len(paths) == len(given) == 1 else _common_folder(paths))
    are_files = not any(path.is_dir() for path in paths)
    files = [file for path in paths for file in files_of(path)]
    around = files_around(files) if are_files else []
    families = sort_into_families(files, format, options, around)
    if format is None:
        families = without_tables(families, paths)
    grains = choose_grains(paths, families, options).check()
    own = [family for family in families if family.kind == "contacts"]
    note_skipped([one for one in families if one not in (grains, *own)])
    if paths[0].is_dir() and len(paths) == len(grains.files) == 1:
        note_below(paths[0], grains)
    origin: ContactsFrom = "path" if contacts == "file" else "auto"
    lists_contacts = getattr(grains.reader, "lists_contacts", False)
    if contacts == "geometric":
        own, origin = [], "geometric"
    elif contacts not in ("auto", "file"):
        own, origin = named_contacts(contacts, format, options), "path"
    elif not own and are_files:
        families, own = contacts_beside(grains, format, options, told=True)
        origin = "beside" if contacts == "auto" else "path"
    if not own and contacts == "file":
        if not lists_contacts:
            raise ReadError(
                f'{name}: `contacts="file"` was asked for, but there is no contact file'
            )
        origin = "grains"
    elif not own and contacts == "auto":
        own, origin = damaged_contacts(grains, families), "beside"
        if options.contact_columns and not own and not lists_contacts:
            warnings.warn(
                f"{name}: `contact_columns` are named, but there is no file of contacts with such "
                f"columns: contacts are found by geometry",
                ScanfabWarning,
                stacklevel=3,
            )
    whole = tuple(family.check() for family in own)
    sources = tuple(os.fspath(path) for one in given for path in expanded(one))
    return Series(name, grains, whole, origin, options, cells, sources, reading, dim=dim)


def as_text(name: str) -> str:
    """A name as a table can hold it: those of files need be no text."""
    return name.encode("utf-8", "backslashreplace").decode()


def _common_folder(paths: list[Path]) -> str:
    folders = [str(path.parent) for path in paths]
    if len({path.is_absolute() for path in paths}) > 1:
        folders = [os.path.abspath(folder) for folder in folders]
    return os.path.commonpath(folders) or "."
