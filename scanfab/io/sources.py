"""Make series of frames from the folders and files that users name."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, UnknownFormatError, note, warn
from scanfab.base.option import refuse_unknown, takes_options, unusable
from scanfab.io import families as sorting
from scanfab.io.families import Family, Numbered, PathLike, named_once, some
from scanfab.io.files import first_bytes, unpacking_up_to
from scanfab.io.formats.own import companion_file
from scanfab.io.layout import FrameFile
from scanfab.io.reader import READING, READING_OPTIONS, FileKind, ReadOptions, why_no_table
from scanfab.io.series import ContactsFrom, Series
from scanfab.packing.packing import Packing

# words near the beginning of every fabric table, in any format
TABLE_WORDS = (b"source", b"frame", b"variant", b"alpha_vs")
GRAINS: tuple[FileKind, ...] = ("grains", "index", "start", "points")
"""Kinds of files that may be frames, best first; a source uses only the first kind it has."""
HOLDS: dict[FileKind, str] = {
    "grains": "grains",
    "index": "grains",
    "start": "grains that a simulation starts from",
    "points": "points without a radius (give it with `radius`)",
    "contacts": "contacts",
    "cell": "a cell",
    "other": "neither grains nor contacts",
}


def read(path: PathLike, *, frame: int = 0, **options: Any) -> Packing:
    """
    Read one frame.

    Parameters
    ----------
    path : path
        A particle file; a contact file in its folder is read too, as by :func:`read_series`.
    frame : int, optional
        Number of the frame from 0, if the file holds several; negative numbers count from the end.
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
    columns: Mapping[str, str | int] | str | None = None,
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
        A folder with one series, or its files, or globs. A file that is named twice is read once,
        with a warning. Contact files in the folders of single grain files are read if the step or
        the first words of their names match.
    {options}

    Returns
    -------
    Series

    Raises
    ------
    UnknownFormatError
        If no reader knows the files.
    ReadError
        If there is no series, or more than one.
    SettingsError, TypeError
        If an option has an invalid value, or if there is no such option.

    Examples
    --------
    >>> import scanfab
    >>> folder = "sample_data/liggghts_periodic"
    >>> series = scanfab.read_series([f"{folder}/dump_{step}.txt.gz" for step in (60000, 30000)])
    >>> [frame.read().step for frame in series]
    [30000, 60000]
    """
    arguments = locals()
    return series_of(source, ReadOptions(**{name: arguments[name] for name in READING}))


def open_sources(sources: Sequence[PathLike], **options: Any) -> list[Series]:
    """Open the series of a command line: one for each folder, and one for all single files."""
    groups: dict[PathLike, list[PathLike]] = defaultdict(list)
    for source in named_once(sources):
        groups[source if Path(source).is_dir() else ""].append(source)
    return [read_series(group, **options) for group in groups.values()]


def series_of(source: Any, options: ReadOptions) -> Series:
    """Sort the files of a source, and make a series of their grains and contacts."""
    is_one = isinstance(source, str | os.PathLike) or not isinstance(source, Iterable)
    given = [source] if is_one else list(source)
    if not given or not all(isinstance(path, str | os.PathLike) for path in given):
        raise unusable("source", "the path of a folder or file, or files", source)
    with unpacking_up_to(options.max_unpacked):
        return _series(named_once(given), options)


def _series(given: Sequence[PathLike], options: ReadOptions) -> Series:
    """The series of sources that are paths."""
    paths = [Path(path) for path in given]
    files = [file for path in paths for file in sorting.files_of(path)]
    around: list[Path] = []
    if not any(path.is_dir() for path in paths):
        # the contacts of single files may lie beside them
        for folder in dict.fromkeys(file.parent for file in files):
            with suppress(OSError):
                around += sorting.files_in(folder)
    groups = sorting.group_by_name(files, around)
    families = sorting.sort_into_families(files, options, groups)
    if options.format is None:
        families = sorting.without_tables(families, paths)
    grains = _choose_grains(paths, families, options)
    taken = set(grains.files.values())
    others = [one for one in families if taken.isdisjoint(one.files.values())]
    _tell_skipped([one for one in others if one.kind != "contacts"])
    chosen, origin = _choose_contacts(grains, families, groups if around else [], options)
    for family in (grains, *chosen):
        if family.clash is not None:
            raise ReadError(family.clash)
    sources = tuple(os.fspath(path) for path in given)
    name = sources[0]
    if len(sources) > 1:
        are_alike = len({path.is_absolute() for path in paths}) == 1
        folders = [str(path.parent if are_alike else path.parent.absolute()) for path in paths]
        name = os.path.commonpath(folders) or "."
    cells = None
    if isinstance(options.cell, str | os.PathLike):
        cells = FrameFile(Path(options.cell), ["lx", "ly", "lz"], ["xy", "xz", "yz"], positive=3)
    return Series(as_text(name), grains, tuple(chosen), origin, options, cells, sources)


def _choose_grains(
    paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> Family:
    """The only family of grain files; ReadError if there is none, or more than one."""
    where = ", ".join(map(str, paths[:3])) + (", ..." if len(paths) > 3 else "")
    for kind in GRAINS if options.radius is None else ("points", *GRAINS):
        grains = [family for family in families if family.kind == kind]
        if len(grains) == 1:
            return grains[0]
        is_named = not any(path.is_dir() for path in paths)
        if grains and is_named and len({f.reader and f.reader.name for f in grains}) == 1:
            return sorting.in_one_series(grains)
        if grains:
            ends = dict.fromkeys(GRAINS, "") | {"points": "; it has no radius: `radius=L`"}
            candidates = [family for kind in GRAINS for family in families if family.kind == kind]
            listed = "".join(f"\n  {family.pattern}{ends[family.kind]}" for family in candidates)
            raise ReadError(f"{where}: several series of grains: choose one of{listed}")
    raise _no_grains(where, paths, families, options)


def _no_grains(
    where: str, paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> ReadError:
    """The error for a source without grains."""
    problem = next((family.problem for family in families if family.problem), None)
    if problem is not None:
        return ReadError(problem)
    readable = [family for family in families if family.reader is not None]
    if readable:
        held = ", ".join(f"{HOLDS[f.kind]} ({Path(f.pattern).name})" for f in readable[:5])
        advice = "name the file of the grains, or leave out `format`"
        text = f"no grains: expected points with a radius, found {held}: {advice}"
        return ReadError(f"{where}: {text}")
    folders = [path for path in paths if path.is_dir()]
    below = [f"{sub}" for path in folders for sub in sorted(path.glob("[!.]*")) if sub.is_dir()]
    if below:
        return ReadError(f"{where}: the folder holds no dumps, only folders: name {some(below)}")
    if not families:
        return ReadError(f"{where}: the folder holds no files")
    for table in set(paths).difference(folders):
        with suppress(OSError, ReadError):
            data = table.read_bytes() if table.suffix == ".parquet" else first_bytes(table, 1 << 14)
            if all(word in data for word in TABLE_WORDS):
                advice = "scanfab compare and scanfab report read it"
                return ReadError(f"{table}: this is a fabric table, not a dump: {advice}")
    reason = why_no_table(paths[0], options) if len(paths) == 1 and not folders else ""
    return UnknownFormatError(
        f"{where}: no reader knows this format; the command scanfab formats lists the known ones"
        + (f"; it cannot be read as a table either: {reason}" if reason else "")
    )


def _tell_skipped(families: Sequence[Family]) -> None:
    """Write one note about skipped files, and a warning about damaged files."""
    skipped: dict[str, list[str]] = defaultdict(list)
    damaged: dict[str, list[str]] = defaultdict(list)
    for family in families:
        name = Path(family.pattern).name
        if family.problem is not None:
            damaged[family.problem.removeprefix(f"{family.largest}").lstrip(":, ")].append(name)
        elif family.kind != "cell":
            held = "results or other tables" if family.is_table else HOLDS[family.kind]
            skipped[held].append(name)
    parts = []
    for held, names in skipped.items():
        parts.append(f"{some(names)}: {'it holds' if len(names) == 1 else 'they hold'} {held}")
    if parts:
        note(f"skipped {'; '.join(parts)}")
    for problem, names in damaged.items():
        warn(f"skipped {some(names)}: {problem}")


def _choose_contacts(
    grains: Family,
    families: Sequence[Family],
    around: Sequence[Numbered],
    options: ReadOptions,
) -> tuple[Sequence[Family], ContactsFrom]:
    """The families of contact files, and how they were chosen."""
    contacts = options.contacts
    if contacts == "geometric":
        return [], "geometric"
    if contacts not in ("auto", "file"):
        return _named_contacts(options), "path"
    own = [family for family in families if family.kind == "contacts"]
    has_own = any(companion_file(path, "contacts").is_file() for path in grains.files.values())
    is_beside = bool(around) and not own and not has_own
    if is_beside:
        families, own = sorting.contacts_beside(grains, around, options)
    if contacts == "file":
        return own, "path" if own else "grains"
    if own:
        return own, "beside" if is_beside else "auto"
    # an unreadable file becomes an error if its name and number fit the contact file of the grains
    damaged = [
        replace(one, kind="contacts", files=dict.fromkeys(grains.files, one.largest), clash=None)
        for one in families
        if one.problem and len(one.files) == len(grains.files) and sorting.are_tied(grains, one)
    ]
    if options.contact_columns and not (damaged or has_own):
        warn("`contact_columns` is given, but no contact file has these columns")
    return damaged, "beside"


def _named_contacts(options: ReadOptions) -> list[Family]:
    """The families of contact files that a file, folder or glob names."""
    named = sorting.expanded(options.contacts)
    files = [file for path in named for file in sorting.files_of(Path(path))]
    families = sorting.sort_into_families(files, options, sorting.group_by_name(files))
    contact_families = [family for family in families if family.kind == "contacts"]
    if not contact_families:
        problem = next((family.problem for family in families if family.problem), None)
        held = " and ".join(sorted({HOLDS[family.kind] for family in families})) or "no files"
        lack = f"{options.contacts}: expected contacts, found {held}"
        if any(family.kind == "other" for family in families):
            lack += ': name columns by `contact_columns="id1=1,id2=2"`, whose numbers count from 1'
        raise ReadError(problem or lack)
    return contact_families


def as_text(name: str) -> str:
    """A file name as valid text for a table; bytes that are not UTF-8 are escaped."""
    return name.encode("utf-8", "backslashreplace").decode()
