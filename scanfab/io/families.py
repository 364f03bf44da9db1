"""
The files that users name, sorted by their names into families: one family for each series.

The files of a family are of one kind, and their names differ in the step only. Contact files are
paired with grain files by step and name.
"""

from __future__ import annotations

import glob
import os
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from itertools import chain, takewhile
from pathlib import Path

from scanfab.base.errors import ReadError, note, warn
from scanfab.base.files import kind_of
from scanfab.io.files import bare_name
from scanfab.io.reader import FileKind, Reader, ReadOptions, installed_readers, reader_for

PathLike = str | os.PathLike[str]
Numbered = list[tuple[int | None, Path]]
"""Files with the numbers that tell them apart."""

SETTINGS_FILE = "scanfab.toml"
# endings of what editors and interrupted programs leave
LEFTOVERS = ("~", ".part", ".tmp", ".bak")
NUMBER = re.compile(r"\d+")


def expanded(source: PathLike) -> list[PathLike]:
    """What a glob names that stood in quotes, so that no shell expanded it; else the source."""
    if Path(source).exists() or not glob.has_magic(os.fspath(source)):
        return [source]
    found: list[PathLike] = [*sorted(glob.glob(os.fspath(source)))]
    if not found:
        raise ReadError(f"{source}: matches nothing: there is no file or folder of such a name")
    return found


def named_once(sources: Iterable[PathLike]) -> list[PathLike]:
    """Sources as they are spelt, each file and folder once; a warning names the repeated ones."""
    first: dict[Path, PathLike] = {}
    again = []
    for source in chain.from_iterable(map(expanded, sources)):
        if (place := Path(source).resolve()) in first:
            again.append(f"{source}")
        first.setdefault(place, source)
    if again:
        warn(f"{some(again)}: named twice among the sources, and read once")
    return list(first.values())


def some(names: Sequence[str]) -> str:
    """The first five names, and how many more there are."""
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def files_of(path: Path) -> list[Path]:
    """A file, or the files of a folder; a note names the pipes and devices in it."""
    if not path.exists():
        raise ReadError(f"{path}: there is no such file, folder or glob")
    if not path.is_dir():
        return [path]
    for one in sorted(path.iterdir()):
        if (kind := kind_of(one)) is not None:
            note(f"skipped {one}: it is {kind}, not a file")
    return files_in(path)


def files_in(folder: Path) -> list[Path]:
    """The files of a folder that may be dumps: neither hidden nor left behind by an editor."""
    names = [name for name in sorted(os.listdir(folder)) if name != SETTINGS_FILE]
    files = [folder / name for name in names if name[0] != "." and not name.endswith(LEFTOVERS)]
    return [file for file in files if file.is_file()]


def files_around(files: Iterable[Path]) -> list[Path]:
    """All files in the folders of these; a folder that cannot be listed adds none."""
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
    """Whether the numbers are steps; the number in the name of a single file may mean anything."""

    @property
    def largest(self) -> Path:
        """The file that tells reader and kind."""
        return max(self.files.values(), key=lambda file: file.stat().st_size)

    @property
    def is_table(self) -> bool:
        """Whether they are tables, which may hold anything."""
        return bool(getattr(self.reader, "is_table", False))

    @property
    def stems(self) -> set[str]:
        """The STEM of each file, by which ``STEM.contacts.csv`` would name it."""
        return set(map(_own_stem, self.files.values()))

    @property
    def owners(self) -> set[str | None]:
        """The STEM of each file called ``STEM.contacts.csv``; None for files with other names."""
        return set(map(_owner, self.files.values()))


def sort_into_families(
    files: Iterable[Path], options: ReadOptions, groups: Iterable[Numbered] | None = None
) -> list[Family]:
    """
    Sort files into families; the largest file of each tells its reader and kind.

    ``groups`` are those of :func:`group_by_name`, where other files were grouped with these: they
    show which number in a name is the step.
    """
    files = set(files)
    groups = group_by_name(files) if groups is None else groups
    own = [([one for one in group if one[1] in files], len(group) > 1) for group in groups]
    return [_family_of(members, files, options, several) for members, several in own if members]


