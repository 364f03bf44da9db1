"""
Checks that packages can run on their own readers and writers of packings.

Readers are tried on sound and damaged files, writers on packings that use all features of a format.
"""

from __future__ import annotations

import contextlib
import gzip
import io
import re
import time
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from random import Random
from typing import Any, get_args

import numpy as np

from scanfab.base.errors import ReadError, ScanfabError, ScanfabNote, ScanfabWarning
from scanfab.io.convert import save_packing
from scanfab.io.files import bare_name, plain
from scanfab.io.reader import FileKind, GrainTable, Reader, ReadOptions, Snapshot
from scanfab.io.sources import read
from scanfab.io.writer import Writer, flat
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing
from scanfab.packing.search import find_contacts

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
# an id that no float can represent
LARGE = 2**60 + 1


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
    assert all(end.startswith(".") for end in reader.extensions), "extensions begin with a dot"
    for name, data in FOREIGN.items():
        answers = _answers(reader, _put(folder, f"{name}.bin", data), options)
        wrong = f"{name}.bin: recognises() must be False for other formats"
        assert not answers.get("recognises"), wrong
    assert files, "expected at least one file to try the reader on"
    for file in files:
        count = _check_sound(reader, file, folder, options)
        _check_damaged(reader, file, folder, options, count if counts else 0)
    for file, grain_file in contacts:
        grains = reader.read_grains(reader.snapshots(grain_file)[0], options)
        assert reader.kind(file) == "contacts", f"{file.name}: kind() must be 'contacts'"
        answers = _answers(reader, file, options, grains)
        assert answers.get("read"), f"{file.name}: holds no contacts of grains"
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
        packings.append(Packing(**table._asdict()))
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
        path = _put(folder, f"cut_{file.name}", data[:place])
        count = _answers(reader, path, options, grains).get("read", least)
        # a file that lacks only blanks at its end may be read
        assert count >= least or not data[place:].strip(), (
            f"{file.name} cut off after {place} bytes is read as {count} of {least} grains: a part "
            f"of a file must be an error"
        )
    for _ in range(DAMAGES):
        # one bit or word is changed, a word is inserted, or some bytes are left out
        place, token = random.randrange(len(data)), random.choice(TOKENS)
        words = list(WORD.finditer(data))
        word = random.choice(words[:30] if random.random() < 0.5 else words)
        flipped = bytes([data[place] ^ 1 << random.randrange(8)])
        changes = [(place, place + 1, flipped), (*word.span(), token), (place, place, token)]
        changes += [(place, place + random.randrange(1, 50), b"")]
        start, stop, new = random.choice(changes)
        path = _put(folder, f"damaged_{file.name}", data[:start] + new + data[stop:])
        _answers(reader, path, options, grains)


def _answers(
    reader: Reader, path: Path, options: ReadOptions, grains: GrainTable | None = None
) -> dict[str, Any]:
    """
    What the methods of a reader answer to a file, except those that raise a ScanfabError.

    ``read`` is the number of its grains; with the grains of a contact file, the number of its
    contacts with grains and walls.
    """

    def count(path: Path) -> int:
        snapshots = reader.snapshots(path)
        if grains is None:
            return sum(len(reader.read_grains(snapshot, options).radius) for snapshot in snapshots)
        joined = [reader.read_contacts(snapshot, options, grains) for snapshot in snapshots]
        pairs = (np.asarray(one.contacts.pairs) for one in joined if one.contacts is not None)
        return sum(map(len, pairs)) + sum(int(one.wall_contacts.sum()) for one in joined)

    answers: dict[str, Any] = {}
    began = time.monotonic()
    for name, ask in (("recognises", reader.recognises), ("kind", reader.kind), ("read", count)):
        with _quiet(path):
            try:
                answers[name] = ask(path)
            except ScanfabError as error:
                if isinstance(error, ReadError) and path.name not in str(error):
                    raise AssertionError(f"{name} must name the file {path}: {error}") from error
            except BaseException as error:
                only = "for any damaged file it must raise ReadError and nothing else"
                found = f"{path}: {name} raises {type(error).__name__}: {error}"
                raise AssertionError(f"{found}; {only}") from error
    took = time.monotonic() - began
    assert took < LONGEST, f"{path.name}: took {took:.0f} s, expected at most {LONGEST:.0f} s"
    return answers


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


def check_writer(
    writer: Writer, folder: Path, *, format: str | None = None, leave: Iterable[str] = ()
) -> None:
    """
    Check a writer: write packings of all kinds, and read them back.

    Parameters
    ----------
    writer : Writer
        The plugin; a reader of its format must be installed.
    folder : Path
        An empty folder, such as pytest's ``tmp_path``.
    format : str, optional
        Name of the reader; by default the content of the file decides.
    leave : iterable of str, optional
        Names of :func:`made_up_packings` to leave out.

    Raises
    ------
    AssertionError
        If data were lost or changed; the message says which.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from scanfab.io.writer import writer_named
    >>> from scanfab.testing import check_writer
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     check_writer(writer_named("vtp"), Path(folder))
    """
    left_out = set(leave)
    for number, (name, packing) in enumerate(made_up_packings().items()):
        if name in left_out:
            continue
        own_folder = folder / f"{number}"
        own_folder.mkdir()
        path = own_folder / f"packing_7{writer.extensions[0]}"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ScanfabNote)
            save_packing(packing, path, writer)
            again = read(path, format=format)
        changes = differences(packing, again)
        assert not changes, f"{writer.name}: changes the packing {name!r}: {'; '.join(changes)}"


