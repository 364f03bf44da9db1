"""The check of readers of packings, on sound and damaged files of their format."""

from __future__ import annotations

import contextlib
import gzip
import io
import re
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random
from typing import TypeVar, get_args

from scanfab.base.errors import ReadError, ScanfabError, ScanfabNote, ScanfabWarning
from scanfab.io.files import bare_name, plain
from scanfab.io.reader import FileKind, GrainTable, Reader, ReadOptions, Snapshot
from scanfab.packing.packing import Packing
from scanfab.testing.writers import differences

# seconds in which a small file must be read
LONGEST = 10.0
# how many cut and how many otherwise damaged files are made of each file
CUTS, DAMAGES = 40, 150
FOREIGN = {
    "empty": b"",
    "text": b"hello\nworld\n",
    "numbers": b"1 2 3\n4 5 6\n",
    "zeros": bytes(500),
    "bytes": bytes(range(256)) * 4,
    "xml": b'<?xml version="1.0"?>\n<html><body/></html>\n',
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(100),
}
TOKENS = (b"nan", b"-1", b"1e400", b"9" * 30, b"", b"\xff\xfe", b"99999999999", b"\n", b"x")
WORD = re.compile(rb"[^\s,;<>=\"]+")
T = TypeVar("T")


def check_reader(
    reader: Reader,
    files: Sequence[Path],
    folder: Path,
    *,
    options: ReadOptions | None = None,
    counts: bool = False,
) -> None:
    """
    Try a reader on files of its format.

    Parameters
    ----------
    reader : Reader
        The plugin.
    files : sequence of Path
        Small sound files with grains, of all kinds that the format has.
    folder : Path
        An empty folder for damaged files, such as pytest's ``tmp_path``.
    options : ReadOptions, optional
        Options that are needed to read the files.
    counts : bool, optional
        Whether the format says how many grains there are, or where they end. A file that is cut
        off must then be an error, not fewer grains.

    Raises
    ------
    AssertionError
        That says what the reader should have done.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from scanfab.io.reader import reader_named
    >>> from scanfab.testing import check_reader
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "two.xyz"
    ...     _ = file.write_text("1\\nProperties=pos:R:3:radius:R:1\\n0 0 0 1\\n")
    ...     check_reader(reader_named("xyz"), [file], Path(folder) / "damaged", counts=True)
    """
    options = ReadOptions() if options is None else options
    folder.mkdir(exist_ok=True)
    assert re.fullmatch(r"[a-z0-9][a-z0-9-]*", reader.name), (
        f"the name {reader.name!r} is typed behind --format: small letters, digits and -"
    )
    assert len(reader.description.splitlines()) == 1, "the description is one line"
    assert isinstance(reader.extensions, tuple), "the extensions are a tuple"
    assert all(one.startswith(".") for one in reader.extensions), "extensions begin with a dot"
    for name, data in FOREIGN.items():
        path = _put(folder, f"{name}.bin", data)
        known = _asked("recognises", reader.recognises, path)
        assert not known, f"{path.name}: recognises() takes it for its own, which it is not"
        _try_all(reader, path, options)
    assert files, "expected at least one file to try the reader on"
    for file in files:
        grains = _check_sound(reader, file, folder, options)
        _check_damaged(reader, file, folder, options, grains if counts else 0)


def _check_sound(reader: Reader, file: Path, folder: Path, options: ReadOptions) -> int:
    """Read a sound file twice, and once compressed; the number of its grains."""
    before = file.read_bytes()
    packed = _put(folder, f"packed_{bare_name(file)}.gz", gzip.compress(plain(file).read_bytes()))
    with _quiet(file):
        if not getattr(reader, "generic", False):
            assert reader.recognises(file) is True, f"{file.name}: recognises() must be True"
        kind = reader.kind(file)
        assert kind in get_args(FileKind), f"{file.name}: kind() is {kind!r}"
        first, again, unpacked = (_packings(reader, one, options) for one in (file, file, packed))
    assert first, f"{file.name}: snapshots() found no frame"
    for one, two, three in zip(first, again, unpacked, strict=True):
        changed = differences(one, two)
        assert not changed, f"{file.name}: read twice, it gives different grains: {changed}"
        # files beside it may tell the cell
        other = [text for text in differences(one, three) if not text.startswith("cell")]
        assert not other, f"{packed.name}: gives other grains (use scanfab.io.plain): {other}"
    assert file.read_bytes() == before, f"{file.name}: was changed by reading it"
    return sum(map(len, first))


