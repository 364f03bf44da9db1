"""Files sorted into families: names that differ in their numbers only, in natural order."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import lru_cache
from pathlib import Path

from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.io.files import bare_name
from scanfab.io.reader import FileKind, Reader, ReadOptions
from scanfab.io.registry import installed_readers, reader_for, reader_named

# options of the command line, beside the dumps
SETTINGS_FILE = "scanfab.toml"
# of a table with the contacts of the grains in the file of the same name without it
CONTACTS_ENDING = ".contacts."
# endings of what editors and interrupted programs leave
LEFTOVERS = ("~", ".part", ".tmp", ".bak")
NUMBER = re.compile(r"\d+")


@dataclass(frozen=True)
class Family:
    """Files of one kind that differ in the step only."""

    pattern: str
    """A glob for users, such as ``dumps/dump_*.txt``."""
    files: dict[int | None, Path]
    """By the step in the name, in natural order; None for a name without a number."""
    reader: Reader | None
    """None if no reader knows them."""
    kind: FileKind
    problem: str | None = None
    """Why the reader cannot tell what they hold."""
    clash: str | None = None
    """What is wrong with their steps."""

    def check(self) -> Family:
        """The family itself; ReadError if two files are of the same step."""
        if self.clash is not None:
            raise ReadError(self.clash)
        return self


def sort_into_families(
    files: Sequence[Path], format: str | None, options: ReadOptions | None = None
) -> list[Family]:
    """
    Sort files into families, and find the reader and kind of each by its largest file.

    Parameters
    ----------
    files : sequence of Path
        In any order.
    format : str, optional
        Name of the reader to use for all.
    options : ReadOptions, optional
        What the user tells of them.

    Raises
    ------
    UnknownFormatError
        If there is no reader of that name.
    """
    return [
        _family(_by_step(members), members, _glob(members, files), format, options)
        for members in _groups(_heads(files, format))
    ]


def _heads(files: Sequence[Path], format: str | None) -> Sequence[Path]:
    """The files without those that another one of them lists as its parts."""
    readers = installed_readers()
    named = readers.values() if format not in readers else [readers[format]]
    for ask in [one.plugin.listed_by for one in named if hasattr(one.plugin, "listed_by")]:
        there = set(files)
        files = [file for file in files if ask(file) not in there]
    return files


def _groups(files: Sequence[Path]) -> list[list[Path]]:
    """The files of each family, in the order of their steps, by their names alone."""
    groups: dict[str, list[Path]] = defaultdict(list)
    for file in files:
        groups[NUMBER.sub("*", bare_name(file))].append(file)
    return [members for _, group in sorted(groups.items()) for members in _split(group)]


def _by_step(members: list[Path]) -> list[tuple[int | None, Path]]:
    place = _place(members)
    return [(next(iter(_numbers(file)[place:]), None), file) for file in members]


def families_beside(
    grains: Family, format: str | None, options: ReadOptions | None = None
) -> list[Family]:
    """
    Other families in the folders of some grain files, with the files of the same steps only.

    Their files go by the same keys as the grain files. ``STEM.contacts.csv`` is of the file STEM,
    whatever number in it differs from those of others.
    """
    keys: dict[Path, dict[Path, int | None]] = defaultdict(dict)
    for key, file in grains.files.items():
        keys[file.parent][file] = key
    found: dict[str, list[tuple[int | None, Path]]] = defaultdict(list)
    for folder, own in keys.items():
        files = files_in(folder)
        groups = _groups(_heads(files, format))
        wanted = {
            step: own[file] for group in groups for step, file in _by_step(group) if file in own
        }
        stems = {_own_stem(file): key for file, key in own.items()}
        for group in groups:
            same = [(wanted[step], file) for step, file in _by_step(group) if step in wanted]
            # a name that says whose contacts they are goes before the numbers in it
            named = [(stems[stem], file) for file in group if (stem := _owner(file)) in stems]
            if not set(named) <= set(same):
                same, group = named, [file for _, file in named]
            if same and not own.keys() & set(group):
                found[_glob(group, files)] += same
    return [
        _family(files, [file for _, file in files], pattern, format, options)
        for pattern, files in found.items()
    ]


def set_tables_aside(
    families: Sequence[Family], named: Collection[Path] = (), grains: Family | None = None
) -> list[Family]:
    """
    The families, with ``other`` as the kind of tables that lie beside dumps.

    A table may be anything: results, or what somebody made of the dumps. Beside grains of a
    program's own format, one counts if users name it, or if it is ``STEM.contacts.csv`` of a file
    of grains.

    Parameters
    ----------
    families : sequence of Family
        Of one source.
    named : collection of Path
        Files that the user names one by one.
    grains : Family, optional
        Those that are sure, if the families are others.
    """
    own = [] if grains is None else [grains]
    sure = [
        family
        for family in [*families, *own]
        if family.kind in ("grains", "index") and not _is_table(family)
    ]
    if not sure:
        return _guesses_aside(families, named)
    files = [file for one in [*sure, *own] for file in one.files.values()]
    stems = {bare_name(file).rpartition(".")[0] for file in files}
    return [
        family
        if not _is_table(family)
        or any(file in named or _owner(file) in stems for file in family.files.values())
        else replace(family, kind="other")
        for family in families
    ]


def _guesses_aside(families: Sequence[Family], named: Collection[Path]) -> list[Family]:
    """The same of tables without names beside tables that have some."""
    guesses = [
        one
        for one in families
        if one.kind == "grains"
        and one.reader is not None
        and _is_table(one)
        and not one.reader.recognises(next(iter(one.files.values())))
    ]
    are_sure = any(one.kind == "grains" and one not in guesses for one in families)
    return [
        replace(one, kind="other")
        if are_sure and one in guesses and not set(named) & set(one.files.values())
        else one
        for one in families
    ]


def _is_table(family: Family) -> bool:
    return bool(getattr(family.reader, "is_table", False))


def _own_stem(file: Path) -> str:
    """The stem by which contacts name a file; dumps called dump.100 and dump.200 share no stem."""
    name = bare_name(file)
    stem, _, ending = name.rpartition(".")
    return name if ending.isdigit() else stem or name


def _owner(file: Path) -> str | None:
    """The stem of the file whose contacts these are by their name; None if it does not say so."""
    stem, ending, _ = bare_name(file).rpartition(CONTACTS_ENDING)
    return stem if ending else None


def contacts_beside(
    grains: Family, format: str | None, options: ReadOptions | None = None
) -> tuple[list[Family], list[Family]]:
    """The contact files in the folder of single grain files: their own, and those in doubt."""
    if grains.kind == "index":
        return [], []
    beside = set_tables_aside(families_beside(grains, format, options), (), grains)
    rivals = [family for family in beside if family.kind in ("grains", grains.kind)]
    contacts = [family for family in beside if family.kind == "contacts" and family.clash is None]
    return own_contacts(grains, rivals, contacts)


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


def own_contacts(
    grains: Family, rivals: Sequence[Family], contacts: Sequence[Family]
) -> tuple[list[Family], list[Family]]:
    """
    Which families of contact files belong to a family of grains, and of which it is in doubt.

    Where no other grains lie beside, all do. Else those whose names begin with as many of the same
    words as the grains' and with more than those of the others have in common with them; and those
    that are called ``STEM.contacts.csv``, by the grain files' own names.
    """
    own: list[Family] = []
    doubtful: list[Family] = []
    others = [rival for rival in rivals if _stem(rival) != _stem(grains)]
    stems = set(map(_own_stem, grains.files.values()))
    for family in contacts:
        if stems >= set(map(_owner, family.files.values())):
            own.append(family)
            continue
        kin = _kinship(grains, family)
        closest = max((_kinship(rival, family) for rival in others), default=(-1, False))
        if kin > closest:
            own.append(family)
        elif kin == closest:
            doubtful.append(family)
    return own, doubtful


def nearest(grains: Family, contacts: Sequence[Family]) -> Family | None:
    """The contact files whose names begin with more of the grains' words than all others do."""
    ordered = sorted(contacts, key=lambda one: _kinship(grains, one)[0], reverse=True)
    first, second = ordered[:2]
    is_nearer = _kinship(grains, first)[0] > _kinship(grains, second)[0]
    return first if is_nearer else None


