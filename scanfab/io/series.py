"""A series of frames, read one at a time; it finds the contact file for each grain file."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from itertools import chain, islice
from operator import index
from pathlib import Path
from typing import Literal, SupportsIndex, overload

from scanfab.base.errors import NoFrameError, PackingError, ReadError, SettingsError, note
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.families import Family
from scanfab.io.files import Stamp, stamp_of, unpacking_up_to
from scanfab.io.formats.own import HEADS, companion_file, read_frame
from scanfab.io.frame import Frame
from scanfab.io.layout import FrameFile
from scanfab.io.reader import ReadOptions, Snapshot
from scanfab.packing.packing import flat_space, space_of, spelt_plane

# the end of a range of frames that are not counted yet: more than any series has
ENDLESS = 2**62
# relative difference below which two times are equal: programs write six digits or more
ROUNDING = 2e-6

ContactsFrom = Literal["auto", "beside", "geometric", "path", "grains"]
"""
``auto``: the files of the source; ``beside``: other files in the folders of single grain files;
``path``: files that the user names; ``grains``: the grain files; ``geometric``: no file.
"""


@dataclass
class Known:
    """What is known about the files of a series; the series and its slices share it."""

    snapshots: dict[Path, tuple[Stamp | None, list[Snapshot]]] = field(default_factory=dict)
    """The snapshots of each file that was searched, and the stamp of the file at that time."""
    space: Space | None = None
    """The plane or space in which the particles of the reference frame lie."""
    reference: int | None = None
    """Number of the reference frame; None for the first frame that has particles."""


@dataclass
class Series:
    """
    Frames in the order of their steps, read one at a time.

    Iterating gives :class:`Frame` objects; ``frame.read()`` gives the packing. ``series[-1]`` is a
    frame, and ``series[2:5]`` is the same series with fewer frames. These keep their numbers, and
    the RV, ``rmin`` and the initial length are still those of the whole series.

    Attributes
    ----------
    name : str
        The name that the user gave.
    grains : Family
        The grain files, by step.
    contacts : tuple of Family
        The families of contact files, by step.
    contacts_from : str
        Where contacts come from.
    options : ReadOptions
        The options of :func:`scanfab.read_series`.
    cells : FrameFile or None
        A file with the cell of each frame, if the user named one.
    sources : tuple of str
        The sources that were passed to :func:`scanfab.read_series`.
    numbers : range
        The numbers of the frames in the whole series; it may end behind the last frame.
    known : Known
        What is known about the files; shared with all slices of the series.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.read_series("sample_data/yade_triaxial/triaxial-spheres-*.vtk.gz")
    >>> len(series), series[-1].number, [frame.number for frame in series[2:5]]
    (7, 6, [2, 3, 4])
    >>> [frame.number for frame in series[2:5][1:]]
    [3, 4]
    """

    name: str
    grains: Family
    contacts: tuple[Family, ...] = ()
    contacts_from: ContactsFrom = "auto"
    options: ReadOptions = field(default_factory=ReadOptions)
    cells: FrameFile | None = None
    sources: tuple[str, ...] = field(default=(), repr=False, compare=False)
    numbers: range = range(ENDLESS)
    known: Known = field(default_factory=Known, repr=False, compare=False)

    def __repr__(self) -> str:
        stop = "" if self.numbers.stop >= ENDLESS else self.numbers.stop
        step = "" if self.numbers.step == 1 else f":{self.numbers.step}"
        frames = "" if self.is_whole else f"frames {self.numbers.start}:{stop}{step} of "
        files = f"{counted(len(self.grains.files), 'file')} {Path(self.grains.pattern).name}"
        reader = "" if self.grains.reader is None else f" ({self.grains.reader.name})"
        contacts = ", ".join(Path(family.pattern).name for family in self.contacts)
        more = f", contacts of {contacts}" if contacts else ""
        return f"Series {self.name}: {frames}{files}{reader}{more}"

    def __iter__(self) -> Iterator[Frame]:
        return islice(self._every(), self.numbers.start, self.numbers.stop, self.numbers.step)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __bool__(self) -> bool:
        # without counting the frames
        return next(iter(self), None) is not None

    @overload
    def __getitem__(self, key: SupportsIndex) -> Frame: ...
    @overload
    def __getitem__(self, key: slice) -> Series: ...
    def __getitem__(self, key: SupportsIndex | slice) -> Frame | Series:
        if isinstance(key, slice):
            numbers = self.numbers_of(key)
            if numbers.step < 0:
                order = "frames stay in the order of their steps: list(series)[::-1] goes backwards"
                raise SettingsError(order)
            return self._with(numbers)
        place = index(key)
        frames = list(islice(self, place, place + 1) if place >= 0 else deque(self, -place))
        if not frames or len(frames) < -place:
            count = counted(len(self), "frame")
            raise NoFrameError(
                f"{self.name}: there is no frame {place}: it has {count}, counted from 0"
            )
        return frames[0]

    def _with(self, numbers: range) -> Series:
        """The same series with other numbers of frames."""
        attributes = {attribute.name: getattr(self, attribute.name) for attribute in fields(Series)}
        return Series(**{**attributes, "numbers": numbers})

    def numbers_of(self, frames: slice) -> range:
        """
        The numbers, in the whole series, of a slice of these frames.

        Parameters
        ----------
        frames : slice
            A slice as of a list. The frames are counted only if it counts from their end.

        Returns
        -------
        range
            It may be longer than the series.
        """
        every = self.numbers[: len(self)] if counts_from_end(frames) else self.numbers
        return every[frames]

    def space_of(self, number: int, position: FloatArray, id: IntArray | None = None) -> Space:
        """
        The plane or space in which the particles of the series lie, when one frame has been read.

        Parameters
        ----------
        number : int
            The number of the frame that has been read, in the whole series.
        position : ndarray, shape (N, 3)
            Its centres, dump's length unit.
        id : ndarray, shape (N,), optional
            Its ids, for an error.

        Returns
        -------
        Space
            The space of the first frame with particles. If it is a plane that the user did not ask
            for, a note says so.

        Raises
        ------
        PackingError
            If ``dim`` is 2 and the centres do not lie in a plane, or if they do and those of the
            first frame do not.
        """
        dim = self.options.dim
        if dim == 3:
            return SPACE
        if self.known.space is None:
            before = self._centres_before(0 if number == self.known.reference else number)
            first = next(filter(len, before), position)
            if not len(first):
                return SPACE
            own_id = id if first is position else None
            first_space = flat_space(first, own_id) if dim == 2 else space_of(first)
            if first_space.is_plane and dim == "auto":
                advice = "they are read as discs, in 2D; `dim=3` reads them as spheres"
                where = spelt_plane(first, first_space)
                note(f"{self.name}: all centres lie in {first_space} ({where}): {advice}")
            self.known.space = first_space
        own, decided = space_of(position), self.known.space
        if own.is_plane and not decided.is_plane:
            raise PackingError(f"{other_space(own, decided)}; `dim=2` or `dim=3` chooses for all")
        return decided

    def _centres_before(self, number: int) -> Iterator[FloatArray]:
        """The centres in each frame before a given one; frames that cannot be read are skipped."""
        for frame in islice(self._every(), number):
            with suppress(ReadError):
                yield frame.read_grains().position

    @property
    def whole(self) -> Series:
        """The whole series, of which this may be a slice."""
        return self._with(range(ENDLESS))

    @property
    def is_whole(self) -> bool:
        """Whether this is the whole series, not a slice."""
        return self.numbers == range(ENDLESS)

    def _every(self) -> Iterator[Frame]:
        """All frames of the whole series; a damaged file counts as one frame."""
        number = 0
        for name_step, path in self.grains.files.items():
            problem, frame_data = None, None
            try:
                snapshots = self._snapshots_of(self.grains, path)
                if len(snapshots) == 1 and (frame_data := read_frame(path)) is not None:
                    # without a step in the frame file, numbers in the name are not a step either
                    step, time, stepless = frame_data.step, frame_data.time, frame_data.step is None
                    snapshots = [replace(snapshots[0], step=step, time=time, stepless=stepless)]
            except ReadError as error:
                snapshots, problem = [Snapshot(path)], error
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step, number, frame_data, problem)
                number += 1

    def _snapshots_of(self, family: Family, path: Path) -> list[Snapshot]:
        """The snapshots of a file; the file is searched again if it has changed."""
        assert family.reader is not None
        known, stamp = self.known.snapshots, stamp_of(path) if path.exists() else None
        if path not in known or known[path][0] != stamp:
            with unpacking_up_to(self.options.max_unpacked):
                known[path] = stamp, family.reader.snapshots(path)
        return known[path][1]

    def frames_expected(self) -> int:
        """
        Estimate the number of frames without searching the files for them.

        A file that was not searched yet counts as many frames as the last file that was; if none
        was, it counts one.

        Returns
        -------
        int
        """
        files, known = self.grains.files.values(), self.known.snapshots
        counts = [len(known[path][1]) for path in files if path in known]
        total = sum(counts) + (len(files) - len(counts)) * (counts[-1] if counts else 1)
        return len(range(self.numbers.start, min(self.numbers.stop, total), self.numbers.step))

    def contacts_of(self, frame: Frame, family: Family) -> Snapshot | None:
        """
        Find the contacts of a frame in a family of contact files; None if there are none.

        Grains and contacts are matched by the steps inside the files, or by times if there are no
        steps, or by the numbers in the names of the files. If the user names a single contact file
        for a single grain file, it needs no number.

        Parameters
        ----------
        frame : Frame
            A frame of this series.
        family : Family
            A family of ``contacts``.

        Returns
        -------
        Snapshot or None
        """
        if family.problem is not None:
            raise ReadError(family.problem)
        step = frame.name_step if frame.snapshot.step is None else frame.snapshot.step
        for number in (frame.name_step, step):
            if number in family.files:
                path, is_sure = family.files[number], True
                break
        else:
            if len(family.files) > 1:
                return None
            # the only file may be of another step, unless it has none or the user named it
            ((number, path),) = family.files.items()
            is_named = self.contacts_from == "path" and len(self.grains.files) == 1
            is_sure = is_named or number is None or step is None
        return _of_moment(self._snapshots_of(family, path), frame.snapshot, is_sure)

    def beside(self, path: Path) -> list[Path]:
        """
        The files that are read together with a grain file: companions, its cell, dumps it lists.

        Parameters
        ----------
        path : Path
            A grain file.

        Returns
        -------
        list of Path
        """
        dumps: list[Path] = []
        if self.grains.kind == "index" and self.grains.reader is not None:
            # a missing dump is reported when its frame is read
            with suppress(ReadError):
                listed = dict.fromkeys(dump.path for dump in self.grains.reader.snapshots(path))
                dumps = [file for file in listed if file.is_file()]
        files = [*dumps, *(companion_file(path, kind) for kind in HEADS)]
        if (ask := getattr(self.grains.reader, "beside", None)) is not None:
            files += chain.from_iterable(map(ask, dumps or [path]))
        return [file for file in files if file.is_file() and file != path]

    def files(self, number: int = ENDLESS, known: Container[Path] = ()) -> Iterator[Path]:
        """
        The files of all frames up to a given one, and the files that are read with them.

        Parameters
        ----------
        number : int, optional
            The last frame, in the whole series; the files up to it must have been searched for
            frames. By default all files are given, even contact files without grains.
        known : container of Path, optional
            Files to leave out, with the files that are read with them.

        Yields
        ------
        Path
        """
        if self.cells is not None:
            yield self.cells.path
        last, count = -1, 0
        for step, path in self.grains.files.items():
            if count > number:
                break
            last = max(last, ENDLESS if step is None else step)
            if path not in known:
                yield path
                yield from self.beside(path)
            count += len(self.known.snapshots[path][1]) if path in self.known.snapshots else 1
        for step, path in ((s, p) for family in self.contacts for s, p in family.files.items()):
            if (step is None or step <= last or number == ENDLESS) and path not in known:
                yield path


def counts_from_end(frames: slice) -> bool:
    """Whether a slice counts from the end of a series."""
    return any((bound or 0) < 0 for bound in (frames.start, frames.stop, frames.step))


def _of_moment(snapshots: Sequence[Snapshot], grains: Snapshot, sure: bool) -> Snapshot | None:
    """
    The snapshot of contacts at the step of the grains, or at their time if there are no steps.

    A single snapshot needs neither if the names make it ``sure`` that the files belong together.
    """
    timed = [(s.time, s) for s in snapshots if s.step is None and s.time is not None]
    if grains.step is None and grains.time is not None and timed:
        wanted = grains.time
        time, nearest = min(timed, key=lambda pair: abs(pair[0] - wanted))
        return nearest if abs(time - wanted) <= ROUNDING * abs(wanted) else None
    if len(snapshots) == 1 and None in (snapshots[0].step, grains.step):
        return snapshots[0] if sure else None
    same = [s for s in snapshots if s.step is not None and s.step == grains.step]
    return same[0] if same else None


def other_space(found: Space, decided: Space) -> str:
    """The message about a frame that lies in another plane or space than its series."""
    return (
        f"all its centres lie in {found}, but the first frame that has grains lies in {decided}: "
        f"the frames of a series are all discs in one plane, or all spheres"
    )
