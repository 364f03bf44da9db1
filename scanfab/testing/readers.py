"""The check of a reader, on sound and damaged files of its format."""

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

import numpy as np

from scanfab.base.errors import ReadError, ScanfabError, ScanfabNote, ScanfabWarning
from scanfab.io.files import bare_name, plain
from scanfab.io.reader import FileKind, GrainTable, Reader, ReadOptions, Snapshot
from scanfab.packing.packing import Packing
from scanfab.testing.writers import differences

# a small file must be read within this many seconds
LONGEST = 10.0
# number of truncated and of otherwise damaged copies made of each file
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
    contacts: Sequence[tuple[Path, Path]] = (),
    options: ReadOptions | None = None,
    counts: bool = False,
) -> None:
    """
    Check a reader on files of its format.

    Parameters
    ----------
    reader : Reader
        The plugin.
    files : sequence of Path
        Small sound files with grains, one for each kind of file of the format.
    folder : Path
        An empty folder for damaged files, such as pytest's ``tmp_path``.
    contacts : sequence of (Path, Path), optional
        Small sound files with contacts, each with the file of its grains.
    options : ReadOptions, optional
        Options that the reader needs to read the files.
    counts : bool, optional
        Whether the format states how many grains there are, or where they end. Then a truncated
        file must be an error, not a file with fewer grains.

    Raises
    ------
    AssertionError
        If the reader fails a check; the message says what it should have done.

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
        f"the name {reader.name!r} must consist of small letters, digits and -, as in --format NAME"
    )
    assert len(reader.description.splitlines()) == 1, "the description must be one line"
    assert isinstance(reader.extensions, tuple), "the extensions must be a tuple"
    assert all(end.startswith(".") for end in reader.extensions), "extensions begin with a dot"
    for name, data in FOREIGN.items():
        path = _put(folder, f"{name}.bin", data)
        is_known = _asked("recognises", reader.recognises, path)
        assert not is_known, f"{path.name}: recognises() must be False for other formats"
        _try_all(reader, path, options)
    assert files, "expected at least one file to try the reader on"
    for file in files:
        count = _check_sound(reader, file, folder, options)
        _check_damaged(reader, file, folder, options, count if counts else 0)
    for file, grain_file in contacts:
        grains = reader.read_grains(reader.snapshots(grain_file)[0], options)
        assert reader.kind(file) == "contacts", f"{file.name}: kind() must be 'contacts'"
        assert _try_all(reader, file, options, grains), f"{file.name}: holds no contacts of grains"
        _check_damaged(reader, file, folder, options, 0, grains)


def _check_sound(reader: Reader, file: Path, folder: Path, options: ReadOptions) -> int:
    """Read a sound file twice, and once compressed; return the number of its grains."""
    before = file.read_bytes()
    packed = _put(folder, f"packed_{bare_name(file)}.gz", gzip.compress(plain(file).read_bytes()))
    with _quiet(file):
        if not getattr(reader, "generic", False):
            assert reader.recognises(file) is True, f"{file.name}: recognises() must be True"
        kind = reader.kind(file)
        assert kind in get_args(FileKind), f"{file.name}: kind() is {kind!r}"
        first, again, unpacked = (_packings(reader, path, options) for path in (file, file, packed))
    assert first, f"{file.name}: snapshots() found no frame"
    for one, two, three in zip(first, again, unpacked, strict=True):
        changed = differences(one, two)
        assert not changed, f"{file.name}: reading it twice gives different grains: {changed}"
        # the compressed copy lacks companion files, which may hold the cell
        other = [text for text in differences(one, three) if not text.startswith("cell")]
        assert not other, f"{packed.name}: its grains differ (use scanfab.io.plain): {other}"
    assert file.read_bytes() == before, f"{file.name}: reading must not change the file"
    return sum(map(len, first))


def _packings(reader: Reader, path: Path, options: ReadOptions) -> list[Packing]:
    """The packings of all frames in a file."""
    packings = []
    for snapshot in reader.snapshots(path):
        assert isinstance(snapshot, Snapshot), f"{path.name}: snapshots() gives Snapshot objects"
        assert snapshot.step is None or isinstance(snapshot.step, int), "a step is an int or None"
        table = reader.read_grains(snapshot, options)
        assert isinstance(table, GrainTable), f"{path.name}: read_grains() must return a GrainTable"
        names = ("id", "columns", "bodies", "contacts", "wall_contacts", "wall_forces", "cell")
        more = {name: getattr(table, name) for name in names}
        packings.append(Packing(table.position, table.radius, **more))
    return packings


def _check_damaged(
    reader: Reader,
    file: Path,
    folder: Path,
    options: ReadOptions,
    least: int,
    grains: GrainTable | None = None,
) -> None:
    """Truncate the file, which must not leave fewer grains than ``least``, and damage it."""
    data, random = file.read_bytes(), Random(0)
    for place in sorted({random.randrange(len(data)) for _ in range(CUTS)}):
        count = _try_all(reader, _put(folder, f"cut_{file.name}", data[:place]), options, grains)
        # a file that lacks only blanks at its end may be read
        assert count is None or count >= least or not data[place:].strip(), (
            f"{file.name} cut off after {place} bytes is read as {count} of {least} grains: a part "
            f"of a file must be an error"
        )
    for _ in range(DAMAGES):
        path = _put(folder, f"damaged_{file.name}", _damaged(data, random))
        _try_all(reader, path, options, grains)


def _damaged(data: bytes, random: Random) -> bytes:
    """The data with one bit or word changed, a word inserted, or some bytes left out."""
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


def _try_all(
    reader: Reader, path: Path, options: ReadOptions, grains: GrainTable | None = None
) -> int | None:
    """
    Call all methods of a reader; return the number of grains if it reads the file.

    With the grains of a contact file, return the number of its contacts with grains and walls.
    """

    def count(path: Path) -> int:
        snapshots = reader.snapshots(path)
        if grains is None:
            return sum(len(reader.read_grains(snapshot, options).radius) for snapshot in snapshots)
        joined = [reader.read_contacts(snapshot, options, grains) for snapshot in snapshots]
        pairs = (np.asarray(one.contacts.pairs) for one in joined if one.contacts is not None)
        return sum(map(len, pairs)) + sum(int(one.wall_contacts.sum()) for one in joined)

    began = time.monotonic()
    _asked("recognises", reader.recognises, path)
    _asked("kind", reader.kind, path)
    total = _asked("read_grains" if grains is None else "read_contacts", count, path)
    took = time.monotonic() - began
    assert took < LONGEST, f"{path.name}: took {took:.0f} s, expected at most {LONGEST:.0f} s"
    return total


def _asked(what: str, call: Callable[[Path], T], path: Path) -> T | None:
    """The result of a call, or None if it raises a ScanfabError; other errors fail the check."""
    with _quiet(path):
        try:
            return call(path)
        except ScanfabError as error:
            caught = error
        except BaseException as error:
            raise AssertionError(
                f"{path}: {what}() raises {type(error).__name__}: {error}; for any damaged file "
                f"it must raise ReadError and nothing else"
            ) from error
    is_named = path.name in str(caught) or not isinstance(caught, ReadError)
    assert is_named, f"{what}(): the error must name the file: {caught}"
    return None


@contextlib.contextmanager
def _quiet(path: Path) -> Iterator[None]:
    """Fail if the reader prints anything, or gives a warning that is not a ScanfabWarning."""
    out = io.StringIO()
    with (
        warnings.catch_warnings(record=True) as caught,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(out),
    ):
        warnings.simplefilter("always")
        yield
    assert not out.getvalue(), f"{path.name}: the reader prints {out.getvalue()[:100]!r}"
    for warning in caught:
        assert issubclass(warning.category, (ScanfabWarning, ScanfabNote)), (
            f"{path.name}: gives a {warning.category.__name__}: {warning.message}"
        )


def _put(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path