def group_by_name(*listings: Iterable[Path]) -> list[Numbered]:
    """
    Group all files whose names differ in the step only, in natural order.

    A file that another one of its listing names as one of its parts is left out.
    """
    readers = [offer.plugin for offer in installed_readers().values()]
    listers = [reader for reader in readers if hasattr(reader, "listed_by")]
    patterns: dict[str, list[Path]] = defaultdict(list)
    heads = set[Path]()
    for files in map(set, listings):
        heads |= {file for file in files if not any(r.listed_by(file) in files for r in listers)}
    for file in sorted(heads, key=str):
        patterns[NUMBER.sub("*", bare_name(file))].append(file)
    return [series for _, alike in sorted(patterns.items()) for series in _split(alike)]


def _split(group: list[Path]) -> Iterable[Numbered]:
    """
    Tell series apart whose names differ in several numbers (run1_100, run1_200, run2_100).

    The last number that differs is the step. All files are one series if the numbers before it
    never fall while the step rises, and no step occurs twice.
    """
    numbers = {file: numbers_in(file) for file in group}
    columns = list(zip(*numbers.values(), strict=True))
    differing = [place for place, column in enumerate(columns) if len(set(column)) > 1]
    place = differing[-1] if differing else max(len(columns) - 1, 0)
    group = sorted(group, key=lambda file: (numbers[file][place : place + 1], numbers[file]))
    steps = [next(iter(numbers[file][place:]), None) for file in group]
    leading = [numbers[file][:place] for file in group]
    repeated = len(set(steps)) < len(steps) and len(set(leading)) > 1
    is_one = not repeated and leading == sorted(leading)
    series: dict[tuple[int, ...], Numbered] = defaultdict(list)
    for key, step, file in zip(leading, steps, group, strict=True):
        series[() if is_one else key].append((step, file))
    return series.values()


def numbers_in(file: Path) -> tuple[int, ...]:
    """The numbers in a name, of which one may be the step."""
    # digits in the ending (.mp4) are no step, unless the whole ending is a number (dump.100)
    name = Path(bare_name(file))
    text = name.name if name.suffix[1:].isdigit() else name.stem
    return tuple(map(int, NUMBER.findall(text)))


def _family_of(
    members: Numbered, among: Collection[Path], options: ReadOptions, has_steps: bool
) -> Family:
    """The family of some files; its pattern matches none of the others ``among`` which they are."""
    files: dict[int | None, Path] = {}
    clash = None
    for step, file in members:
        if files.setdefault(step, file) is not file:
            clash = f"two files for one step: {files[step]} and {file}: name one of them"
    pattern = _glob([file for _, file in members], among)
    family = Family(pattern, files, None, "other", None, clash, has_steps)
    reader = None
    try:
        reader = reader_for(family.largest, options)
        kind = "other" if reader is None else reader.kind(family.largest)
    except ReadError as error:
        # a folder is read without its damaged files; of a single file this is the error
        return replace(family, reader=reader, problem=str(error))
    return replace(family, reader=reader, kind=kind)


def _glob(members: list[Path], among: Iterable[Path]) -> str:
    """The names with stars for the numbers that differ; some names if stars match other files."""
    numbers = [NUMBER.findall(file.name) for file in members]
    differs = [len(set(column)) > 1 for column in zip(*numbers, strict=False)]
    pieces = re.split(r"(\d+)", members[0].name)
    others = set(among) - set(members)
    for star in ("*", "[0-9]*"):
        for place, is_other in enumerate(differs):
            if is_other:
                pieces[2 * place + 1] = star
        pattern = str(members[0].with_name("".join(pieces)))
        if not any(fnmatch(str(file), pattern) for file in others):
            return pattern
    return " ".join(map(str, members[:3])) + (" ..." if len(members) > 3 else "")


def _own_stem(file: Path) -> str:
    """The name without its ending; dumps called dump.100 and dump.200 share no stem."""
    name = bare_name(file)
    stem, _, ending = name.rpartition(".")
    return name if ending.isdigit() else stem or name


def _owner(file: Path) -> str | None:
    """STEM of a file called ``STEM.contacts.csv``; None for any other name."""
    stem, ending, _ = bare_name(file).rpartition(".contacts.")
    return stem if ending else None


def _words(family: Family) -> list[str]:
    """The words of the pattern, without its ending."""
    name = re.sub(r"(\.[A-Za-z]\w*)+$", "", bare_name(Path(family.pattern)))
    return re.findall(r"[^\W_]+", name)


