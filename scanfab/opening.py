"""From folders and files, as users name them, to series of frames."""

from __future__ import annotations

import glob
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scanfab.errors import ReadError, ScanfabWarning, UnknownFormatError
from scanfab.families import Family, sort_into_families
from scanfab.packing import Packing
from scanfab.readers.base import ReadOptions
from scanfab.series import Series

__all__ = ["SETTINGS_FILE", "open_sources", "read", "read_series"]

PathLike = str | os.PathLike[str]

# options of the command line, beside the dumps
SETTINGS_FILE = "scanfab.toml"


def read(path: PathLike, *, frame: int = 0, **options: Any) -> Packing:
    """
    Read one frame.

    Parameters
    ----------
    path : path
        A particle file.
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
    frames = list(read_series(path, **options))
    try:
        chosen = frames[frame]
    except IndexError:
        raise ReadError(f"{path}: has {len(frames)} frames, there is no frame {frame}") from None
    return chosen.read()


def read_series(
    source: PathLike | Sequence[PathLike],
    *,
    format: str | None = None,
    contacts: str | PathLike = "auto",
    columns: dict[str, str] | None = None,
    contact_columns: str | None = None,
    radius: float | None = None,
    cell: tuple[float, ...] | None = None,
    periodic: str | None = None,
) -> Series:
    """
    Open a series of frames: a folder, a file, or several files.

    Parameters
    ----------
    source : path or sequence of paths
        A folder with one series, or its files.
    format : str, optional
        Name of the reader; by content if not given.
    contacts : str or path, optional
        ``auto``: from contact files if there are any, else by geometry; ``file``; ``geometric``; or
        a file, folder or glob, matched by step.
    columns : dict, optional
        Standard names to the file's own, such as ``{"radius": "c_rad"}``.
    contact_columns : str, optional
        Keywords of LIGGGHTS' ``compute pair/gran/local``, or LAMMPS' columns by their meaning:
        ``"id1=c_ids[1],id2=c_ids[2]"``.
    radius : float, optional
        Radius for dumps without one, dump's length unit.
    cell : tuple of float, optional
        LX LY LZ or LX LY LZ XY XZ YZ, for formats that do not carry it.
    periodic : str, optional
        Letters out of xyz.

    Returns
    -------
    Series

    Raises
    ------
    UnknownFormatError
        If no reader knows the files.
    ReadError
        If there is no series, or more than one.

    Examples
    --------
    >>> import scanfab
    >>> folder = "sample_data/liggghts_periodic"
    >>> series = scanfab.read_series([f"{folder}/dump_{step}.txt.gz" for step in (60000, 30000)])
    >>> [frame.read().step for frame in series]
    [30000, 60000]
    """
    given = [source] if isinstance(source, str | os.PathLike) else list(source)
    paths = [Path(path) for path in given]
    options = ReadOptions(columns or {}, contact_columns, radius, cell, periodic)
    families = sort_into_families([file for path in paths for file in _files(path)], format)
    grains = _grain_family(paths, families).check()
    name = _as_text(os.fspath(given[0]) if len(given) == 1 else _common_folder(paths))
    own = tuple(family for family in families if family.kind == "contacts")
    _note_passed_over(families, [grains, *own])
    if contacts == "geometric":
        return Series(name, grains, (), "geometric", options)
    if contacts in ("auto", "file"):
        if contacts == "file" and not own:
            if not getattr(grains.reader, "lists_contacts", False):
                raise ReadError(
                    f"{name}: --contacts file was asked for, but there is no contact file"
                )
            return Series(name, grains, (), "grains", options)
        checked = tuple(family.check() for family in own)
        return Series(name, grains, checked, "auto" if contacts == "auto" else "path", options)
    return Series(name, grains, _named_contacts(contacts, format), "path", options)


def open_sources(sources: Sequence[PathLike], **options: Any) -> list[Series]:
    """
    The series of a command line: one for each folder, and one for all single files together.

    Parameters
    ----------
    sources : sequence of paths
        Folders and files.
    **options
        See :func:`read_series`.
    """
    groups: list[PathLike | list[PathLike]] = []
    files: list[PathLike] = []
    for source in sources:
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


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        found = sorted(file for file in path.iterdir() if file.is_file())
        files = [
            file for file in found if not file.name.startswith(".") and file.name != SETTINGS_FILE
        ]
        if not files:
            raise ReadError(f"{path}: the folder holds no files")
        return files
    if not path.exists():
        raise ReadError(f"{path}: there is no such file or folder")
    return [path]


def _grain_family(paths: list[Path], families: list[Family]) -> Family:
    """The one family of grain files."""
    grains: list[Family] = []
    for kind in ("grains", "index", "points"):
        grains = grains or [family for family in families if family.kind == kind]
    where = ", ".join(str(path) for path in paths[:3]) + (", ..." if len(paths) > 3 else "")
    if len(grains) > 1:
        message = f"{where}: several series of grains: choose one of\n  "
        message += "\n  ".join(family.pattern for family in grains)
        contacts = [family.pattern for family in families if family.kind == "contacts"]
        if contacts:
            message += "\nand its contacts, --contacts with one of\n  "
            message += "\n  ".join(f"'{pattern}'" for pattern in contacts)
        raise ReadError(message)
    if not grains:
        problem = next((family.problem for family in families if family.problem), None)
        if problem is not None:
            raise ReadError(problem)
        known = [family for family in families if family.reader is not None]
        if not known:
            raise UnknownFormatError(
                f"{where}: no reader knows the format; scanfab formats lists those that exist"
            )
        raise ReadError(
            f"{where}: no grains: expected points with a radius, found only "
            + ", ".join(f"{family.pattern} ({family.kind})" for family in known)
        )
    return grains[0]


def _note_passed_over(families: list[Family], used: list[Family]) -> None:
    """One warning for the files that do not enter, and one for each that is damaged."""
    unused = [one.pattern for one in families if one not in used and one.problem is None]
    if unused:
        names = ", ".join(Path(pattern).name for pattern in unused[:5])
        more = f" and {len(unused) - 5} more" if len(unused) > 5 else ""
        warnings.warn(
            f"passed over, neither grains nor contacts: {names}{more}",
            ScanfabWarning,
            stacklevel=3,
        )
    for family in families:
        if family.problem is not None:
            warnings.warn(f"passed over: {family.problem}", ScanfabWarning, stacklevel=3)


def _named_contacts(contacts: PathLike, format: str | None) -> tuple[Family, ...]:
    """Contact files from --contacts PATH: a file, a folder or a glob."""
    path = Path(contacts)
    files = (
        _files(path)
        if path.exists()
        else [Path(match) for match in sorted(glob.glob(str(contacts)))]
    )
    if not files:
        raise ReadError(f"{contacts}: there is no such contact file, folder or glob")
    families = sort_into_families(files, format)
    found = tuple(family.check() for family in families if family.kind == "contacts")
    if not found:
        problem = next((family.problem for family in families if family.problem), None)
        raise ReadError(problem or f"{contacts}: expected contacts, found none")
    return found


def _as_text(name: str) -> str:
    """A name as a table can hold it: those of files need be no text."""
    return name.encode("utf-8", "backslashreplace").decode()


def _common_folder(paths: list[Path]) -> str:
    folders = [str(path.parent) for path in paths]
    if len({path.is_absolute() for path in paths}) > 1:
        folders = [os.path.abspath(folder) for folder in folders]
    return os.path.commonpath(folders) or "."
