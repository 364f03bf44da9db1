"""One frame of a series: it finds grains and contacts in the files and makes a packing of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.errors import PackingError, ReadError, note, warn
from scanfab.io.columns import body_numbers
from scanfab.io.contacts import NotContactsError, OtherGrainsError
from scanfab.io.families import are_tied
from scanfab.io.files import unpacking_up_to
from scanfab.io.formats.own import FrameData, companion_file, read_contacts, with_columns
from scanfab.io.reader import Carries, GrainTable, JoinedContacts, Reader, ReadOptions, Snapshot
from scanfab.packing.contacts import WallForces
from scanfab.packing.packing import Packing, check_lengths

if TYPE_CHECKING:
    from scanfab.io.series import Series


@dataclass(frozen=True)
class Frame:
    """
    One frame of a series; its files are read by :meth:`read`.

    Attributes
    ----------
    series : Series
        The series, or part of a series, to which the frame belongs.
    snapshot : Snapshot
        The place of the frame in its file.
    name_step : int or None
        The step in the file's name.
    number : int
        The number of the frame in the series, from 0.
    told : FrameData or None
        The content of its frame file, a companion file that :func:`scanfab.convert` writes.
    problem : ReadError or None
        Why the file cannot be searched for its frames.

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
    told: FrameData | None = None
    problem: ReadError | None = None

    def __repr__(self) -> str:
        what = [self.snapshot.path.name, *([] if self.step is None else [f"step {self.step}"])]
        what += [] if self.problem is None else ["damaged"]
        return f"Frame {self.number} of {self.series.name}: {', '.join(what)}"

    def alone(self) -> Frame:
        """
        Make a copy for another process, which does not need the files of other frames.

        Returns
        -------
        Frame
            All its paths are absolute, as the other process may have another folder.
        """
        series, snapshot = self.series, self.snapshot
        known = replace(series.known, snapshots={})
        # while the space is not known, it is looked for in the frames before, so keep their files
        is_known = series.options.dim == 3 or known.space is not None
        steps = {None, self.name_step, self.step} | (set() if is_known else {*series.grains.files})
        families = []
        for family in (series.grains, *series.contacts):
            # keep a second file: the only file of a family would count for any step
            wanted = {*steps, next((step for step in family.files if step not in steps), None)}
            files = {step: file.absolute() for step, file in family.files.items() if step in wanted}
            families.append(replace(family, files=files))
        return replace(
            self,
            series=replace(series, grains=families[0], contacts=tuple(families[1:]), known=known),
            snapshot=replace(snapshot, path=snapshot.path.absolute()),
        )

    @property
    def reader(self) -> Reader:
        """The reader of the grain file."""
        assert self.series.grains.reader is not None
        return self.series.grains.reader

    def read(self) -> Packing:
        """
        Read the frame's packing.

        Returns
        -------
        Packing
            Its contacts are None if no file lists them; then :func:`scanfab.find_contacts` finds
            them by geometry.

        Raises
        ------
        ReadError
            If a file is damaged or incomplete.
        PackingError
            If the data cannot be a packing, for instance because a radius is negative.
        """
        try:
            with unpacking_up_to(self.series.options.max_unpacked):
                return self._packing()
        except PackingError as error:
            raise PackingError(f"{self.snapshot.path}: {error}") from None

    def read_grains(self) -> GrainTable:
        """
        Read the grain file alone, without companion files and contact files.

        Returns
        -------
        GrainTable

        Raises
        ------
        ReadError
            If the file is damaged or incomplete.
        """
        if self.problem is not None:
            raise self.problem
        with unpacking_up_to(self.series.options.max_unpacked):
            return self.reader.read_grains(self.snapshot, self._options())

    def _packing(self) -> Packing:
        series, path = self.series, self.snapshot.path
        grains = with_columns(path, self.read_grains(), self.told)
        takes_own = series.contacts_from in ("auto", "beside", "grains")
        lists = [grains.contacts] if takes_own and grains.contacts is not None else []
        files: list[Path] = []
        parts: list[JoinedContacts] = []
        own_file, named_own = companion_file(path, "contacts"), False
        if series.contacts_from == "path" and len(series.contacts) == 1:
            snapshot = series.contacts_of(self, series.contacts[0])
            named_own = snapshot is not None and snapshot.path == own_file
        own = None
        if takes_own or named_own:
            own = read_contacts(path, grains, self._options(), self.told)
        if own is not None:
            files, parts = [own_file], [own]
        elif not lists or series.contacts_from != "beside":
            files, parts = self._contacts(grains)
        lists += [part.contacts for part in parts if part.contacts is not None]
        named = " and ".join(map(str, files))
        if len(lists) > 1:
            both = f"{path} and {named}" if grains.contacts is not None and takes_own else named
            raise ReadError(f"two contact lists for one frame: {both}: choose with `contacts`")
        if not lists and series.contacts_from == "grains":
            raise ReadError(f'{path}: there is no contact file, which `contacts="file"` needs')
        if not lists and series.contacts_from == "path":
            advice = "lists contacts with walls only: those between grains are found by geometry"
            warn(f"{named}: {advice}, unless `contacts` names their file")
        # a contacts file of `convert` lists no walls; the grain file counts contacts with walls
        is_own = takes_own or own_file in files
        if grains.wall_contacts is not None and is_own:
            parts.append(JoinedContacts(None, grains.wall_contacts, grains.wall_forces))
        none = np.zeros(len(grains.radius), np.int64)
        # forces of walls are known if all files that list contacts with walls have them
        walls = [part.wall_forces for part in parts if part.wall_contacts.any()]
        known = [part for part in walls if part is not None]
        joined = [*zip(*known, strict=True)] if len(known) == len(walls) else []
        wall_forces = WallForces(*map(np.concatenate, joined)) if joined else None
        return Packing(
            grains.position,
            grains.radius,
            id=grains.id,
            columns=grains.columns,
            bodies=body_numbers(path, grains, series.options.bodies),
            contacts=lists[0] if lists else None,
            wall_contacts=sum((part.wall_contacts for part in parts), none) if parts else None,
            wall_forces=wall_forces,
            cell=grains.cell,
            step=self.step,
            time=self.snapshot.time,
            dim=series.space_of(self.number, grains.position, grains.id).dimension,
        )

    def _contacts(self, grains: GrainTable) -> tuple[list[Path], list[JoinedContacts]]:
        """The contact files of the frame, and the contacts in each, joined to the grains."""
        series, options = self.series, self._options()
        files: list[Path] = []
        parts: list[JoinedContacts] = []
        if series.contacts:
            # joining contacts needs sound lengths and ids, so their errors are reported first
            id = np.arange(len(grains.radius)) if grains.id is None else grains.id
            check_lengths(grains.position, grains.radius, id)
        for family in series.contacts:
            try:
                snapshot = series.contacts_of(self, family)
                if snapshot is not None and family.reader is not None:
                    files.append(snapshot.path)
                    parts.append(family.reader.read_contacts(snapshot, options, grains))
            except ReadError as error:
                if series.contacts_from == "path":
                    raise
                is_theirs = series.contacts_from != "beside" or are_tied(series.grains, family)
                is_sure = isinstance(error, OtherGrainsError) and is_theirs
                if not isinstance(error, NotContactsError) or options.contact_columns or is_sure:
                    advice = 'was found beside the grains; `contacts="geometric"` ignores it'
                    raise ReadError(f"{error} (this file {advice})") from None
                note(f"skipped {error}")
        if series.contacts and not files:
            step, time = self.name_step if self.step is None else self.step, self.snapshot.time
            moment = f"step {step}" if step is not None else f"frame {self.number}"
            moment = f"time {time:g}" if self.step is None and time is not None else moment
            patterns = ", ".join(family.pattern for family in series.contacts)
            message = f"{self.snapshot.path}: no contact file for {moment} among {patterns}"
            if series.contacts_from == "path":
                raise ReadError(message)
            warn(f"{message}: contacts are found by geometry")
        return files, parts

    @property
    def step(self) -> int | None:
        """The step in the dump, else in the file's name; None if the dump says it has no step."""
        if self.snapshot.step is not None:
            return self.snapshot.step
        is_named = self.series.grains.has_steps and not self.snapshot.stepless
        return self.name_step if is_named else None

    @property
    def carries(self) -> Carries:
        """How much of a cell the dump, its frame file or the user give."""
        ask = getattr(self.reader, "carries", None)
        options = self.series.options
        is_given = self.told or options.cell or options.periodic is not None
        with unpacking_up_to(options.max_unpacked):
            return "cell" if is_given or ask is None else ask(self.snapshot.path)

    @property
    def cell_is_named(self) -> bool:
        """Whether the user names a cell, or along which axes it repeats."""
        return bool(self.series.options.cell or self.series.options.periodic)

    def _options(self) -> ReadOptions:
        """The options for this frame, with its own cell if a file lists a cell for each frame."""
        options, cells = self.series.options, self.series.cells
        if self.told is not None:
            options = replace(options, beside=self.told.cell or "none")
        if cells is None:
            return options
        vectors = cells.at(self.number, self.name_step if self.step is None else self.step)
        if vectors is None:
            frame = f"frame {self.number}, step {self.step}, {self.snapshot.path}"
            raise ReadError(f"{cells.path}: has no row with the cell of {frame}")
        return replace(options, cell=vectors)
