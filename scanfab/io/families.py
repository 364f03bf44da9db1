"""
Sort the files that users name into families: one family for each series.

The files of a family are of one kind, and their names differ only in the step. Contact files are
paired with grain files by step and name.
"""

from __future__ import annotations

import glob
import os
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from itertools import chain, takewhile
from pathlib import Path

from scanfab.base.errors import ReadError, note, warn
from scanfab.io.files import bare_name
from scanfab.io.reader import FileKind, Reader, ReadOptions, installed_readers, reader_for

PathLike = str | os.PathLike[str]
Numbered = list[tuple[int | None, Path]]
"""Files with the number in each name that is its step; None for a name without a number."""

SETTINGS_FILE = "scanfab.toml"
# endings of files that editors and interrupted programs leave behind, and of companion files
LEFTOVERS = ("~", ".part", ".tmp", ".bak", ".contacts.csv")
NUMBER = re.compile(r"\d+")


def expanded(source: PathLike) -> list[PathLike]:
    """The paths that a quoted glob matches (no shell expanded it); any other source as it is."""
    if not os.fspath(source):
        raise ReadError("'': expected the name of a folder or file, found an empty name")
    if Path(source).exists() or not glob.has_magic(os.fspath(source)):
        return [source]
    paths: list[PathLike] = [*sorted(glob.glob(os.fspath(source)))]
    if not paths:
        raise ReadError(f"{source}: matches nothing: there is no file or folder of this name")
    return paths


def named_once(sources: Iterable[PathLike]) -> list[PathLike]:
    """The sources, each file and folder once; a warning names those that are given twice."""
    first: dict[Path, PathLike] = {}
    again = []
    for source in chain.from_iterable(map(expanded, sources)):
        if (place := Path(source).resolve()) in first:
            again.append(f"{source}")
        first.setdefault(place, source)
    if again:
        warn(f"{some(again)}: named twice among the sources, but read once")
    return list(first.values())


def some(names: Sequence[str]) -> str:
    """The first five names, and how many more there are."""
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def files_of(path: Path) -> list[Path]:
    """The file itself, or the files of a folder; a note names skipped pipes and devices."""
    if not path.exists():
        raise ReadError(f"{path}: there is no such file, folder or glob")
    return files_in(path) if path.is_dir() else [path]


def files_in(folder: Path) -> list[Path]:
    """The files of a folder that may be dumps; hidden files and leftovers are left out."""
    names = [name for name in sorted(os.listdir(folder)) if name != SETTINGS_FILE]
    files = [folder / name for name in names if name[0] != "." and not name.endswith(LEFTOVERS)]
    return [file for file in files if file.is_file()]


@dataclass(frozen=True)
class Family:
    """Files of one kind whose names differ only in the step."""

    pattern: str
    """A glob that matches the files, for messages: ``dumps/dump_*.txt``."""
    files: dict[int | None, Path]
    """The files by the number in the name, in natural order; None if a name has no number."""
    reader: Reader | None
    """The reader of the files; None if no reader knows them."""
    kind: FileKind
    problem: str | None = None
    """Why the reader cannot tell what the files hold."""
    clash: str | None = None
    """What is wrong with the steps of the files."""
    has_steps: bool = True
    """Whether the numbers are steps; in the name of a single file a number may mean anything."""

    @property
    def largest(self) -> Path:
        """The largest file; it decides the reader and the kind of the family."""
        return max(self.files.values(), key=lambda file: file.stat().st_size)

    @property
    def is_table(self) -> bool:
        """Whether the files are general tables, which may hold anything."""
        return bool(getattr(self.reader, "is_table", False))


def sort_into_families(
    files: Collection[Path], options: ReadOptions, groups: Iterable[Numbered]
) -> list[Family]:
    """
    Sort files into families; the largest file of each family decides its reader and kind.

    ``groups`` come from :func:`group_by_name`. They may hold further files, which help to find the
    number in a name that is the step.
    """
    files = set(files)
    chosen = [([pair for pair in group if pair[1] in files], len(group) > 1) for group in groups]
    return [_family_of(members, files, options, several) for members, several in chosen if members]


