"""Which files of a source are its grains and its contacts, and what is told of the others."""

from __future__ import annotations

import warnings
from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning, UnknownFormatError
from scanfab.io.families import (
    Family,
    Named,
    PathLike,
    are_tied,
    expanded,
    family_of,
    files_around,
    files_in,
    files_of,
    kinship,
    own_stem,
    owner,
    some,
    sort_into_families,
    sort_names,
    words_of,
)
from scanfab.io.files import first_bytes
from scanfab.io.reader import FileKind, ReadOptions
from scanfab.io.registry import why_not

# sub-folders that are looked into for the advice in an error
MOST_FOLDERS = 50
# how a fabric table begins, in whatever format
TABLE_WORDS = (b"source", b"frame", b"variant", b"alpha_vs")
GRAINS: tuple[FileKind, ...] = ("grains", "index", "start", "points")
"""Kinds of files that may be frames; a kind counts only where there is none of the kinds before."""
HOLDS: dict[FileKind, str] = {
    "grains": "grains",
    "index": "grains",
    "start": "grains that a simulation starts from",
    "points": "points without a radius (give it by `radius`)",
    "contacts": "contacts",
    "cell": "a cell",
    "other": "neither grains nor contacts",
}


def without_tables(
    families: Sequence[Family], named: Collection[Path] = (), grains: Family | None = None
) -> list[Family]:
    """
    The families, with ``other`` as the kind of tables that lie beside dumps.

    A table may be anything: results, or what somebody made of the dumps. Beside grains of a
    program's own format it counts if users name it, or if it is ``STEM.contacts.csv`` of a file of
    grains. A table without names counts only where there are none with names.

    Parameters
    ----------
    families : sequence of Family
        Of one source.
    named : collection of Path
        Files that users name one by one.
    grains : Family, optional
        The grains, if the families are those beside them.
    """
    chosen = [] if grains is None else [grains]
    frames = [one for one in [*families, *chosen] if one.kind in ("grains", "index")]
    dumps = [one for one in frames if not one.is_table]
    with_names = [
        one
        for one in frames
        if one.is_table and one.reader is not None and one.reader.recognises(one.largest)
    ]
    stems = {own_stem(file) for one in [*dumps, *chosen] for file in one.files.values()}

    def counts(one: Family) -> bool:
        files = one.files.values()
        if not one.is_table or set(files) & set(named):
            return True
        if dumps:
            return any(owner(file) in stems for file in files)
        return one.kind != "grains" or one in with_names or not with_names

    return [one if counts(one) else replace(one, kind="other") for one in families]