def made_up_packings() -> dict[str, Packing]:
    """
    Small packings, each with special features; the name says which.

    Returns
    -------
    dict of str to Packing
        Open and periodic packings, tilted cells, forces, bodies, contacts with walls, columns of
        texts and vectors, ids above 2^53; packings without contacts and without grains.

    Examples
    --------
    >>> from scanfab.testing import made_up_packings
    >>> packing = made_up_packings()["everything"]
    >>> len(packing), packing.cell.periodic, packing.contacts.force.shape[1]
    (40, (True, True, False), 3)
    """
    random = np.random.default_rng(7)
    cell = Cell(
        [[1.1, 0, 0], [0.3, 1.3, 0], [-0.2, 0.1, 0.9]], (True, True, False), (0.1, -1, 1 / 3)
    )
    position = random.random((40, 3)) @ cell.vectors + cell.origin
    radius = 0.13 + 0.1 * random.random(40)
    rows = np.arange(40)
    plain = Packing(position, radius)
    tilted = Packing(position, radius, cell=cell, id=random.permutation(40) + LARGE)
    touching = find_contacts(tilted).contacts
    assert touching is not None
    contacts = ContactList(touching.pairs, touching.image, random.normal(size=(len(touching), 3)))
    columns = {
        "type": rows % 3 + 1,
        "velocity": random.normal(size=(40, 3)),
        "element": np.array(["Si", "quartz"])[rows % 2],
        "words, and more": np.array(["a b", 'c"d', "e,f", "é"])[rows % 4],
        "large": rows + LARGE,
        "tiny": random.random(40) * 1e-310,
    }
    everything = Packing(
        position,
        radius,
        id=tilted.id,
        cell=cell,
        columns=columns,
        bodies=np.where(rows % 5 == 0, rows // 10, -1),
        wall_contacts=rows % 3,
        contacts=contacts,
        step=123456789012,
        time=0.1 + 0.2,
    )
    normal = contacts._replace(force=None, force_n=random.normal(size=len(touching)))
    # a rotation about all axes
    turn, _ = np.linalg.qr(np.array([[1.0, 2, 3], [-1, 1, 0.5], [2, 0, 1]]))
    turned = Cell(cell.vectors @ turn * np.sign(np.linalg.det(turn)))
    return {
        "plain": plain,
        "one grain": Packing([[0.25, -1e-9, 3e9]], 0.5, step=0),
        "everything": everything,
        "normal forces": tilted.with_contacts(normal),
        "a turned cell": Packing(position, radius, cell=turned, time=-1.5),
        "no contacts": plain.with_contacts(ContactList(np.zeros((0, 2), np.int64))),
        "no grains": Packing(np.zeros((0, 3)), np.zeros(0), step=3),
    }


def differences(one: Packing, two: Packing) -> list[str]:
    """
    List the differences of two packings, to the last bit; vector columns are compared by component.

    Parameters
    ----------
    one, two : Packing
        For instance a packing, and the packing read back; ``two`` may have more columns.

    Returns
    -------
    list of str
        A sentence for each difference; empty if the packings agree.
    """
    first, second = _values_of(one), _values_of(two)
    changes = []
    for name, value in first.items():
        other = second.get(name)
        if value is None or other is None:
            changes += [] if value is other else [f"{name}: {value!r} and {other!r}"]
            continue
        mine, theirs = np.asarray(value), np.asarray(other)
        if mine.shape != theirs.shape:
            changes.append(f"{name}: shapes {mine.shape} and {theirs.shape}")
            continue
        if "U" in (mine.dtype.kind, theirs.dtype.kind) and mine.size:
            mine, theirs = mine.astype(str), theirs.astype(str)
        same = (mine == theirs) | ((mine != mine) & (theirs != theirs))
        if not np.all(same):
            place = np.unravel_index(int(np.argmin(same)), mine.shape) if mine.shape else ()
            where = tuple(map(int, place))
            changes.append(f"{name}: {mine[place]!r} and {theirs[place]!r} at {where}")
    return changes


def _values_of(packing: Packing) -> dict[str, Any]:
    """All data of a packing, by names for messages; None for data that it does not have."""
    parts = {
        "": ("position", "radius", "id", "wall_contacts", "step", "time"),
        "cell": ("vectors", "origin", "periodic"),
        "bodies": ("number",),
        "contacts": ("pairs", "image", "normal", "point", "force", "force_n"),
    }
    found: dict[str, Any] = {}
    for part, names in parts.items():
        owner = getattr(packing, part) if part else packing
        found |= {f"{part} {name}".strip(): getattr(owner, name, None) for name in names}
    return found | {f"column {name}": values for name, values in flat(packing.columns).items()}