def _kinship(one: Family, two: Family) -> tuple[int, bool]:
    """How many words two names begin with in common, and whether they have the same ending."""
    common = takewhile(lambda pair: pair[0] == pair[1], zip(_words(one), _words(two), strict=False))
    endings = {Path(bare_name(Path(family.pattern))).suffix for family in (one, two)}
    return len(list(common)), len(endings) == 1


def are_tied(grains: Family, contacts: Family) -> bool:
    """Whether step or name tell that contacts belong to grains: a number or the first word."""
    shared = set(grains.files) & set(contacts.files) - {None}
    return _kinship(grains, contacts)[0] > 0 or (bool(shared) and not any(contacts.owners))


def without_tables(
    families: Sequence[Family], named: Collection[Path] = (), grains: Family | None = None
) -> list[Family]:
    """
    The families; tables that are neither grains nor contacts get ``other`` as their kind.

    A table beside dumps in a program's own format may hold anything, such as results. It counts if
    the user has ``named`` it, or if it is ``STEM.contacts.csv`` of some grains. Where all are
    tables, one without names of columns counts only if no other table has names. ``grains`` are
    those beside which the families lie.
    """
    chosen = [] if grains is None else [grains]
    frames = [one for one in [*families, *chosen] if one.kind in ("grains", "index")]
    dumps = [one for one in frames if not one.is_table]
    tables = [one for one in frames if one.is_table]
    with_names = [one for one in tables if one.reader and one.reader.recognises(one.largest)]
    stems = set[str | None]().union(*(one.stems for one in [*dumps, *chosen]))

    def counts(one: Family) -> bool:
        if not one.is_table or set(one.files.values()) & set(named):
            return True
        if dumps:
            return bool(one.owners & stems)
        return one.kind != "grains" or one in with_names or not with_names

    return [one if counts(one) else replace(one, kind="other") for one in families]


def contacts_beside(
    grains: Family, groups: Iterable[Numbered], options: ReadOptions
) -> tuple[list[Family], list[Family]]:
    """
    The families that lie beside single grain files with their numbers, and those of their contacts.

    ``STEM.contacts.csv`` belongs to STEM. Another contact file belongs to the grains of its number
    whose names begin with the most words in common with its name; of those with as many, to the one
    with the same ending. Of several contact files, those with the most common words are read. A
    note tells which are, or may be meant.
    """
    if grains.kind == "index":
        return [], []
    families = without_tables(_families_beside(grains, groups, options), (), grains)
    frames = [one for one in families if one.kind in ("grains", grains.kind)]
    rivals = [one for one in frames if _words(one) != _words(grains)]
    candidates = [one for one in families if one.kind == "contacts" and one.clash is None]

    def nearest_rival(contacts: Family) -> tuple[int, bool]:
        return max((_kinship(one, contacts) for one in rivals), default=(-1, False))

    own = [one for one in candidates if one.owners <= grains.stems]
    if not own:
        free = [one for one in candidates if one.owners == {None}]
        near = [one for one in free if _kinship(grains, one) > nearest_rival(one)]
        most = max((_kinship(grains, one)[0] for one in near), default=0)
        own = [one for one in near if _kinship(grains, one)[0] == most]
    doubtful = [
        Path(one.pattern).name for one in candidates if _kinship(grains, one) >= nearest_rival(one)
    ]
    if own:
        note(f"contacts are read from {', '.join(one.pattern for one in own)}, beside the grains")
    elif doubtful:
        told = f"neither step nor name tells that they belong to {grains.pattern}"
        note(f"skipped {some(doubtful)}: contacts, but {told}: if they do, name them by `contacts`")
    return families, own


def _families_beside(
    grains: Family, groups: Iterable[Numbered], options: ReadOptions
) -> list[Family]:
    """Other files in the folders of grain files: of the same numbers, or named as theirs."""
    files = set(grains.files.values())
    others = [group for group in groups if files.isdisjoint(file for _, file in group)]
    around = {*files, *(file for group in others for _, file in group)}
    own = {(file.parent, step) for step, file in grains.files.items()}
    steps = {_own_stem(file): step for step, file in grains.files.items()}
    found = []
    for group in others:
        same = [(steps[stem], file) for _, file in group if (stem := _owner(file) or "") in steps]
        same = same or [(step, file) for step, file in group if (file.parent, step) in own]
        if same:
            found.append(_family_of(same, around, options, len(group) > 1))
    return found