def _stem(family: Family) -> list[str]:
    """The words of a pattern without its ending."""
    return re.findall(r"[^\W_]+", bare_name(Path(family.pattern)).removesuffix(_ending(family)))


def _ending(family: Family) -> str:
    return "".join(re.findall(r"\.[A-Za-z]\w*$", bare_name(Path(family.pattern))))


def _kinship(one: Family, two: Family) -> tuple[int, bool]:
    """How many words two names begin with in common, and whether they have the same ending."""
    words = list(zip(_stem(one), _stem(two), strict=False))
    common = next((k for k, (a, b) in enumerate(words) if a != b), len(words))
    return common, _ending(one) == _ending(two)


def names_a_step(file: Path) -> bool:
    """Whether a number in a file's name is taken for its step, if the file has none itself."""
    return bool(_numbers(file))


@lru_cache(1 << 16)
def _numbers(file: Path) -> tuple[int, ...]:
    # the ending of a name (.mp4) is not a number of the frame, unless it is nothing else (dump.100)
    name = Path(bare_name(file))
    text = name.name if name.suffix[1:].isdigit() else name.stem
    return tuple(int(number) for number in NUMBER.findall(text))


def _split(group: list[Path]) -> list[list[Path]]:
    """
    Tell series apart whose names differ in a number too (run1_100, run1_200, run2_100).

    One series: its numbers before the step never fall while the step rises, and no step occurs
    twice.
    """
    place = _place(group)
    numbers = {file: _numbers(file) for file in group}
    ordered = sorted(group, key=lambda file: (numbers[file][place:][:1], numbers[file]))
    steps = [numbers[file][place:][:1] for file in ordered]
    leading = [numbers[file][:place] for file in ordered]
    repeated = len(set(steps)) < len(steps) and len(set(leading)) > 1
    if not repeated and leading == sorted(leading):
        return [ordered]
    series: dict[tuple[int, ...], list[Path]] = defaultdict(list)
    for file, key in zip(ordered, leading, strict=True):
        series[key].append(file)
    return list(series.values())


