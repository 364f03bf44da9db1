"""A series of frames, read one at a time; pairs the grain file and contact file of a step."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scanfab.errors import PackingError, ReadError, ScanfabWarning
from scanfab.families import Family
from scanfab.packing import Packing, check_lengths
from scanfab.readers.base import GrainTable, JoinedContacts, Reader, ReadOptions, Snapshot

__all__ = ["Frame", "Series"]


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
        if files:
            # contacts are joined by lengths and ids: what is wrong with those comes first
            with _named(self.snapshot.path):
                id = np.arange(len(grains.radius)) if grains.id is None else grains.id
                check_lengths(grains.position, grains.radius, id)
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
        with _named(self.snapshot.path):
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
    _met: dict[Path, int] = field(default_factory=dict, init=False, repr=False, compare=False)
    """How many frames the grain files hold that were looked into."""

    def __iter__(self) -> Iterator[Frame]:
        reader = self.grains.reader
        assert reader is not None
        for name_step, path in self.grains.files.items():
            try:
                snapshots = reader.snapshots(path)
            except ReadError as error:
                self._met[path] = 1
                yield Frame(self, Snapshot(path), name_step, error)
                continue
            self._met[path] = len(snapshots)
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step)

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

    def files(self) -> Iterator[Path]:
        """Every file that the frames come from."""
        for family in (self.grains, *self.contacts):
            yield from family.files.values()


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
