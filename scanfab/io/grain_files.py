"""Which files of a source are the grains, and what to say where that cannot be told."""

from __future__ import annotations

import glob
import os
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning, UnknownFormatError
from scanfab.base.streams import kind_of
from scanfab.io.families import Family, contacts_beside, files_in, sort_into_families
from scanfab.io.files import first_bytes
from scanfab.io.reader import FileKind, ReadOptions
from scanfab.io.registry import why_not

PathLike = str | os.PathLike[str]

# sub-folders that are looked into for the advice in an error
MOST_FOLDERS = 50
# how a fabric table begins, in whatever format
TABLE_WORDS = (b"source", b"frame", b"variant", b"alpha_vs")


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
        named = ", ".join(again[:5]) + (f" and {len(again) - 5} more" if len(again) > 5 else "")
        warnings.warn(
            f"{named}: named twice among the sources, and read once", ScanfabWarning, stacklevel=4
        )
    return list(first.values())


def files_of(path: Path) -> list[Path]:
    """A file, or the files of a folder."""
    if not path.is_dir():
        if not path.exists():
            raise ReadError(f"{path}: there is no such file, folder or glob")
        return [path]
    files = files_in(path)
    for one in sorted(set(path.iterdir()).difference(files)):
        if (kind := kind_of(one)) is not None:
            text = f"passed over: {one} is {kind}, expected a file"
            warnings.warn(text, ScanfabNote, stacklevel=3)
    if not files:
        below = series_below(path)
        if below:
            raise ReadError(f"{path}: holds no dumps itself, but {below}")
        raise ReadError(f"{path}: the folder holds no files")
    return files


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
    order: list[FileKind] = ["grains", "index", "points"]
    grains: list[Family] = []
    for kind in order if options.radius is None else ["points", *order]:
        grains = grains or [family for family in families if family.kind == kind]
    where = ", ".join(str(path) for path in paths[:3]) + (", ..." if len(paths) > 3 else "")
    if len(grains) > 1:
        raise ReadError(_several(where, families, options))
    if not grains:
        raise _none(where, paths, families, options)
    return grains[0]


def _several(where: str, families: Sequence[Family], options: ReadOptions) -> str:
    """The message for several series: each with what reading it takes."""
    contacts = [family for family in families if family.kind == "contacts"]
    full = [family for family in families if family.kind in ("grains", "index")]
    bare = [family for family in families if family.kind == "points"]
    lines: list[str] = []
    doubtful: list[str] = []
    for family in [*full, *bare]:
        # by the rule that reads them, once this one is named
        own, unclear = contacts_beside(family, None, options)
        doubtful += [one.pattern for one in unclear]
        notes = ["it has no radius: `radius=L`"] if family.kind == "points" else []
        if own:
            notes.append(f"contacts: {', '.join(one.pattern for one in own)}")
        lines.append("; ".join([family.pattern, *notes]))
    message = f"{where}: several series of grains: choose one of\n  " + "\n  ".join(lines)
    names = dict.fromkeys(
        f"'{family.pattern}'" for family in contacts if family.pattern in doubtful
    )
    if names:
        message += "\nand its contacts, `contacts` with one of\n  " + "\n  ".join(names)
    return message


def _none(
    where: str, paths: Sequence[Path], families: Sequence[Family], options: ReadOptions
) -> ReadError:
    """The error for a source without grains."""
    problem = next((family.problem for family in families if family.problem), None)
    if problem is not None:
        return ReadError(problem)
    known = [family for family in families if family.reader is not None]
    if known:
        return ReadError(
            f"{where}: no grains: expected points with a radius, found only "
            + ", ".join(f"{family.pattern} ({family.kind})" for family in known)
        )
    table = next((path for path in paths if path.is_file() and _is_table(path)), None)
    if table is not None:
        return ReadError(
            f"{table}: this is a fabric table, not a dump: scanfab compare or scanfab report "
            f"take it"
        )
    below = ", ".join(filter(None, (series_below(path) for path in paths if path.is_dir())))
    if below:
        return ReadError(f"{where}: no reader knows its files, but {below}")
    reason = why_not(paths[0], options) if len(paths) == 1 and paths[0].is_file() else ""
    return UnknownFormatError(
        f"{where}: no reader knows the format; scanfab formats lists those that exist"
        + (f"; as a table it cannot be read: {reason}" if reason else "")
    )


def _is_table(path: Path) -> bool:
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
    if not found:
        return ""
    names = ", ".join(found[:5]) + (f" and {len(found) - 5} more" if len(found) > 5 else "")
    return f"there are series in its folders: name them as sources: {names}"


def _holds_grains(folder: Path) -> bool:
    try:
        families = sort_into_families(files_in(folder), None)
    except (OSError, ReadError):
        return False
    return any(family.kind in ("grains", "index", "points") for family in families)