def _place(group: list[Path]) -> int:
    """Which number of the names is the step: the last one that differs, else the last."""
    columns = list(zip(*map(_numbers, group), strict=True))
    differing = [place for place, column in enumerate(columns) if len(set(column)) > 1]
    return differing[-1] if differing else max(len(columns) - 1, 0)


def _family(
    steps: list[tuple[int | None, Path]],
    members: list[Path],
    pattern: str,
    format: str | None,
    options: ReadOptions | None,
) -> Family:
    sample = max(members, key=lambda file: file.stat().st_size)
    reader: Reader | None = None
    kind: FileKind = "other"
    problem: str | None = None
    try:
        reader = reader_for(sample, options) if format is None else reader_named(format, options)
        kind = "other" if reader is None else reader.kind(sample)
    except UnknownFormatError:
        raise
    except ReadError as error:
        # in a folder one damaged file is passed over; alone it is the error
        problem = str(error)
    files: dict[int | None, Path] = {}
    clash: str | None = None
    for step, file in steps:
        if step in files:
            clash = f"two files for one step: {files[step]} and {file}: name one of them"
        files.setdefault(step, file)
    return Family(pattern, files, reader, kind, problem, clash)


def _glob(members: list[Path], files: Sequence[Path]) -> str:
    """
    The names, with a star for each number in which they differ.

    If that would match other files too, the names themselves.
    """
    texts = [NUMBER.findall(file.name) for file in members]

    def with_stars(star: str) -> str:
        shown = iter(zip(*texts, strict=False))
        name = NUMBER.sub(
            lambda match: star if len(set(next(shown, match[0]))) > 1 else match[0],
            members[0].name,
        )
        return str(members[0].with_name(name))

    others = set(files) - set(members)
    for star in ("*", "[0-9]*"):
        pattern = with_stars(star)
        if not any(fnmatch(str(file), pattern) for file in others):
            return pattern
    return " ".join(map(str, members[:3])) + (" ..." if len(members) > 3 else "")
