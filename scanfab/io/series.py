"""A series of frames, read one at a time; pairs the grain file and contact file of a step."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scanfab.base.errors import PackingError, ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.families import Family, nearest
from scanfab.io.frame_csv import FrameFile
from scanfab.io.reader import (
    Carries,
    GrainTable,
    JoinedContacts,
    Reader,
    ReadOptions,
    Snapshot,
)
from scanfab.packing.packing import Packing, check_lengths

__all__ = ["ContactsFrom", "Frame", "Series"]


ContactsFrom = Literal["auto", "beside", "geometric", "path", "grains"]
"""
``auto``: from what the source holds; ``beside``: from what lies beside single grain files;
``path``: from what the user names; ``grains``: from the grain files themselves.
"""


@dataclass(frozen=True)
class Frame:
    """One frame of a series, not read yet."""

    series: Series
    snapshot: Snapshot
    name_step: int | None
    """The step in the file's name."""
    number: int = 0
    """In the series, from 0."""
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
        options = self._options()
        grains = self.reader.read_grains(self.snapshot, options)
        with_own = self.series.contacts_from in ("auto", "beside", "grains")
        own = grains.contacts if with_own else None
        beside = self.series.contacts_from == "beside"
        joined = [] if beside and own is not None else self._joined_contacts(grains, options)
        listed = [part.contacts for part in joined if part.contacts is not None]
        if own is not None:
            listed.append(own)
        if self.series.contacts_from == "grains" and not listed:
            raise ReadError(
                f'{self.snapshot.path}: `contacts="file"` was asked for, but there is no '
                "contact file"
            )
        with _named(self.snapshot.path):
            return Packing(
                grains.position,
                grains.radius,
                id=grains.id,
                columns=grains.columns,
                contacts=listed[0] if listed else None,
                wall_contacts=_wall_contacts(grains, joined, with_own),
                cell=grains.cell,
                step=self.step,
                time=self.snapshot.time,
            )

    def _joined_contacts(self, grains: GrainTable, options: ReadOptions) -> list[JoinedContacts]:
        """The contact files of the frame, joined to its grains; one of them lists grain pairs."""
        files = self._contact_files()
        if not files:
            return []
        # contacts are joined by lengths and ids: what is wrong with those comes first
        with _named(self.snapshot.path):
            id = np.arange(len(grains.radius)) if grains.id is None else grains.id
            check_lengths(grains.position, grains.radius, id)
        joined = [
            (family, self._joined(family, snapshot, options, grains)) for family, snapshot in files
        ]
        lists = [family for family, part in joined if part.contacts is not None]
        with_own = self.series.contacts_from == "auto" and grains.contacts is not None
        paths = " and ".join(str(snapshot.path) for _, snapshot in files)
        if len(lists) + with_own > 1:
            others = self._left_out(lists, paths)
            return [part for family, part in joined if family not in others]
        if not lists and self.series.contacts_from == "path":
            warnings.warn(
                f"{paths}: lists contacts with walls only: contacts between grains are found by "
                f"geometry, unless `contacts` names their file",
                ScanfabWarning,
                stacklevel=4,
            )
        return [part for _, part in joined]

    def _joined(
        self, family: Family, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        assert family.reader is not None
        try:
            return family.reader.read_contacts(snapshot, options, grains)
        except ReadError as error:
            if self.series.contacts_from != "beside":
                raise
            raise ReadError(
                f"{error} (this file lies beside the grains; "
                '`contacts="geometric"` leaves it alone)'
            ) from None

    def _left_out(self, lists: list[Family], paths: str) -> Sequence[Family]:
        """An error; but of files that lie beside grains all that are not the nearest by name."""
        if self.series.contacts_from != "beside":
            raise ReadError(f"two contact lists for one frame: {paths}: choose with `contacts`")
        taken = nearest(self.series.grains, lists)
        if taken is not None:
            others = [family for family in lists if family is not taken]
            warnings.warn(
                f"{taken.pattern}: of several contact lists beside the grains this one is taken, "
                f"whose name is the nearest: `contacts` names another",
                ScanfabNote,
                stacklevel=5,
            )
            return others
        warnings.warn(
            f"two contact lists lie beside {self.snapshot.path}: {paths}: none is taken; choose "
            f"with `contacts`",
            ScanfabWarning,
            stacklevel=5,
        )
        return self.series.contacts

    @property
    def step(self) -> int | None:
        """That of the dump, else the one in the file's name."""
        return self.name_step if self.snapshot.step is None else self.snapshot.step

    @property
    def carries(self) -> Carries:
        """What the dump or its user say of a cell."""
        ask = getattr(self.reader, "carries", None)
        options = self.series.options
        told = self.series.cells or options.cell or options.periodic is not None
        return "cell" if told or ask is None else ask(self.snapshot.path)

    @property
    def cell_is_named(self) -> bool:
        """Whether the user names a cell, or what is periodic."""
        options = self.series.options
        return bool(self.series.cells or options.cell or options.periodic)

    def _options(self) -> ReadOptions:
        """How to read this frame, with its cell if a file names those of the frames."""
        options, cells = self.series.options, self.series.cells
        if cells is None:
            return options
        found = cells.at(self.number, self.step)
        if found is None:
            name = f"step {self.step}" if cells.key == "step" else f"frame {self.number}"
            raise ReadError(
                f"{cells.path}: names no cell for {name}, which is {self.snapshot.path}: add a row "
                f"for it"
            )
        return replace(options, cell=found)

    def _contact_files(self) -> list[tuple[Family, Snapshot]]:
        """The snapshots of the contact files that belong to this frame."""
        series, found = self.series, []
        for family in series.contacts:
            named = series.contacts_from == "path" and len(series.grains.files) == 1
            contacts = series.contacts_of(self.snapshot, self.name_step, family, named)
            if contacts is not None:
                found.append((family, contacts))
        if not found and series.contacts:
            patterns = ", ".join(family.pattern for family in series.contacts)
            message = f"{self.snapshot.path}: no contact file for step {self.step} among {patterns}"
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
    contacts_from: ContactsFrom = "auto"
    options: ReadOptions = field(default_factory=ReadOptions)
    cells: FrameFile | None = None
    """The cell of each frame, in the place of one for all in the options."""
    sources: tuple[str, ...] = field(default=(), repr=False, compare=False)
    """What ``read_series`` was given."""
    reading: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """Its options, as a manifest lists them."""
    # a file that holds the contacts of many frames is indexed once
    _contact_snapshots: dict[Path, list[Snapshot]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _met: dict[Path, int] = field(default_factory=dict, init=False, repr=False, compare=False)
    """How many frames the grain files hold that were looked into."""

    def __iter__(self) -> Iterator[Frame]:
        reader = self.grains.reader
        assert reader is not None
        number = 0
        for name_step, path in self.grains.files.items():
            problem: ReadError | None = None
            try:
                snapshots = reader.snapshots(path)
            except ReadError as error:
                snapshots, problem = [Snapshot(path)], error
            self._met[path] = len(snapshots)
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step, number, problem)
                number += 1

    def frames_expected(self) -> int:
        """
        About how many frames there are, without looking for them.

        Files that nobody has looked into yet count as many as the last one that was, at first one.
        """
        met = list(self._met.values())
        return sum(met) + (len(self.grains.files) - len(met)) * (met[-1] if met else 1)

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

    def beside(self, path: Path) -> list[Path]:
        """What is read with a file of grains: its cell, or the dumps that an index names."""
        listed = self._listed(path) if self.grains.kind == "index" else []
        ask = getattr(self.grains.reader, "beside", None)
        named = self.cells is not None or self.options.cell is not None
        if named or ask is None:
            return listed
        return [*listed, *(file for one in listed or [path] for file in ask(one))]

    def _listed(self, index: Path) -> list[Path]:
        """The dumps of an index that are there; a frame that is not has been told of."""
        assert self.grains.reader is not None
        try:
            snapshots = self.grains.reader.snapshots(index)
        except ReadError:
            return []
        return [path for path in dict.fromkeys(one.path for one in snapshots) if path.is_file()]

    def files_through(self, number: int) -> Iterator[tuple[Path, bool]]:
        """
        The files of the frames up to one, and whether each is a file of grains.

        All of these frames have been looked for: one file may hold many.
        """
        steps, met = [], 0
        for step, path in self.grains.files.items():
            steps.append(step)
            yield path, True
            met += self._met.get(path, 1)
            if met > number:
                break
        last = max((step for step in steps if step is not None), default=None)
        for family in self.contacts:
            for step, path in family.files.items():
                if step is None or last is None or step <= last:
                    yield path, False

    def files(self) -> Iterator[Path]:
        """Every file that the frames come from."""
        for family in (self.grains, *self.contacts):
            yield from family.files.values()
        for path in self.grains.files.values():
            yield from self.beside(path)
        if self.cells is not None:
            yield self.cells.path


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Let errors of a packing begin with its file."""
    try:
        yield
    except PackingError as error:
        raise PackingError(f"{path}: {error}") from None


def _wall_contacts(grains: GrainTable, joined: list[JoinedContacts], with_own: bool) -> Any:
    own = grains.wall_contacts if with_own else None
    if not joined:
        return own
    first = np.zeros(len(grains.radius), np.int64) if own is None else own
    return sum((part.wall_contacts for part in joined), first)
