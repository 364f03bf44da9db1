"""From what users name to files, and from their names to families: one for each series."""

from __future__ import annotations

import glob
import os
import re
import warnings
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import lru_cache
from itertools import chain, zip_longest
from pathlib import Path
from typing import NamedTuple

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning, UnknownFormatError
from scanfab.base.files import kind_of
from scanfab.io.files import bare_name
from scanfab.io.reader import FileKind, Reader, ReadOptions
from scanfab.io.registry import installed_readers, reader_for, reader_named

PathLike = str | os.PathLike[str]

# options of the command line, beside the dumps
SETTINGS_FILE = "scanfab.toml"
# endings of what editors and interrupted programs leave
LEFTOVERS = ("~", ".part", ".tmp", ".bak")
# of a table with the contacts of the grains in the file of the same name without it
CONTACTS_ENDING = ".contacts."
NUMBER = re.compile(r"\d+")


def expanded(source: PathLike) -> list[PathLike]:
    """
    A source as it is spelt, or the files and folders that a glob names.

    The shell leaves globs in quotes to us.
    """
    if Path(source).exists() or not glob.has_magic(os.fspath(source)):
        return [source]
    found: list[PathLike] = [*sorted(glob.glob(os.fspath(source)))]
    if not found:
        raise ReadError(f"{source}: matches nothing: there is no file or folder of such a name")
    return found


def named_once(sources: Iterable[PathLike]) -> list[PathLike]:
    """
    Sources as they are spelt, globs expanded, and each file and folder once.

    Rows that come twice look like two samples, so a warning names what is left out.
    """
    first: dict[Path, PathLike] = {}
    again: list[str] = []
    for source in (path for one in sources for path in expanded(one)):
        place = Path(source).resolve()
        if place in first:
            before = str(first[place])
            again.append(before if str(source) == before else f"{source} (as {before})")
        else:
            first[place] = source
    if again:
        warnings.warn(
            f"{some(again)}: named twice among the sources, and read once",
            ScanfabWarning,
            stacklevel=4,
        )
    return list(first.values())


def some(names: Sequence[str]) -> str:
    """The first five names, and how many more there are."""
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def files_of(path: Path) -> list[Path]:
    """A file, or the files of a folder, of which there is at least one."""
    if not path.exists():
        raise ReadError(f"{path}: there is no such file, folder or glob")
    if not path.is_dir():
        return [path]
    files = files_in(path)
    for one in sorted(set(path.iterdir()).difference(files)):
        if (kind := kind_of(one)) is not None:
            warnings.warn(f"skipped {one}: it is {kind}, not a file", ScanfabNote, stacklevel=3)
    return files


def files_in(folder: Path) -> list[Path]:
    """The files of a folder that may be dumps: not hidden ones, nor what is left behind."""
    files = [
        file
        for file in folder.iterdir()
        if not file.name.startswith(".")
        and file.name != SETTINGS_FILE
        and not file.name.endswith(LEFTOVERS)
        and file.is_file()
    ]
    # to compare names is quicker than to compare paths
    return sorted(files, key=lambda file: file.name)


def files_around(files: Iterable[Path]) -> list[Path]:
    """All files in the folders of some, as far as these can be listed."""
    found: list[Path] = []
    for folder in {file.parent: None for file in files}:
        with suppress(OSError):
            found += files_in(folder)
    return found


@dataclass(frozen=True)
class Family:
    """Files of one kind that differ in the step only."""

    pattern: str
    """A glob for users, such as ``dumps/dump_*.txt``."""
    files: dict[int | None, Path]
    """By the number in the name, in natural order; None for a name without a number."""
    reader: Reader | None
    """None if no reader knows them."""
    kind: FileKind
    problem: str | None = None
    """Why the reader cannot tell what they hold."""
    clash: str | None = None
    """What is wrong with their steps."""
    has_steps: bool = True
    """Whether the numbers are steps: of a single file in its folder nobody knows."""

    def check(self) -> Family:
        """The family itself; ReadError if two files are of the same step."""
        if self.clash is not None:
            raise ReadError(self.clash)
        return self

    @property
    def largest(self) -> Path:
        """The file that tells reader and kind."""
        return max(self.files.values(), key=lambda file: file.stat().st_size)

    @property
    def is_table(self) -> bool:
        """Whether a reader of tables reads them, which may hold anything."""
        return bool(getattr(self.reader, "is_table", False))


class Named(NamedTuple):
    """Files that belong together by their names."""

    files: list[tuple[int | None, Path]]
    """With the number of each that tells it from the others, in natural order."""
    has_steps: bool
    """Whether there are several, so that the number is a step."""


def sort_names(files: Iterable[Path], around: Iterable[Path] = ()) -> list[Named]:
    """
    Sort files by their names alone.

    Parameters
    ----------
    files : iterable of Path
        In any order.
    around : iterable of Path, optional
        Others in their folders, which show what number is the step.
    """
    own = _heads(files)
    groups: dict[str, list[Path]] = defaultdict(list)
    for file in {*own, *_heads(around)}:
        groups[NUMBER.sub("*", bare_name(file))].append(file)
    found = [
        (len(series) > 1, [(step, file) for step, file in series if file in own])
        for _, group in sorted(groups.items())
        for series in _series_in(group)
    ]
    return [Named(series, has_steps) for has_steps, series in found if series]


def _heads(files: Iterable[Path]) -> set[Path]:
    """The files without those that another one of them lists as its parts."""
    heads = set(files)
    readers = [one.plugin for one in installed_readers().values()]
    for reader in [one for one in readers if hasattr(one, "listed_by")]:
        heads -= {file for file in heads if reader.listed_by(file) in heads}
    return heads


