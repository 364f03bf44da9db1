"""A series of frames, read one at a time; pairs the grain file and contact file of a step."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from itertools import chain, islice
from operator import index
from pathlib import Path
from typing import Any, Literal, SupportsIndex, overload

from scanfab.base.errors import NoFrameError, PackingError, ReadError, SettingsError, note
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.io.companions import companion_file, read_frame
from scanfab.io.families import Family
from scanfab.io.files import Stamp, stamp_of, unpacking_up_to
from scanfab.io.frame import Frame
from scanfab.io.layout import FrameFile
from scanfab.io.reader import ReadOptions, Snapshot
from scanfab.packing.packing import flat_space, space_of, spelt_plane

# more frames than there can be: where a slice ends while its frames are not counted
ENDLESS = 2**62
# relative difference of two times that are the same: programs write them with six digits or more
ROUNDING = 2e-6

ContactsFrom = Literal["auto", "beside", "geometric", "path", "grains"]
"""
``auto``: from what the source holds; ``beside``: from what lies beside single grain files;
``path``: from what the user names; ``grains``: from the grain files themselves.
"""


@dataclass
class Known:
    """What has been found out of the files of a series and all its parts."""

    snapshots: dict[Path, tuple[Stamp | None, list[Snapshot]]] = field(default_factory=dict)
    """The snapshots of each file that was looked into, and the state of the file then."""
    space: Space | None = None
    """The space in which the particles of the first frame that has any lie."""


@dataclass
class Series:
    """
    Frames in the order of their steps, read one at a time.

    Iterating gives :class:`Frame` objects; ``frame.read()`` gives the packing. ``series[-1]`` is a
    frame, ``series[2:5]`` the same series with fewer frames: they keep their numbers, and RV,
    ``rmin`` and the initial length stay those of the whole.

    Attributes
    ----------
    name : str
        As the user named it.
    grains : Family
        The files of grains, by step.
    contacts : tuple of Family
        The families of contact files, by step.
    contacts_from : str
        Where contacts come from.
    options : ReadOptions
        What the user tells of the dump.
    cells : FrameFile or None
        A file with the cell of each frame, if the options hold no cell for all frames.
    sources : tuple of str
        The sources that :func:`scanfab.read_series` was given.
    reading : mapping
        The options of :func:`scanfab.read_series`, as a manifest lists them.
    numbers : range
        Which frames of the whole series these are; the series may have fewer.
    dim : str or int
        2 for discs, 3 for spheres, or ``auto``: the first frame that has particles decides.
    known : Known
        What has been found out about the files, shared with all parts of the series.

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
    reading: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    numbers: range = range(ENDLESS)
    dim: str | int = "auto"
    known: Known = field(default_factory=Known, repr=False, compare=False)

    def __repr__(self) -> str:
        stop = "" if self.numbers.stop >= ENDLESS else self.numbers.stop
        step = "" if self.numbers.step == 1 else f":{self.numbers.step}"
        frames = "" if self.is_whole else f"frames {self.numbers.start}:{stop}{step} of "
        files = f"{counted(len(self.grains.files), 'file')} {Path(self.grains.pattern).name}"
        reader = "" if self.grains.reader is None else f" ({self.grains.reader.name})"
        contacts = ", ".join(Path(one.pattern).name for one in self.contacts)
        more = f", contacts of {contacts}" if contacts else ""
        return f"Series {self.name}: {frames}{files}{reader}{more}"

    def __iter__(self) -> Iterator[Frame]:
        return islice(self._every(), self.numbers.start, self.numbers.stop, self.numbers.step)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __bool__(self) -> bool:
        # without counting them
        return next(iter(self), None) is not None

    @overload
    def __getitem__(self, key: SupportsIndex) -> Frame: ...
    @overload
    def __getitem__(self, key: slice) -> Series: ...
    def __getitem__(self, key: SupportsIndex | slice) -> Frame | Series:
        if isinstance(key, slice):
            numbers = self.numbers_of(key)
            if numbers.step < 0:
                told = "frames stay in the order of their steps: list(series)[::-1] goes backwards"
                raise SettingsError(told)
            return self._with(numbers)
        place = index(key)
        found = list(islice(self, place, place + 1) if place >= 0 else deque(self, -place))
        if not found or len(found) < -place:
            raise NoFrameError(f"{self.name}: has {len(self)} frames, there is no frame {place}")
        return found[0]

    def _with(self, numbers: range) -> Series:
        """The same series with other frames."""
        own = {one.name: getattr(self, one.name) for one in fields(Series)}
        return Series(**{**own, "numbers": numbers})

    def numbers_of(self, frames: slice) -> range:
        """
        The numbers, in the whole series, of some of these frames.

        Parameters
        ----------
        frames : slice
            As of a list of these frames. They are counted only where it counts from their end.

        Returns
        -------
        range
            There may be fewer frames than that.
        """
        bounds = (frames.start, frames.stop, frames.step)
        if any(bound is not None and bound < 0 for bound in bounds):
            return self.numbers[: len(self)][frames]
        return self.numbers[frames]

    def space_of(self, number: int, position: FloatArray) -> Space:
        """
        The space in which the particles of all frames lie; one frame is known.

        Parameters
        ----------
        number : int
            Of that frame, in the whole series.
        position : ndarray, shape (N, 3)
            Its centres, dump's length unit.

        Returns
        -------
        Space
            That of the first frame that has particles. If it is a plane that nobody has asked for,
            a note says so.

        Raises
        ------
        PackingError
            If discs are asked for, and these are none; or these are, and the first frame is not.
        """
        if self.dim == 3:
            return SPACE
        if self.known.space is None:
            first = next(filter(len, self._centres_before(number)), position)
            if not len(first):
                return SPACE
            found = flat_space(first) if self.dim == 2 else space_of(first)
            if found.is_plane and self.dim == "auto":
                told = "they are read as discs, in 2D; `dim=3` reads them as spheres"
                where = spelt_plane(first, found)
                note(f"{self.name}: all centres lie in {found} ({where}): {told}")
            self.known.space = found
        own, decided = space_of(position), self.known.space
        if own.is_plane and not decided.is_plane:
            all_one = "`dim=2` reads all as discs, `dim=3` all as spheres"
            raise PackingError(f"{other_space(own, decided)}; {all_one}")
        return decided

    def _centres_before(self, number: int) -> Iterator[FloatArray]:
        """The centres of each frame before one; frames that cannot be read are passed over."""
        for frame in islice(self._every(), number):
            with suppress(ReadError):
                yield frame.read_grains().position

    @property
    def whole(self) -> Series:
        """All frames of the series that these are some of."""
        return self._with(range(ENDLESS))

    @property
    def is_whole(self) -> bool:
        """Whether these are all frames of the series."""
        return self.numbers == range(ENDLESS)

    def _every(self) -> Iterator[Frame]:
        """All frames of the whole series; one in the place of those of a damaged file."""
        number = 0
        for name_step, path in self.grains.files.items():
            problem, told = None, None
            try:
                snapshots = self._snapshots_of(self.grains, path)
                if len(snapshots) == 1 and (told := read_frame(path)) is not None:
                    snapshots = [told.moment_of(snapshots[0])]
            except ReadError as error:
                snapshots, problem = [Snapshot(path)], error
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step, number, told, problem)
                number += 1

    def _snapshots_of(self, family: Family, path: Path) -> list[Snapshot]:
        """The snapshots of a file; it is looked through again if it has changed."""
        assert family.reader is not None
        stamp = stamp_of(path) if path.exists() else None
        if stamp is None or self.known.snapshots.get(path, (None, []))[0] != stamp:
            with unpacking_up_to(self.options.max_unpacked):
                self.known.snapshots[path] = stamp, family.reader.snapshots(path)
        return self.known.snapshots[path][1]

    def frames_expected(self) -> int:
        """
        About how many frames there are, without searching the files for them.

        A file that was not looked into yet is taken to hold as many frames as the last one that
        was; before the first one, one frame.

        Returns
        -------
        int
        """
        files, known = self.grains.files.values(), self.known.snapshots
        met = [len(known[path][1]) for path in files if path in known]
        every = sum(met) + (len(files) - len(met)) * (met[-1] if met else 1)
        return len(range(self.numbers.start, min(self.numbers.stop, every), self.numbers.step))

    def contacts_of(self, frame: Frame, family: Family) -> Snapshot | None:
        """
        The contacts of a frame in a family of contact files; None if there are none.

        Steps inside the files decide, or times if there are no steps; where a file has none, the
        number in its name does. A single contact file that is named for a single grain file needs
        no number.

        Parameters
        ----------
        frame : Frame
            One of this series.
        family : Family
            One of ``contacts``.

        Returns
        -------
        Snapshot or None
        """
        if family.problem is not None:
            raise ReadError(family.problem)
        name_step, step = frame.name_step, frame.snapshot.step
        step = name_step if step is None else step
        only = next(iter(family.files.values())) if len(family.files) == 1 else None
        path = family.files.get(name_step, family.files.get(step, only))
        if path is None:
            return None
        is_numbered = None not in family.files and step is not None
        is_named = self.contacts_from == "path" and len(self.grains.files) == 1
        is_sure = is_named or not is_numbered or bool({name_step, step} & set(family.files))
        return _of_moment(self._snapshots_of(family, path), frame.snapshot, is_sure)

    def beside(self, path: Path) -> list[Path]:
        """
        The files that are read together with a file of grains: its cell, or dumps that it lists.

        Parameters
        ----------
        path : Path
            A file of grains.

        Returns
        -------
        list of Path
        """
        dumps: list[Path] = []
        if self.grains.kind == "index" and self.grains.reader is not None:
            # a missing dump was reported when its frame was read
            with suppress(ReadError):
                listed = [(one.path, *one.parts) for one in self.grains.reader.snapshots(path)]
                dumps = [file for file in dict.fromkeys(chain(*listed)) if file.is_file()]
        companions = [companion_file(path, kind) for kind in ("frame", "columns")]
        found = [*dumps, *(file for file in companions if file.is_file())]
        ask = getattr(self.grains.reader, "beside", None)
        if ask is not None and self.cells is None and self.options.cell is None:
            found += [file for dump in dumps or [path] for file in ask(dump)]
        return found

    def files(self, number: int = ENDLESS, known: Container[Path] = ()) -> Iterator[Path]:
        """
        The files of the frames up to one, and what is read with them.

        Parameters
        ----------
        number : int, optional
            The last frame, in the whole series; all frames up to it have been looked for, as one
            file may hold many. By default every file, also those of contacts without grains.
        known : container of Path, optional
            Files that are left out, with what is read with them.

        Yields
        ------
        Path
        """
        if self.cells is not None:
            yield self.cells.path
        last, met = -1, 0
        for step, path in self.grains.files.items():
            if met > number:
                break
            last = max(last, ENDLESS if step is None else step)
            if path not in known:
                yield path
                yield from self.beside(path)
            met += len(self.known.snapshots[path][1]) if path in self.known.snapshots else 1
        for step, path in ((s, p) for one in self.contacts for s, p in one.files.items()):
            if (step is None or step <= last or number == ENDLESS) and path not in known:
                yield path


def _of_moment(snapshots: Sequence[Snapshot], grains: Snapshot, sure: bool) -> Snapshot | None:
    """
    The snapshot of contacts at the step of some grains, or at their time where there are no steps.

    A single snapshot needs neither if it is ``sure`` by the names that the files belong together.
    """
    timed = [(one.time, one) for one in snapshots if one.step is None and one.time is not None]
    if grains.step is None and grains.time is not None and timed:
        wanted = grains.time
        time, nearest = min(timed, key=lambda pair: abs(pair[0] - wanted))
        return nearest if abs(time - wanted) <= ROUNDING * abs(wanted) else None
    if len(snapshots) == 1 and None in (snapshots[0].step, grains.step):
        return snapshots[0] if sure else None
    same = [one for one in snapshots if one.step is not None and one.step == grains.step]
    return same[0] if same else None


def other_space(found: Space, decided: Space) -> str:
    """What is said of a frame that lies in another space than its series."""
    return (
        f"all its centres lie in {found}, but the first frame that has grains lies in {decided}: "
        f"the frames of a series are all discs in one plane, or all spheres"
    )
