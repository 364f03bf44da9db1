"""From folders and files, as users name them, to series of frames."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from scanfab.base.errors import ReadError, UnknownFormatError, note, warn
from scanfab.base.option import refuse_unknown, takes_options, unusable
from scanfab.io import families as sorting
from scanfab.io.families import Family, Numbered, PathLike, named_once, some
from scanfab.io.files import first_bytes, unpacking_up_to
from scanfab.io.layout import FrameFile
from scanfab.io.options import READING_OPTIONS, take_reading
from scanfab.io.reader import FileKind, ReadOptions, why_no_table
from scanfab.io.series import ContactsFrom, Series
from scanfab.packing.packing import Packing

READING = tuple(one.name for one in READING_OPTIONS)
"""The options of :func:`read_series`, by which commands and manifests know them too."""
# how a fabric table begins, in whatever format
TABLE_WORDS = (b"source", b"frame", b"variant", b"alpha_vs")
GRAINS: tuple[FileKind, ...] = ("grains", "index", "start", "points")
"""Kinds of files that may be frames; a kind counts only where there is none of the kinds before."""
HOLDS: dict[FileKind, str] = {
    "grains": "grains",
    "index": "grains",
    "start": "grains that a simulation starts from",
    "points": "points without a radius (give it by `radius`)",
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
        How many times its compressed size a file may grow to, 1000 by default.

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
        If an option has a value that cannot be used, or if there is no such option.

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
    told = take_reading(dict(reading))
    contacts, dim, frame_cell = told.pop("contacts"), told.pop("dim"), told["cell"]
    cells = None
    if isinstance(frame_cell, str | os.PathLike):
        cells = FrameFile(Path(frame_cell), ["lx", "ly", "lz"], ["xy", "xz", "yz"], positive=3)
    told |= {"columns": told["columns"] or {}, "cell": None if cells else frame_cell}
    options = ReadOptions(**told)
    if isinstance(source, str | os.PathLike) or not isinstance(source, Iterable):
        source = [source]
    given = list(source)
    if not given or not all(isinstance(path, str | os.PathLike) for path in given):
        expected = "the path of a folder or file, or several of files"
        raise unusable("source", expected, arguments["source"])
    with unpacking_up_to(options.max_unpacked):
        series = _series(named_once(given), contacts, options)
    return replace(series, cells=cells, reading=reading, dim=dim)


def open_sources(sources: Sequence[PathLike], **options: Any) -> list[Series]:
    """The series of a command line: one for each folder, and one for all single files together."""
    groups: dict[PathLike, list[PathLike]] = defaultdict(list)
    for source in named_once(sources):
        groups[source if Path(source).is_dir() else ""].append(source)
    return [read_series(group, **options) for group in groups.values()]


def _series(given: Sequence[PathLike], contacts: PathLike, options: ReadOptions) -> Series:
    """The series of what is named: its files sorted out."""
    paths = [Path(one) for one in given]
    files = [file for path in paths for file in sorting.files_of(path)]
    around = [] if any(path.is_dir() for path in paths) else sorting.files_around(files)
    groups = sorting.group_by_name(files, around)
    families = sorting.sort_into_families(files, options, groups)
    if options.format is None:
        families = sorting.without_tables(families, paths)
    grains = _choose_grains(paths, families, options)
    _tell_skipped([one for one in families if one is not grains and one.kind != "contacts"])
    chosen, origin = _choose_contacts(grains, families, groups if around else [], contacts, options)
    for family in (grains, *chosen):
        if family.clash is not None:
            raise ReadError(family.clash)
    sources = tuple(os.fspath(path) for path in given)
    name = sources[0]
    if len(sources) > 1:
        are_alike = len({path.is_absolute() for path in paths}) == 1
        folders = [str(path.parent if are_alike else path.parent.absolute()) for path in paths]
        name = os.path.commonpath(folders) or "."
    return Series(as_text(name), grains, tuple(chosen), origin, options, sources=sources)


def _choose_grains(
    paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> Family:
    """The one family of grain files among all; ReadError if there are none, or several."""
    where = ", ".join(map(str, paths[:3])) + (", ..." if len(paths) > 3 else "")
    for kind in GRAINS if options.radius is None else ("points", *GRAINS):
        grains = [family for family in families if family.kind == kind]
        if len(grains) == 1:
            return grains[0]
        if grains:
            ends = dict.fromkeys(GRAINS, "") | {"points": "; it has no radius: `radius=L`"}
            every = [one for kind in GRAINS for one in families if one.kind == kind]
            listed = "".join(f"\n  {one.pattern}{ends[one.kind]}" for one in every)
            raise ReadError(f"{where}: several series of grains: choose one of{listed}")
    raise _no_grains(where, paths, families, options)


def _no_grains(
    where: str, paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> ReadError:
    """The error for a source without grains."""
    problem = next((family.problem for family in families if family.problem), None)
    if problem is not None:
        return ReadError(problem)
    known = [one for one in families if one.reader is not None]
    if known:
        held = ", ".join(f"{HOLDS[one.kind]} ({Path(one.pattern).name})" for one in known[:5])
        return ReadError(f"{where}: no grains: expected points with a radius, found {held}")
    folders = [path for path in paths if path.is_dir()]
    below = [f"{one}" for path in folders for one in sorted(path.glob("[!.]*")) if one.is_dir()]
    if below:
        return ReadError(f"{where}: the folder holds no dumps, but folders: name {some(below)}")
    if not families:
        return ReadError(f"{where}: the folder holds no files")
    for table in set(paths).difference(folders):
        with suppress(OSError, ReadError):
            data = table.read_bytes() if table.suffix == ".parquet" else first_bytes(table, 1 << 14)
            if all(word in data for word in TABLE_WORDS):
                advice = "scanfab compare or scanfab report take it"
                return ReadError(f"{table}: this is a fabric table, not a dump: {advice}")
    reason = why_no_table(paths[0], options) if len(paths) == 1 and not folders else ""
    return UnknownFormatError(
        f"{where}: no reader knows the format; scanfab formats lists those that exist"
        + (f"; as a table it cannot be read: {reason}" if reason else "")
    )


def _tell_skipped(families: Sequence[Family]) -> None:
    """One note on the files that do not enter, and a warning on those that are damaged."""
    skipped: dict[str, list[str]] = defaultdict(list)
    damaged: dict[str, list[str]] = defaultdict(list)
    for one in families:
        name = Path(one.pattern).name
        if one.problem is not None:
            damaged[one.problem.removeprefix(f"{one.largest}").lstrip(":, ")].append(name)
        elif one.kind != "cell":
            held = "results, or something else in a table" if one.is_table else HOLDS[one.kind]
            skipped[held].append(name)
    told = []
    for held, names in skipped.items():
        told.append(f"{some(names)}: {'it holds' if len(names) == 1 else 'they hold'} {held}")
    if told:
        note(f"skipped {'; '.join(told)}")
    for problem, names in damaged.items():
        warn(f"skipped {some(names)}: {problem}")


def _choose_contacts(
    grains: Family,
    families: Sequence[Family],
    around: Sequence[Numbered],
    contacts: PathLike,
    options: ReadOptions,
) -> tuple[Sequence[Family], ContactsFrom]:
    """The families of contact files, and where the contacts of the series come from."""
    if contacts == "geometric":
        return [], "geometric"
    if contacts not in ("auto", "file"):
        return _named_contacts(contacts, options), "path"
    own = [family for family in families if family.kind == "contacts"]
    is_beside = bool(around) and not own
    if is_beside:
        families, own = sorting.contacts_beside(grains, around, options)
    in_grains = getattr(grains.reader, "lists_contacts", False)
    if contacts == "file" and not (own or in_grains):
        lacks = 'there is no contact file, which `contacts="file"` needs'
        raise ReadError(f"{grains.pattern}: {lacks}")
    if contacts == "file":
        return own, "path" if own else "grains"
    if own:
        return own, "beside" if is_beside else "auto"
    # a file that cannot be read is an error if, by name and number, it may be the contact file
    damaged = [
        replace(one, kind="contacts", files=dict.fromkeys(grains.files, one.largest), clash=None)
        for one in families
        if one.problem is not None
        and len(one.files) == len(grains.files)
        and sorting.are_tied(grains, one)
    ]
    if options.contact_columns and not (damaged or in_grains):
        missing = "there is no file of contacts with such columns"
        warn(f"`contact_columns` are named, but {missing}: contacts are found by geometry")
    return damaged, "beside"


def _named_contacts(contacts: PathLike, options: ReadOptions) -> list[Family]:
    """Contact files from a file, a folder or a glob."""
    files = [file for one in sorting.expanded(contacts) for file in sorting.files_of(Path(one))]
    families = sorting.sort_into_families(files, options)
    found = [family for family in families if family.kind == "contacts"]
    if not found:
        problem = next((family.problem for family in families if family.problem), None)
        held = " and ".join(sorted({HOLDS[one.kind] for one in families})) or "no files"
        raise ReadError(problem or f"{contacts}: expected contacts, found {held}")
    return found


def as_text(name: str) -> str:
    """A name as a table can hold it: those of files need be no text."""
    return name.encode("utf-8", "backslashreplace").decode()