def _series_in(group: list[Path]) -> Iterator[list[tuple[int | None, Path]]]:
    """
    Tell series apart whose names differ in several numbers (run1_100, run1_200, run2_100).

    The last number that differs is the step. All files are one series if the numbers before it
    never fall while the step rises, and no step occurs twice.
    """
    numbers = {file: _numbers(file) for file in group}
    columns = list(zip(*numbers.values(), strict=True))
    differing = [place for place, column in enumerate(columns) if len(set(column)) > 1]
    place = differing[-1] if differing else max(len(columns) - 1, 0)
    ordered = sorted(group, key=lambda file: (numbers[file][place : place + 1], numbers[file]))
    steps = [next(iter(numbers[file][place:]), None) for file in ordered]
    leading = [numbers[file][:place] for file in ordered]
    repeated = len(set(steps)) < len(steps) and len(set(leading)) > 1
    series = defaultdict(list)
    for key, step, file in zip(leading, steps, ordered, strict=True):
        series[() if not repeated and leading == sorted(leading) else key].append((step, file))
    yield from series.values()


@lru_cache(1 << 16)
def _numbers(file: Path) -> tuple[int, ...]:
    # the ending of a name (.mp4) is not a number of the frame, unless it is nothing else (dump.100)
    name = Path(bare_name(file))
    text = name.name if name.suffix[1:].isdigit() else name.stem
    return tuple(int(number) for number in NUMBER.findall(text))


def names_a_step(file: Path) -> bool:
    """Whether a number in a file's name may be taken for its step, if the file has none itself."""
    return bool(_numbers(file))


def sort_into_families(
    files: Iterable[Path],
    format: str | None,
    options: ReadOptions | None = None,
    around: Iterable[Path] = (),
) -> list[Family]:
    """
    Sort files into families, and find the reader and kind of each by its largest file.

    Parameters
    ----------
    files : iterable of Path
        In any order.
    format : str, optional
        Name of the reader to use for all.
    options : ReadOptions, optional
        What the user tells of them.
    around : iterable of Path, optional
        Other files in their folders.

    Raises
    ------
    UnknownFormatError
        If there is no reader of that name.
    """
    files = list(files)
    return [family_of(one, files, format, options) for one in sort_names(files, around)]


def family_of(
    named: Named, among: Sequence[Path], format: str | None, options: ReadOptions | None
) -> Family:
    """The family of some files; its pattern matches no other file ``among`` which they were."""
    files: dict[int | None, Path] = {}
    clash: str | None = None
    for step, file in named.files:
        if files.setdefault(step, file) is not file:
            clash = f"two files for one step: {files[step]} and {file}: name one of them"
    pattern = _glob([file for _, file in named.files], among)
    family = Family(pattern, files, None, "other", None, clash, named.has_steps)
    sample, problem, kind = family.largest, None, family.kind
    reader: Reader | None = None
    try:
        reader = reader_for(sample, options) if format is None else reader_named(format, options)
        kind = "other" if reader is None else reader.kind(sample)
    except UnknownFormatError:
        raise
    except ReadError as error:
        # in a folder one damaged file is skipped; alone it is the error
        problem = str(error)
    return Family(pattern, files, reader, kind, problem, clash, named.has_steps)


def _glob(members: list[Path], files: Sequence[Path]) -> str:
    """
    The names, with a star for each number in which they differ.

    If that would match other files too, the names themselves.
    """
    numbers = [NUMBER.findall(file.name) for file in members]
    differs = [len(set(column)) > 1 for column in zip(*numbers, strict=False)]
    letters = NUMBER.split(members[0].name)
    others = set(files) - set(members)
    for star in ("*", "[0-9]*"):
        shown = zip_longest(numbers[0], differs)
        words = [star if is_other else number for number, is_other in shown]
        name = "".join(chain(*zip_longest(letters, words, fillvalue="")))
        pattern = str(members[0].with_name(name))
        if not any(fnmatch(str(file), pattern) for file in others):
            return pattern
    return " ".join(map(str, members[:3])) + (" ..." if len(members) > 3 else "")


def own_stem(file: Path) -> str:
    """The stem by which contacts name a file; dumps called dump.100 and dump.200 share no stem."""
    name = bare_name(file)
    stem, _, ending = name.rpartition(".")
    return name if ending.isdigit() else stem or name


def owner(file: Path) -> str | None:
    """The stem of the file whose contacts these are by their name; None if it does not say so."""
    stem, ending, _ = bare_name(file).rpartition(CONTACTS_ENDING)
    return stem if ending else None


def kinship(one: Family, two: Family) -> tuple[int, bool]:
    """How many words two names begin with in common, and whether they have the same ending."""
    (own, ending), (others, other_ending) = words_of(one), words_of(two)
    pairs = enumerate(zip(own, others, strict=False))
    common = next((k for k, (a, b) in pairs if a != b), min(len(own), len(others)))
    return common, ending == other_ending


def are_tied(grains: Family, contacts: Family) -> bool:
    """Whether step or name tell that contacts belong to grains: a number or the first word."""
    shared = set(grains.files) & set(contacts.files) - {None}
    is_owned = any(map(owner, contacts.files.values()))
    return kinship(grains, contacts)[0] > 0 or (bool(shared) and not is_owned)


def words_of(family: Family) -> tuple[list[str], str]:
    """The words of a pattern, and its ending."""
    name = bare_name(Path(family.pattern))
    ending = "".join(re.findall(r"\.[A-Za-z]\w*$", name))
    return re.findall(r"[^\W_]+", name.removesuffix(ending)), ending