def choose_grains(
    paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> Family:
    """
    The one family of grain files.

    Parameters
    ----------
    paths : sequence of Path
        As the user named them, for messages.
    families : sequence of Family
        All of their files.
    options : ReadOptions
        What the user tells: a radius, which dumps without one need.

    Raises
    ------
    ReadError
        If there are none, or several.
    """
    where = ", ".join(map(str, paths[:3])) + (", ..." if len(paths) > 3 else "")
    for kind in GRAINS if options.radius is None else ("points", *GRAINS):
        grains = [family for family in families if family.kind == kind]
        if len(grains) == 1:
            return grains[0]
        if grains:
            raise ReadError(_several(where, families, options))
    raise _none(where, paths, families, options)


def _several(where: str, families: Sequence[Family], options: ReadOptions) -> str:
    """The message for several series: each with what reading it takes."""
    lines: list[str] = []
    for family in sorted(families, key=lambda one: one.kind == "points"):
        if family.kind in GRAINS:
            _, own = contacts_beside(family, None, options)
            notes = ["it has no radius: `radius=L`"] if family.kind == "points" else []
            notes += [f"contacts: {_patterns(own)}"] if own else []
            lines.append("; ".join([family.pattern, *notes]))
    return f"{where}: several series of grains: choose one of\n  " + "\n  ".join(lines)


def _none(
    where: str, paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> ReadError:
    """The error for a source without grains."""
    folders = [path for path in paths if path.is_dir()]
    below = ", ".join(filter(None, map(series_below, folders)))
    if not families:
        return ReadError(
            f"{where}: holds no dumps itself, but {below}"
            if below
            else f"{where}: the folder holds no files"
        )
    problem = next((family.problem for family in families if family.problem), None)
    if problem is not None:
        return ReadError(problem)
    known = [family for family in families if family.reader is not None]
    if known:
        held = ", ".join(f"{HOLDS[one.kind]} ({Path(one.pattern).name})" for one in known[:5])
        return ReadError(f"{where}: no grains: expected points with a radius, found {held}")
    if below:
        return ReadError(f"{where}: no reader knows its files, but {below}")
    table = next((path for path in paths if path.is_file() and _is_fabric_table(path)), None)
    if table is not None:
        return ReadError(
            f"{table}: this is a fabric table, not a dump: scanfab compare or scanfab report "
            f"take it"
        )
    reason = why_not(paths[0], options) if len(paths) == 1 and not folders else ""
    return UnknownFormatError(
        f"{where}: no reader knows the format; scanfab formats lists those that exist"
        + (f"; as a table it cannot be read: {reason}" if reason else "")
    )


def _is_fabric_table(path: Path) -> bool:
    """Whether a file is what ``compute`` writes."""
    try:
        data = path.read_bytes() if path.suffix == ".parquet" else first_bytes(path, 1 << 14)
    except (OSError, ReadError):
        return False
    return all(word in data for word in TABLE_WORDS)


def series_below(folder: Path) -> str:
    """Which sub-folders hold grains, as the end of a sentence; empty if none does."""
    below = sorted(one for one in folder.iterdir() if one.is_dir() and one.name[0] != ".")
    found = [str(one) for one in below[:MOST_FOLDERS] if _holds_grains(one)]
    return f"there are series in its folders: name them as sources: {some(found)}" if found else ""


def _holds_grains(folder: Path) -> bool:
    try:
        families = sort_into_families(files_in(folder), None)
    except (OSError, ReadError):
        return False
    return any(family.kind in GRAINS for family in families)


def named_contacts(contacts: PathLike, format: str | None, options: ReadOptions) -> list[Family]:
    """Contact files from a file, a folder or a glob."""
    files = [file for one in expanded(contacts) for file in files_of(Path(one))]
    families = sort_into_families(files, format, options)
    found = [family for family in families if family.kind == "contacts"]
    if not found:
        problem = next((family.problem for family in families if family.problem), None)
        held = " and ".join(sorted({HOLDS[one.kind] for one in families})) or "no files"
        raise ReadError(problem or f"{contacts}: expected contacts, found {held}")
    return found


def contacts_beside(
    grains: Family, format: str | None, options: ReadOptions, *, told: bool = False
) -> tuple[list[Family], list[Family]]:
    """
    What lies beside single grain files with their numbers, and which of it are their contacts.

    Contact files belong to grains if their numbers agree or their names begin with the same word,
    or if neither has a number; and if no other grains beside them have a name that is as near, and
    no other contact files are nearer. ``STEM.contacts.csv`` belongs to STEM.

    Parameters
    ----------
    grains : Family
        The grain files.
    format : str, optional
        Name of the reader.
    options : ReadOptions
        What the user tells.
    told : bool, optional
        Whether a note tells which are read, and which are in doubt.

    Returns
    -------
    families : list of Family
        Of the numbers of the grain files.
    own : list of Family
        Their contacts.
    """
    if grains.kind == "index":
        return [], []
    families = without_tables(_families_beside(grains, format, options), (), grains)
    words, _ = words_of(grains)
    rivals = [
        one for one in families if one.kind in ("grains", grains.kind) and words_of(one)[0] != words
    ]
    stems = {own_stem(file) for file in grains.files.values()}
    near: dict[tuple[float, bool], list[Family]] = defaultdict(list)
    doubtful: list[Family] = []
    for family in families:
        if family.kind != "contacts" or family.clash is not None:
            continue
        owners = {owner(file) for file in family.files.values()}
        kin = kinship(grains, family)
        closest = max((kinship(one, family) for one in rivals), default=(-1, False))
        if owners <= stems:
            near[float("inf"), True].append(family)
        elif kin > closest and (
            are_tied(grains, family) or (owners == {None} and None in grains.files)
        ):
            near[kin[0], True].append(family)
        elif kin >= closest:
            doubtful.append(family)
    own = near[max(near)] if near else []
    if told and own:
        _note(f"contacts are read from {_patterns(own)}, beside the grains")
    elif told and doubtful:
        _note(
            f"skipped {some([Path(one.pattern).name for one in doubtful])}: contacts beside the "
            f"grains, but neither step nor name tells that they belong to {grains.pattern}: if "
            f"they do, name them with `contacts`"
        )
    return families, own


def _families_beside(grains: Family, format: str | None, options: ReadOptions) -> list[Family]:
    """Other files in the folders of grain files: of the same numbers, or named as theirs."""
    own = {(file.parent, step) for step, file in grains.files.items()}
    stems = {own_stem(file): step for step, file in grains.files.items()}
    around = files_around(grains.files.values())
    found = []
    for named in sort_names(around):
        if not set(grains.files.values()).isdisjoint(file for _, file in named.files):
            continue
        theirs = [(stems.get(owner(file) or ""), file) for _, file in named.files]
        same = [(step, file) for step, file in named.files if (file.parent, step) in own]
        same = [(step, file) for step, file in theirs if owner(file) in stems] or same
        if same:
            found.append(family_of(Named(same, named.has_steps), around, format, options))
    return found


def damaged_contacts(grains: Family, families: Sequence[Family]) -> list[Family]:
    """
    Files that cannot be read and may be the contacts of grains by their names and number.

    Without an error contacts would be found by geometry, where the dump has other ones.
    """
    return [
        replace(one, kind="contacts", files=dict.fromkeys(grains.files, one.largest), clash=None)
        for one in families
        if one.problem is not None and len(one.files) == len(grains.files) and are_tied(grains, one)
    ]


def note_skipped(families: Sequence[Family]) -> None:
    """One note on the files that do not enter, and a warning on those that are damaged."""
    reasons: dict[str, list[str]] = defaultdict(list)
    damaged: dict[str, list[str]] = defaultdict(list)
    for one in families:
        name = Path(one.pattern).name
        if one.problem is not None:
            damaged[one.problem.removeprefix(f"{one.largest}").lstrip(":, ")].append(name)
        elif one.kind != "cell":
            held = "results, or something else in a table" if one.is_table else HOLDS[one.kind]
            reasons[held].append(name)
    told = [
        f"{some(names)}: {'it holds' if len(names) == 1 else 'they hold'} {held}"
        for held, names in reasons.items()
    ]
    if told:
        _note(f"skipped {'; '.join(told)}")
    for problem, names in damaged.items():
        warnings.warn(f"skipped {some(names)}: {problem}", ScanfabWarning, stacklevel=5)


def note_below(folder: Path, grains: Family) -> None:
    """A note if a folder with a single dump holds folders of dumps: these may have been meant."""
    below = series_below(folder)
    if below:
        _note(f"{folder}: {Path(grains.pattern).name} alone is read, but {below}")


def _patterns(families: Sequence[Family]) -> str:
    return ", ".join(family.pattern for family in families)


def _note(text: str) -> None:
    warnings.warn(text, ScanfabNote, stacklevel=6)
