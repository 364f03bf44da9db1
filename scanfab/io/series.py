"""A series of frames, read one at a time; pairs the grain file and contact file of a step."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path
from typing import Any, Literal, SupportsIndex, overload

from scanfab.base.errors import NoFrameError, ReadError, SettingsError
from scanfab.base.space import SPACE, Space
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.io.beside import columns_file, frame_file, read_frame
from scanfab.io.dimension import decided_space, refuse_other_space
from scanfab.io.families import Family
from scanfab.io.files import unpacking_up_to
from scanfab.io.frame import Frame
from scanfab.io.frame_csv import FrameFile
from scanfab.io.reader import ReadOptions, Snapshot

# size and time of a file, which change with its content; None if nobody can tell
_Stamp = tuple[int, int] | None
# more frames than there can be: the end of frames that nobody has counted
ENDLESS = 2**62
# relative difference of two times that are the same: programs write them with six digits or more
ROUNDING = 2e-6

ContactsFrom = Literal["auto", "beside", "geometric", "path", "grains"]
"""
``auto``: from what the source holds; ``beside``: from what lies beside single grain files;
``path``: from what the user names; ``grains``: from the grain files themselves.
"""


@dataclass(frozen=True)
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
        The files of contacts, likewise.
    contacts_from : str
        Where contacts come from.
    options : ReadOptions
        What the user tells of the dump.
    cells : FrameFile or None
        The cell of each frame, in the place of one for all in the options.
    sources : tuple of str
        What :func:`scanfab.read_series` was given.
    reading : mapping
        Its options, as a manifest lists them.
    numbers : range
        Which frames of the whole series these are; there may be fewer.
    dim : str or int
        2 of discs, 3, or ``auto``: as the first frame that has particles has them.

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
    # a file that holds the contacts of many frames is indexed once
    _contact_snapshots: dict[Path, list[Snapshot]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _met: dict[Path, tuple[_Stamp, list[Snapshot]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    """The frames of the grain files that were looked into, and how these files were then."""
    _spaces: list[Space] = field(default_factory=list, init=False, repr=False, compare=False)
    """One, once it is known."""

    def __getstate__(self) -> dict[str, Any]:
        # another process that computes a frame need not know where all others are
        return {**self.__dict__, "_met": {}}

    def __repr__(self) -> str:
        grains, every = self.grains, all(path in self._met for path in self.grains.files.values())
        number = (
            counted(self.frames_expected(), "frame")
            if every
            else f"{counted(len(grains.files), 'file')} (frames not counted)"
        )
        if not self.is_whole:
            stop = "" if self.numbers.stop >= ENDLESS else self.numbers.stop
            step = "" if self.numbers.step == 1 else f":{self.numbers.step}"
            number = f"frames {self.numbers.start}:{stop}{step}"
        name = "" if grains.reader is None else f" ({grains.reader.name})"
        contacts = ", ".join(Path(one.pattern).name for one in self.contacts)
        return (
            f"Series {self.name}: {number} of {Path(grains.pattern).name}{name}"
            f"{f', contacts of {contacts}' if contacts else ''}"
        )

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
            return self._part(key)
        if not hasattr(key, "__index__"):
            raise TypeError(f"a frame of a series is named by a number or a slice, not by {key!r}")
        place = key.__index__()
        if place >= 0:
            found = next(islice(self, place, None), None)
        else:
            last = deque(self, maxlen=-place)
            found = last[0] if len(last) == -place else None
        if found is None:
            raise NoFrameError(f"{self.name}: has {len(self)} frames, there is no frame {place}")
        return found

    def _part(self, frames: slice) -> Series:
        numbers = self.numbers_of(frames)
        if numbers.step < 0:
            raise SettingsError(
                "the frames of a series stay in the order of their steps, found a step below 0: "
                "list(series)[::-1] goes backwards"
            )
        return self._with(numbers)

    def _with(self, numbers: range) -> Series:
        """Other frames of the same series; what is known of its files is known to both."""
        other = object.__new__(Series)
        vars(other).update({**vars(self), "numbers": numbers})
        return other

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
        In which space the particles of all frames lie, when those of one are known.

        Parameters
        ----------
        number : int
            Of that frame, in the whole series.
        position : ndarray, shape (N, 3)
            Its centres, dump's length unit.

        Returns
        -------
        Space
            That of the first frame that has particles.

        Raises
        ------
        PackingError
            If discs are asked for, and these are none; or these are, and the first frame is not.
        """
        if self.dim == 3:
            return SPACE
        if not self._spaces:
            first = next(filter(len, self._centres_before(number)), position)
            if not len(first):
                return SPACE
            self._spaces.append(decided_space(self.name, first, self.dim))
        refuse_other_space(position, self._spaces[0])
        return self._spaces[0]

    def _centres_before(self, number: int) -> Iterator[FloatArray]:
        """Of the frames before one, as far as they can be read."""
        for frame in islice(self._every(), number):
            with suppress(ReadError):
                yield frame.centres()

    @property
    def whole(self) -> Series:
        """All frames of the series that these are some of."""
        return self._with(range(ENDLESS))

    @property
    def is_whole(self) -> bool:
        """Whether these are all frames of the series."""
        return self.numbers == range(ENDLESS)

    def _every(self) -> Iterator[Frame]:
        """All frames of the whole series."""
        number = 0
        for name_step, path in self.grains.files.items():
            snapshots, problem = self._look_into(path)
            for snapshot in snapshots:
                yield Frame(self, snapshot, name_step, number, problem)
                number += 1

    def _look_into(self, path: Path) -> tuple[list[Snapshot], ReadError | None]:
        """
        The frames of a grain file, or one in their place and what is wrong with the file.

        A file is looked through once for as long as it stays as it is.
        """
        assert self.grains.reader is not None
        stamp = _stamp(path)
        before, snapshots = self._met.get(path, (None, []))
        if stamp is not None and stamp == before:
            return snapshots, None
        problem: ReadError | None = None
        try:
            with unpacking_up_to(self.options.max_unpacked):
                snapshots = self.grains.reader.snapshots(path)
            if len(snapshots) == 1 and (told := read_frame(path)) is not None:
                snapshots = [told.moment_of(snapshots[0])]
        except ReadError as error:
            stamp, snapshots, problem = None, [Snapshot(path)], error
        self._met[path] = stamp, snapshots
        return snapshots, problem

    def frames_expected(self) -> int:
        """
        About how many frames there are, without looking for them.

        Files that nobody has looked into yet count as many as the last one that was, at first one.

        Returns
        -------
        int
        """
        met = [len(snapshots) for _, snapshots in self._met.values()]
        every = sum(met) + (len(self.grains.files) - len(met)) * (met[-1] if met else 1)
        return len(range(self.numbers.start, min(self.numbers.stop, every), self.numbers.step))

    def _contacts_of(
        self, grains: Snapshot, name_step: int | None, family: Family, named: bool
    ) -> Snapshot | None:
        """
        The contacts of a grain snapshot in a family of contact files; None if there are none.

        Steps inside the files decide, or times if there are no steps; where a file has none, the
        number in its name does. If a single contact file was ``named`` for a single grain file, it
        needs no number.
        """
        step = name_step if grains.step is None else grains.step
        path = family.files.get(name_step, family.files.get(step))
        if path is None and len(family.files) == 1:
            path = next(iter(family.files.values()))
        if path is None:
            return None
        if path not in self._contact_snapshots:
            assert family.reader is not None
            with unpacking_up_to(self.options.max_unpacked):
                self._contact_snapshots[path] = family.reader.snapshots(path)
        numbered = None not in family.files and step is not None
        sure = named or not numbered or bool({name_step, step} & set(family.files))
        return _of_moment(self._contact_snapshots[path], grains, sure)

    def beside(self, path: Path) -> list[Path]:
        """
        What is read with a file of grains: its cell, or the dumps that an index names.

        Parameters
        ----------
        path : Path
            A file of grains.

        Returns
        -------
        list of Path
        """
        told = [file for file in (frame_file(path), columns_file(path)) if file.is_file()]
        listed = [*(self._listed(path) if self.grains.kind == "index" else ()), *told]
        ask = getattr(self.grains.reader, "beside", None)
        if ask is None or self.cells is not None or self.options.cell is not None:
            return listed
        dumps = [one for one in listed if one not in told] or [path]
        return [*listed, *(file for one in dumps for file in ask(one))]

    def _listed(self, index: Path) -> list[Path]:
        """The dumps of an index that are there; a frame that is not has been told of."""
        assert self.grains.reader is not None
        with suppress(ReadError):
            files = [(one.path, *one.parts) for one in self.grains.reader.snapshots(index)]
            return [path for path in dict.fromkeys(chain(*files)) if path.is_file()]
        return []

    def files_through(self, number: int) -> Iterator[tuple[Path, bool]]:
        """
        The files of the frames up to one.

        All of these frames have been looked for: one file may hold many.

        Parameters
        ----------
        number : int
            The last frame, in the whole series.

        Yields
        ------
        path : Path
            Each file.
        is_grains : bool
            Whether it holds grains.
        """
        steps, met = [], 0
        for step, path in self.grains.files.items():
            steps.append(step)
            yield path, True
            met += len(self._met[path][1]) if path in self._met else 1
            if met > number:
                break
        last = max((step for step in steps if step is not None), default=None)
        for family in self.contacts:
            for step, path in family.files.items():
                if step is None or last is None or step <= last:
                    yield path, False

    def files(self) -> Iterator[Path]:
        """
        Every file that the frames come from.

        Yields
        ------
        Path
        """
        for family in (self.grains, *self.contacts):
            yield from family.files.values()
        for path in self.grains.files.values():
            yield from self.beside(path)
        if self.cells is not None:
            yield self.cells.path


def _stamp(path: Path) -> _Stamp:
    with suppress(OSError):
        return (found := path.stat()).st_size, found.st_mtime_ns
    return None


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
