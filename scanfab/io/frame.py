"""One frame of a series, not read yet: its grains, its contacts, and how they become a packing."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.errors import PackingError, ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray
from scanfab.io.beside import (
    check_contacts_are_there,
    frame_file,
    is_contacts_file,
    read_frame,
    with_columns,
)
from scanfab.io.bodies import body_numbers
from scanfab.io.families import Family, are_tied
from scanfab.io.files import unpacking_up_to
from scanfab.io.reader import (
    Carries,
    GrainTable,
    JoinedContacts,
    NotContactsError,
    OtherGrainsError,
    Reader,
    ReadOptions,
    Snapshot,
)
from scanfab.packing.packing import Packing, check_lengths
from scanfab.packing.walls import ListedWallForces

if TYPE_CHECKING:
    from scanfab.io.series import Series


@dataclass(frozen=True)
class Frame:
    """
    One frame of a series, not read yet.

    Attributes
    ----------
    series : Series
        The series, or the part of it, that the frame is of.
    snapshot : Snapshot
        Where the frame lies in its file.
    name_step : int or None
        The step in the file's name.
    number : int
        In the series, from 0.
    problem : ReadError or None
        Why not even the frames of the file can be told.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.read_series("sample_data/liggghts_periodic/dump_*.txt.gz")
    >>> frame = series[0]
    >>> frame.number, frame.step, len(frame.read())
    (0, 30000, 800)
    """

    series: Series
    snapshot: Snapshot
    name_step: int | None
    number: int = 0
    problem: ReadError | None = None

    def __repr__(self) -> str:
        what = [self.snapshot.path.name, *([] if self.step is None else [f"step {self.step}"])]
        what += [] if self.problem is None else ["damaged"]
        return f"Frame {self.number} of {self.series.name}: {', '.join(what)}"

    def alone(self) -> Frame:
        """
        The frame for another process, which need not know the other files nor our folder.

        Returns
        -------
        Frame
            With absolute paths.
        """
        series, path = self.series, self.snapshot.path
        families = [_of_step(one, self.name_step, self.step) for one in series.contacts]
        grains = replace(series.grains, files=_absolute(series.grains.files))
        if series.dim == 3 or series.known.space is not None:
            # else the space of the series is that of a frame before
            grains = _of_step(grains, self.name_step, self.step)
        other = replace(series, grains=grains, contacts=tuple(families))
        parts = tuple(part.absolute() for part in self.snapshot.parts)
        snapshot = replace(self.snapshot, path=path.absolute(), parts=parts)
        return replace(self, series=other, snapshot=snapshot)

    @property
    def reader(self) -> Reader:
        """The reader of the grain file."""
        assert self.series.grains.reader is not None
        return self.series.grains.reader

    def read(self) -> Packing:
        """
        The frame's packing.

        Returns
        -------
        Packing
            Its contacts are None if no file lists them: :func:`scanfab.find_contacts` finds them.

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
        with unpacking_up_to(options.max_unpacked):
            return self._packing(options)

    def _packing(self, options: ReadOptions) -> Packing:
        path = self.snapshot.path
        told = read_frame(path)
        grains = with_columns(path, self.reader.read_grains(self.snapshot, options), told)
        with_own = self.series.contacts_from in ("auto", "beside", "grains")
        own = grains.contacts if with_own else None
        beside = self.series.contacts_from == "beside"
        joined = [] if beside and own is not None else self._joined_contacts(grains, options)
        listed = [part.contacts for part in joined if part.contacts is not None]
        if own is not None:
            listed.append(own)
        if not listed and self.series.contacts_from in ("auto", "beside", "grains"):
            check_contacts_are_there(path, told)
        if self.series.contacts_from == "grains" and not listed:
            raise ReadError(
                f'{path}: `contacts="file"` was asked for, but there is no contact file'
            )
        walls = joined
        if grains.wall_contacts is not None and (with_own or self._walls_are_with_grains()):
            walls = [*joined, JoinedContacts(None, grains.wall_contacts, grains.wall_forces)]
        none = np.zeros(len(grains.radius), np.int64)
        with _named(path):
            return Packing(
                grains.position,
                grains.radius,
                id=grains.id,
                columns=grains.columns,
                bodies=body_numbers(path, grains, options.bodies),
                contacts=listed[0] if listed else None,
                wall_contacts=sum((one.wall_contacts for one in walls), none) if walls else None,
                wall_forces=_wall_forces(walls),
                cell=grains.cell,
                step=self.step,
                time=self.snapshot.time,
                dim=self.series.space_of(self.number, grains.position),
            )

    def _walls_are_with_grains(self) -> bool:
        """Whether the contacts are those that a conversion left beside: none is a wall's."""
        return any(is_contacts_file(snapshot.path) for _, snapshot in self._contact_files())

    def centres(self) -> FloatArray:
        """
        The centres of its particles alone.

        Returns
        -------
        ndarray, shape (N, 3)
            Dump's length unit.

        Raises
        ------
        ReadError
            If the file is not as it should be.
        """
        if self.problem is not None:
            raise self.problem
        options = self._options()
        with unpacking_up_to(options.max_unpacked):
            return self.reader.read_grains(self.snapshot, options).position

    def _joined_contacts(self, grains: GrainTable, options: ReadOptions) -> list[JoinedContacts]:
        """The contact files of the frame, joined to its grains; one of them lists grain pairs."""
        files = self._contact_files()
        if not files:
            return []
        # contacts are joined by lengths and ids: what is wrong with those comes first
        with _named(self.snapshot.path):
            id = np.arange(len(grains.radius)) if grains.id is None else grains.id
            check_lengths(grains.position, grains.radius, id)
        joined = []
        for family, snapshot in files:
            assert family.reader is not None
            with self._tells_way_out():
                try:
                    joined.append((family, family.reader.read_contacts(snapshot, options, grains)))
                except NotContactsError as error:
                    if self._is_sure(family, error):
                        raise
                    warnings.warn(f"skipped {error}", ScanfabNote, stacklevel=4)
        lists = [family for family, part in joined if part.contacts is not None]
        with_own = self.series.contacts_from == "auto" and grains.contacts is not None
        paths = " and ".join(str(snapshot.path) for _, snapshot in files)
        if len(lists) + with_own > 1:
            raise ReadError(f"two contact lists for one frame: {paths}: choose with `contacts`")
        if not lists and self.series.contacts_from == "path":
            warnings.warn(
                f"{paths}: lists contacts with walls only: contacts between grains are found by "
                f"geometry, unless `contacts` names their file",
                ScanfabWarning,
                stacklevel=4,
            )
        return [part for _, part in joined]

    def _is_sure(self, family: Family, error: NotContactsError) -> bool:
        """Whether contact files that do not fit are an error: if they are named, or of the step."""
        series = self.series
        if series.contacts_from == "path" or series.options.contact_columns is not None:
            return True
        is_tied = series.contacts_from != "beside" or are_tied(series.grains, family)
        return is_tied and isinstance(error, OtherGrainsError)

    @contextmanager
    def _tells_way_out(self) -> Iterator[None]:
        """Let the error of a contact file that nobody named tell how to do without it."""
        try:
            yield
        except ReadError as error:
            if self.series.contacts_from != "beside":
                raise
            raise ReadError(
                f"{error} (this file lies beside the grains; "
                '`contacts="geometric"` leaves it alone)'
            ) from None

    @property
    def step(self) -> int | None:
        """That of the dump, else the one in the file's name, unless the dump says it has none."""
        if self.snapshot.step is not None:
            return self.snapshot.step
        is_named = self.series.grains.has_steps and not self.snapshot.stepless
        return self.name_step if is_named else None

    @property
    def carries(self) -> Carries:
        """What the dump or its user say of a cell."""
        ask = getattr(self.reader, "carries", None)
        options = self.series.options
        told = self.series.cells or options.cell or options.periodic is not None
        told = told or frame_file(self.snapshot.path).is_file()
        with unpacking_up_to(options.max_unpacked):
            return "cell" if told or ask is None else ask(self.snapshot.path)

    @property
    def named(self) -> dict[str, bool]:
        """Whether the user names a cell (or what is periodic), and which spheres are one body."""
        options = self.series.options
        cell = bool(self.series.cells or options.cell or options.periodic)
        return {"cell_is_named": cell, "bodies_are_named": options.bodies is not None}

    def _options(self) -> ReadOptions:
        """How to read this frame, with its cell if a file names those of the frames."""
        options, cells = self.series.options, self.series.cells
        beside = read_frame(self.snapshot.path)
        if beside is not None:
            options = replace(options, beside=beside.cell or "none")
        if cells is None:
            return options
        found = cells.at(self.number, self.name_step if self.step is None else self.step)
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
            with self._tells_way_out():
                contacts = series._contacts_of(self, family)
            if contacts is not None:
                found.append((family, contacts))
        if not found and series.contacts:
            patterns = ", ".join(family.pattern for family in series.contacts)
            step = self.name_step if self.step is None else self.step
            moment = f"frame {self.number}" if step is None else f"step {step}"
            if self.step is None and self.snapshot.time is not None:
                moment = f"time {self.snapshot.time:g}"
            message = f"{self.snapshot.path}: no contact file for {moment} among {patterns}"
            if series.contacts_from == "path":
                raise ReadError(message)
            warnings.warn(
                f"{message}: contacts are found by geometry", ScanfabWarning, stacklevel=3
            )
        return found


def _absolute(files: dict[int | None, Path]) -> dict[int | None, Path]:
    return {step: path.absolute() for step, path in files.items()}


def _of_step(family: Family, *steps: int | None) -> Family:
    """The files of some steps; another one too, as a single file may be that of any step."""
    wanted = (None, *steps)
    files = {step: path for step, path in family.files.items() if step in wanted}
    other = next((step for step in family.files if step not in wanted), None)
    if other is not None and len(files) < 2:
        files[other] = family.files[other]
    return replace(family, files=_absolute(files))


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Let errors of a packing begin with its file."""
    try:
        yield
    except PackingError as error:
        raise PackingError(f"{path}: {error}") from None


def _wall_forces(walls: list[JoinedContacts]) -> ListedWallForces | None:
    """Of all files that list contacts with walls; None if one of them does not say the forces."""
    parts = [one.wall_forces for one in walls if one.wall_contacts.any()]
    known = [part for part in parts if part is not None]
    if not known or len(known) < len(parts):
        return None
    return ListedWallForces(*(np.concatenate(values) for values in zip(*known, strict=True)))