def _packings(reader: Reader, path: Path, options: ReadOptions) -> list[Packing]:
    """The packing of each frame."""
    found = []
    for snapshot in reader.snapshots(path):
        assert isinstance(snapshot, Snapshot), f"{path.name}: snapshots() gives Snapshot objects"
        assert snapshot.step is None or isinstance(snapshot.step, int), "a step is an int or None"
        table = reader.read_grains(snapshot, options)
        assert isinstance(table, GrainTable), f"{path.name}: read_grains() gives a GrainTable"
        names = ("id", "columns", "contacts", "wall_contacts", "wall_forces", "cell")
        more = {name: getattr(table, name) for name in names}
        found.append(Packing(table.position, table.radius, **more))
    return found


def _check_damaged(
    reader: Reader, file: Path, folder: Path, options: ReadOptions, least: int
) -> None:
    """Cut the file anywhere, which may not leave fewer grains than ``least``, and change it."""
    data, random = file.read_bytes(), Random(0)
    for place in sorted({random.randrange(len(data)) for _ in range(CUTS)}):
        found = _try_all(reader, _put(folder, f"cut_{file.name}", data[:place]), options)
        # only blanks may be missing without harm
        assert found is None or found >= least or not data[place:].strip(), (
            f"{file.name} cut off after {place} bytes is read as {found} of {least} grains: a part "
            f"of a file must be an error"
        )
    for _ in range(DAMAGES):
        _try_all(reader, _put(folder, f"damaged_{file.name}", _damaged(data, random)), options)


def _damaged(data: bytes, random: Random) -> bytes:
    """The data with one bit, byte or word changed, or a part left out."""
    kind, place = random.randrange(4), random.randrange(len(data))
    if kind == 0:
        changed = bytearray(data)
        changed[place] ^= 1 << random.randrange(8)
        return bytes(changed)
    if kind == 1:
        return data[:place] + data[place + random.randrange(1, 50) :]
    if kind == 2:
        return data[:place] + random.choice(TOKENS) + data[place:]
    words = list(WORD.finditer(data))
    word = random.choice(words[:30] if random.random() < 0.5 else words)
    return data[: word.start()] + random.choice(TOKENS) + data[word.end() :]


def _try_all(reader: Reader, path: Path, options: ReadOptions) -> int | None:
    """Ask a reader all that the package asks it; the number of grains if it reads the file."""

    def count(path: Path) -> int:
        tables = (reader.read_grains(snapshot, options) for snapshot in reader.snapshots(path))
        return sum(len(table.radius) for table in tables)

    began = time.monotonic()
    _asked("recognises", reader.recognises, path)
    _asked("kind", reader.kind, path)
    found = _asked("read_grains", count, path)
    took = time.monotonic() - began
    assert took < LONGEST, f"{path.name}: took {took:.0f} s"
    return found


def _asked(what: str, call: Callable[[Path], T], path: Path) -> T | None:
    """The answer of a call; None if it raises a ScanfabError. Other errors fail the check."""
    with _quiet(path):
        try:
            return call(path)
        except ScanfabError as error:
            told = error
        except BaseException as error:
            raise AssertionError(
                f"{path}: {what}() raises {type(error).__name__}: {error}; whatever a file holds, "
                f"it must raise ReadError and nothing else"
            ) from error
    is_named = path.name in str(told) or not isinstance(told, ReadError)
    assert is_named, f"{what}(): the error does not name the file: {told}"
    return None


@contextlib.contextmanager
def _quiet(path: Path) -> Iterator[None]:
    """Fails if anything is printed, or if a warning is not scanfab's."""
    out = io.StringIO()
    with (
        warnings.catch_warnings(record=True) as caught,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(out),
    ):
        warnings.simplefilter("always")
        yield
    assert not out.getvalue(), f"{path.name}: the reader prints {out.getvalue()[:100]!r}"
    for one in caught:
        assert issubclass(one.category, (ScanfabWarning, ScanfabNote)), (
            f"{path.name}: draws a {one.category.__name__}: {one.message}"
        )


def _put(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path