def group_by_name(*listings: Iterable[Path]) -> list[Numbered]:
    """
    Group all files whose names differ only in the step, in natural order.

    A file is left out if another file of its listing lists it as one of its parts.
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
    Separate series whose names differ in several numbers (run1_100, run1_200, run2_100).

    The last number that differs is the step. All files form one series if the numbers before the
    step never fall while the step rises, and no step occurs twice.
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
    """The numbers in a file name; one of them may be the step."""
    # digits in the ending (.mp4) are not a step, unless the ending is a number (dump.100)
    name = Path(bare_name(file))
    text = name.name if name.suffix[1:].isdigit() else name.stem
    return tuple(map(int, NUMBER.findall(text)))


def _family_of(
    members: Numbered, among: Collection[Path], options: ReadOptions, has_steps: bool
) -> Family:
    """The family of some files; its pattern matches no other file in ``among``."""
    files: dict[int | None, Path] = {}
    clash = None
    for step, file in members:
        if files.setdefault(step, file) is not file:
            clash = f"two files for one step: {files[step]} and {file}: name one of them"
    pattern = _glob([file for _, file in members], among)
    family = Family(pattern, files, None, "other", None, clash, has_steps)
    try:
        family = replace(family, reader=reader_for(family.largest, options))
        return replace(family, kind=family.reader.kind(family.largest)) if family.reader else family
    except ReadError as error:
        # kept, not raised: a folder is read without its damaged files
        return replace(family, problem=str(error))


def in_one_series(families: Sequence[Family]) -> Family:
    """Files that were named one by one, of one reader, as one series in natural order."""
    files = [file for family in families for file in family.files.values()]

    def natural(file: Path) -> list[int | str]:
        # texts and numbers alternate, so that two names compare texts with texts
        return [int(w) if w.isdigit() else w for w in re.split(r"(\d+)", str(file))]

    ordered = dict[int | None, Path](enumerate(sorted(files, key=natural)))
    return replace(
        families[0],
        pattern=some(list(map(str, ordered.values()))),
        files=ordered,
        has_steps=False,
        clash=None,
    )


def _glob(members: list[Path], among: Iterable[Path]) -> str:
    """A glob with stars for the numbers that differ; a list of names if it matches other files."""
    numbers = [NUMBER.findall(file.name) for file in members]
    differs = [len(set(column)) > 1 for column in zip(*numbers, strict=False)]
    pieces = re.split(r"(\d+)", members[0].name)
    others = set(among) - set(members)
    for star in ("*", "[0-9]*"):
        for place, is_other in enumerate(differs):
            if is_other:
                pieces[2 * place + 1] = star
        pattern = os.path.join(glob.escape(f"{members[0].parent}"), "".join(pieces))
        if not any(fnmatch(str(file), pattern) for file in others):
            return pattern
    return " ".join(map(str, members[:3])) + (" ..." if len(members) > 3 else "")


def _words(family: Family) -> list[str]:
    """The words in the name of the files, without the ending."""
    name = re.sub(r"(\.[A-Za-z]\w*)+$", "", bare_name(Path(family.pattern)))
    return re.findall(r"[^\W_]+", name)


def _kinship(one: Family, two: Family) -> tuple[int, bool]:
    """The number of first words that two names share, and whether their endings are the same."""
    common = takewhile(lambda pair: pair[0] == pair[1], zip(_words(one), _words(two), strict=False))
    endings = {Path(bare_name(Path(family.pattern))).suffix for family in (one, two)}
    return len(list(common)), len(endings) == 1


def are_tied(grains: Family, contacts: Family) -> bool:
    """Whether contacts surely belong to grains: they share the first word, or a step."""
    shared = set(grains.files) & set(contacts.files) - {None}
    return _kinship(grains, contacts)[0] > 0 or bool(shared)


def without_tables(families: Sequence[Family], named: Collection[Path]) -> list[Family]:
    """
    The families, in which tables that do not count as dumps get the kind ``other``.

    A table beside dumps in a program's own format may hold anything, for instance results. It
    counts if the user has ``named`` it. If all files are tables, a table without names of columns
    counts only if no table has names.
    """
    frames = [family for family in families if family.kind in ("grains", "index")]
    dumps = [family for family in frames if not family.is_table]
    tables = [family for family in frames if family.is_table]
    with_names = [one for one in tables if one.reader and one.reader.recognises(one.largest)]

    def counts(family: Family) -> bool:
        if not family.is_table or set(family.files.values()) & set(named):
            return True
        return not dumps and (family.kind != "grains" or family in with_names or not with_names)

    return [family if counts(family) else replace(family, kind="other") for family in families]


def contacts_beside(
    grains: Family, groups: Iterable[Numbered], options: ReadOptions
) -> tuple[list[Family], list[Family]]:
    """
    The families in the folders of single grain files, and which of them are their contacts.

    A contact file belongs to the grain files of its number whose names share the most first words
    with its name; between equals the same ending decides. Of several contact files, those that
    share the most words are read. A note names the contact files that are read, or that may belong
    to the grains.
    """
    if grains.kind == "index":
        return [], []
    files = set(grains.files.values())
    moments = {(file.parent, step) for step, file in grains.files.items()}
    others = [group for group in groups if files.isdisjoint(file for _, file in group)]
    same = [file for group in others for step, file in group if (file.parent, step) in moments]
    *families, _ = without_tables([*sort_into_families(same, options, others), grains], ())
    frames = [family for family in families if family.kind in ("grains", grains.kind)]
    rivals = [family for family in frames if _words(family) != _words(grains)]
    candidates = [one for one in families if one.kind == "contacts" and one.clash is None]

    def nearest_rival(contacts: Family) -> tuple[int, bool]:
        return max((_kinship(rival, contacts) for rival in rivals), default=(-1, False))

    near = [family for family in candidates if _kinship(grains, family) > nearest_rival(family)]
    most = max((_kinship(grains, family)[0] for family in near), default=0)
    own = [family for family in near if _kinship(grains, family)[0] == most]
    doubtful = [one for one in candidates if _kinship(grains, one) >= nearest_rival(one)]
    if own:
        patterns = ", ".join(family.pattern for family in own)
        note(f"contacts are read from {patterns}, beside the grains")
    elif doubtful:
        names = some([Path(family.pattern).name for family in doubtful])
        doubt = f"neither step nor name shows that these contacts belong to {grains.pattern}"
        note(f"skipped {names}: {doubt}; if they do, name the files with `contacts`")
    return families, own
