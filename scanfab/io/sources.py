"""From folders and files, as users name them, to series of frames."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.option import refuse_unknown, takes_options, unusable
from scanfab.io.families import (
    Family,
    contacts_beside,
    set_tables_aside,
    sort_into_families,
)
from scanfab.io.files import unpacking_up_to
from scanfab.io.formats.yade_cells import is_cell_file, refuse_as_numbers
from scanfab.io.frame_csv import FrameFile
from scanfab.io.grain_files import (
    PathLike,
    choose_grains,
    expanded,
    files_of,
    named_once,
    series_below,
)
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
        A folder with one series, or its files; globs too. What is named twice counts once, with a
        warning. Contact files that lie beside single
        grain files are taken as if the folder had been named, if they are clearly theirs.
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
        Times its size that a packed file may unpack to, 1000 by default. Given, lines of text may
        also be longer than 16 MiB.

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
    families = sort_into_families(
        [file for path in paths for file in files_of(path)], format, options
    )
    if format is None:
        families = set_tables_aside(families, paths)
    grains = choose_grains(paths, families, options).check()
    name = as_text(os.fspath(given[0]) if len(paths) == len(given) == 1 else _common_folder(paths))
    sources = tuple(os.fspath(path) for one in given for path in expanded(one))
    own = [family for family in families if family.kind == "contacts"]
    _note_passed_over(families, [grains, *own])
    _note_below(paths, grains)

    def series(files: Sequence[Family], contacts_from: ContactsFrom) -> Series:
        whole = tuple(family.check() for family in files)
        return Series(name, grains, whole, contacts_from, options, cells, sources, reading, dim=dim)

    if contacts == "geometric":
        return series((), "geometric")
    if contacts not in ("auto", "file"):
        return series(_named_contacts(contacts, format, options), "path")
    if not own and not any(path.is_dir() for path in paths):
        own, beside = _contacts_beside(grains, format, options), True
    else:
        beside = False
    if contacts == "file" and not own:
        if not getattr(grains.reader, "lists_contacts", False):
            raise ReadError(
                f'{name}: `contacts="file"` was asked for, but there is no contact file'
            )
        return series((), "grains")
    if not own and options.contact_columns and not getattr(grains.reader, "lists_contacts", False):
        warnings.warn(
            f"{name}: `contact_columns` are named, but there is no file of contacts with such "
            f"columns: contacts are found by geometry",
            ScanfabWarning,
            stacklevel=3,
        )
    return series(own, "path" if contacts == "file" else "beside" if beside else "auto")


def _given(source: PathLike | Sequence[PathLike]) -> list[PathLike]:
    """What is named, one by one."""
    one = isinstance(source, str | os.PathLike) or not isinstance(source, Iterable)
    given: list[Any] = [source] if one else list(source)  # type: ignore[arg-type]
    if not given or not all(isinstance(path, str | os.PathLike) for path in given):
        raise unusable("source", "the path of a folder or file, or several of files", source)
    return given


def open_sources(sources: Sequence[PathLike], **options: Any) -> list[Series]:
    """
    The series of a command line: one for each folder, and one for all single files together.

    Parameters
    ----------
    sources : sequence of paths
        Folders, files and globs; what is named twice counts once, with a warning.
    **options
        See :func:`read_series`.
    """
    groups: list[PathLike | list[PathLike]] = []
    files: list[PathLike] = []
    for source in named_once(sources):
        if Path(source).is_dir():
            groups.append(source)
        else:
            if not files:
                groups.append(files)
            files.append(source)
    return [
        read_series(group[0] if isinstance(group, list) and len(group) == 1 else group, **options)
        for group in groups
    ]


def _cell_file(path: PathLike) -> FrameFile:
    """The cells of a CSV file."""
    if is_cell_file(Path(path)):
        raise refuse_as_numbers(Path(path))
    try:
        return FrameFile(Path(path), ["lx", "ly", "lz"], ["xy", "xz", "yz"], positive=3)
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {os.strerror(error.errno or 0)}") from None


def _contacts_beside(grains: Family, format: str | None, options: ReadOptions) -> list[Family]:
    """
    The contact files in the folder of single grain files, as if the folder had been named.

    Told by a note; also where it is not clear whose contacts they are, and they are left alone.
    """
    own, doubtful = contacts_beside(grains, format, options)
    if len(own) == 1:
        _note(f"contacts are read from {_patterns(own)}, beside the grains")
    elif own:
        _note(f"files of contacts beside the grains, which are read with them: {_patterns(own)}")
    elif doubtful:
        _note(
            f"{_patterns(doubtful)}: contacts beside the grains, but it is not clear whose they "
            f"are: name them with `contacts`, or they are left alone"
        )
    return own


def _patterns(families: Sequence[Family]) -> str:
    return ", ".join(family.pattern for family in families)


def _note(text: str) -> None:
    warnings.warn(text, ScanfabNote, stacklevel=5)


def _note_passed_over(families: Sequence[Family], used: Sequence[Family]) -> None:
    """One note for the files that do not enter, and a warning for each that is damaged."""
    unused = [
        one for one in families if one not in used and one.problem is None and one.kind != "cell"
    ]
    if unused:
        names = ", ".join(Path(one.pattern).name + _lack(one) for one in unused[:5])
        more = f" and {len(unused) - 5} more" if len(unused) > 5 else ""
        _note(f"passed over, neither grains nor contacts: {names}{more}")
    for family in families:
        if family.problem is not None:
            warnings.warn(f"passed over: {family.problem}", ScanfabWarning, stacklevel=4)


def _note_below(paths: Sequence[Path], grains: Family) -> None:
    """A folder with a single dump beside folders of them: these may have been meant."""
    if len(paths) != 1 or not paths[0].is_dir() or len(grains.files) > 1:
        return
    below = series_below(paths[0])
    if below:
        _note(f"{paths[0]}: {Path(grains.pattern).name} alone is read, but {below}")


def _lack(family: Family) -> str:
    if getattr(family.reader, "is_table", False):
        return " (a table beside dumps)"
    return " (no radius: `radius`)" if family.kind == "points" else ""


def _named_contacts(contacts: PathLike, format: str | None, options: ReadOptions) -> list[Family]:
    """Contact files from a file, a folder or a glob."""
    files = [file for one in expanded(contacts) for file in files_of(Path(one))]
    families = sort_into_families(files, format, options)
    found = [family for family in families if family.kind == "contacts"]
    if not found:
        problem = next((family.problem for family in families if family.problem), None)
        if problem is not None:
            raise ReadError(problem)
        kinds = {"grains": "grains", "points": "points without a radius", "cell": "a cell"}
        what = sorted({kinds.get(one.kind, "walls, or something else") for one in families})
        raise ReadError(f"{contacts}: expected contacts, found {' and '.join(what)}")
    return found


def as_text(name: str) -> str:
    """A name as a table can hold it: those of files need be no text."""
    return name.encode("utf-8", "backslashreplace").decode()


def _common_folder(paths: list[Path]) -> str:
    folders = [str(path.parent) for path in paths]
    if len({path.is_absolute() for path in paths}) > 1:
        folders = [os.path.abspath(folder) for folder in folders]
    return os.path.commonpath(folders) or "."
