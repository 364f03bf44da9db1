"""From files and folders to a series of frames; pairs the grain file and contact file of a step."""

from __future__ import annotations

import glob
import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scanfab.errors import PackingError, ReadError, ScanfabWarning, UnknownFormatError
from scanfab.families import Family, sort_into_families
from scanfab.packing import Packing
from scanfab.readers.base import GrainTable, JoinedContacts, Reader, ReadOptions, Snapshot

__all__ = ["Frame", "Series", "open_sources", "read", "read_series"]

PathLike = str | os.PathLike[str]

# options of the command line, beside the dumps
SETTINGS_FILE = "scanfab.toml"


@dataclass(frozen=True)
class Frame:
    """One frame of a series, not read yet."""

    series: Series
    snapshot: Snapshot
    name_step: int | None
    """The step in the file's name."""
    problem: ReadError | None = None
    """Why not even the frames of the file can be told."""

    @property
    def reader(self) -> Reader:
        """The reader of the grain file."""
        assert self.series.grains.reader is not None
        return self.series.grains.reader

    def read(self) -> Packing:
        """
        The frame's packing; its contacts are None if no file lists them.

        Raises
        ------
        ReadError
            If a file is not as it should be.
        PackingError
            If its content is no packing.
        """
        if self.problem is not None:
            raise self.problem
        options = self.series.options
        files = self._contact_files()
        grains = self.reader.read_grains(self.snapshot, options)
        joined = [reader.read_contacts(snapshot, options, grains) for reader, snapshot in files]
        listed = [part.contacts for part in joined if part.contacts is not None]
        with_own = self.series.contacts_from in ("auto", "grains")
        if with_own and grains.contacts is not None:
            listed.append(grains.contacts)
        if len(listed) > 1:
            paths = " and ".join(str(snapshot.path) for _, snapshot in files)
            raise ReadError(f"two contact lists for one frame: {paths}: choose with --contacts")
        if self.series.contacts_from == "grains" and not listed:
            raise ReadError(
                f"{self.snapshot.path}: --contacts file was asked for, but there is no contact file"
            )
        step = self.name_step if self.snapshot.step is None else self.snapshot.step
        try:
            return Packing(
                grains.position,
                grains.radius,
                id=grains.id,
                columns=grains.columns,
                contacts=listed[0] if listed else None,
                wall_contacts=_wall_contacts(grains, joined, with_own),
                cell=grains.cell,
                step=step,
                time=self.snapshot.time,
            )
        except PackingError as error:
            raise PackingError(f"{self.snapshot.path}: {error}") from None

    def _contact_files(self) -> list[tuple[Reader, Snapshot]]:
        """The snapshots of the contact files that belong to this frame."""
        series, found = self.series, []
        for family in series.contacts:
            named = series.contacts_from == "path" and len(series.grains.files) == 1
            contacts = series.contacts_of(self.snapshot, self.name_step, family, named)
            if contacts is not None:
                assert family.reader is not None
                found.append((family.reader, contacts))
        if not found and series.contacts:
            step = self.name_step if self.snapshot.step is None else self.snapshot.step
            patterns = ", ".join(family.pattern for family in series.contacts)
            message = f"{self.snapshot.path}: no contact file for step {step} among {patterns}"
            if series.contacts_from == "path":
                raise ReadError(message)
            warnings.warn(
                f"{message}: contacts are found by geometry", ScanfabWarning, stacklevel=3
            )
        return found


@dataclass(frozen=True)
class Series:
    """
    Frames in the order of their steps, read one at a time.

    Iterating gives :class:`Frame` objects; ``frame.read()`` gives the packing.
    """

    name: str
    """As the user named it."""
    grains: Family
    contacts: tuple[Family, ...] = ()
    contacts_from: Literal["auto", "geometric", "path", "grains"] = "auto"
    """``grains``: from the grain files themselves."""
    options: ReadOptions = field(default_factory=ReadOptions)
    # a file that holds the contacts of many frames is indexed once
    _contact_snapshots: dict[Path, list[Snapshot]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __iter__(self) -> Iterator[Frame]:
        reader = self.grains.reader
        assert reader is not None
        for name_step, path in self.grains.files.items():
            try:
                snapshots = reader.snapshots(path)
            except ReadError as error:
                yield Frame(self, Snapshot(path), name_step, error)
                continue
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step)

    def contacts_of(
        self, grains: Snapshot, name_step: int | None, family: Family, named: bool
    ) -> Snapshot | None:
        """
        The contacts of a grain snapshot in a family of contact files; None if there are none.

        Steps inside the files decide; where a file has none, the number in its name does. A single
        contact file that the user named for a single grain file needs no number.
        """
        step = name_step if grains.step is None else grains.step
        path = family.files.get(name_step, family.files.get(step))
        if path is None and len(family.files) == 1:
            path = next(iter(family.files.values()))
        if path is None:
            return None
        if path not in self._contact_snapshots:
            assert family.reader is not None
            self._contact_snapshots[path] = family.reader.snapshots(path)
        snapshots = self._contact_snapshots[path]
        if len(snapshots) == 1 and (snapshots[0].step is None or grains.step is None):
            numbered = None not in family.files and step is not None
            matches = named or not numbered or bool({name_step, step} & set(family.files))
            return snapshots[0] if matches else None
        return next((one for one in snapshots if one.step == grains.step), None)

    def files(self) -> Iterator[Path]:
        """Every file that the frames come from."""
        for family in (self.grains, *self.contacts):
            yield from family.files.values()


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
    name = os.fspath(given[0]) if len(given) == 1 else _common_folder(paths)
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
        raise ReadError(f"{contacts}: expected contacts, found none")
    return found


def _wall_contacts(grains: GrainTable, joined: list[JoinedContacts], with_own: bool) -> Any:
    own = grains.wall_contacts if with_own else None
    if not joined:
        return own
    first = np.zeros(len(grains.radius), np.int64) if own is None else own
    return sum((part.wall_contacts for part in joined), first)


def _common_folder(paths: list[Path]) -> str:
    folders = [str(path.parent) for path in paths]
    if len({path.is_absolute() for path in paths}) > 1:
        folders = [os.path.abspath(folder) for folder in folders]
    return os.path.commonpath(folders) or "."
