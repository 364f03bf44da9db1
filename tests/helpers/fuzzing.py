"""Damaged files for the readers, and all that the package does with a file."""

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from random import Random

from scanfab.base.errors import ScanfabError, ScanfabNote, ScanfabWarning
from scanfab.io.families import Family
from scanfab.io.mesh import read_mesh
from scanfab.io.reader import ReadOptions, reader_for, reader_named
from scanfab.io.series import Series
from tests.helpers.sound_files import companion_grains, entry

READERS = sorted(one.name for one in entry_points(group="scanfab.readers"))
ENDINGS = (
    "txt", "vtk", "vtp", "vtu", "pvd", "xdmf", "txt.gz", "xml", "vtkhdf", "xyz", "contacts.csv",
    "csv", "xyzd", "csv.zst", "csv.lz4", "parquet", "npz", "vtm", "pvtu", "yaml", "bin", "data",
    "fstat", "restart", "nc", "gsd", "mdpa", "hdf5",
)  # fmt: skip
NAMES = (*(f"f_1.{ending}" for ending in ENDINGS), "particle_input_f_1.dat")
OPTIONS = (
    ReadOptions(),
    ReadOptions(radius=0.1),
    ReadOptions(cell=(1.0, 1.0, 1.0)),
    ReadOptions(cell=(1.0, 1.0, 1.0, 0.2, 0.1, 0.0), periodic="xy"),
    ReadOptions(contact_columns="pos id force"),
    ReadOptions(contact_columns="id force", periodic="z"),
    ReadOptions(columns={"radius": "type", "id": "id"}),
    ReadOptions(columns={"x": "y"}, radius=0.1),
    ReadOptions(contact_columns="id1=c_con[1],id2=c_con[2]", periodic="xy"),
    ReadOptions(contact_columns="id1=c_con[1],id2=c_con[2],fx=c_con[3],fy=c_con[4],fz=c_con[5]"),
    ReadOptions(columns={"x": "2", "y": "3", "z": "4", "diameter": "5"}, skip=1),
    ReadOptions(contact_columns="id1=1,id2=2,fx=3,fy=4,fz=5"),
    ReadOptions(columns={"id": "1", "x": "3", "y": "4", "z": "5", "radius": "6"}),
)
Damage = tuple[int, int, bytes]
"""The bytes from one place to another, and what is put there."""

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[^\s<>=\"]+")
LINE = re.compile(rb"[^\n]*\n?")
NOTHING = re.match(rb"", b"")
VALUES = (
    b"nan", b"inf", b"-inf", b"1e400", b"1e308", b"-1e200", b"1e-320", b"-1", b"0", b"1", b"3",
    b"2.5", b"1e15", b"1000000000000000", b"100000000", b"4294967296", b"9223372036854775807",
    b"9" * 25, b"9" * 5000, b"text", b"\xff\xfe", b"\xd9\xa3", b"",
)  # fmt: skip
PATTERNS = (
    b"\x00", b"\xff", b"\n", b"\r\n", b" ", b"<", b"_", b"\x00\x00\x00\x00", b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00\x00\x00\x00\x00\x00\xf0\x7f",
    b"\x7f\xf0\x00\x00\x00\x00\x00\x00", b"\x00\x00\x00\x7f\x00\x00\x00\x00",
)  # fmt: skip


def mutate(data: bytes, random: Random) -> bytes:
    """The data with one to three damages."""
    for _ in range(random.randint(1, 3)):
        start, end, new = random.choice(DAMAGES)(data, random)
        data = data[:start] + new + data[end:]
    return data


def _cut(data: bytes, random: Random) -> Damage:
    return random.randint(0, len(data)), len(data), b""


def _bytes(data: bytes, random: Random) -> Damage:
    """A part is left out, a pattern is inserted or written over, or a bit is flipped."""
    one, two = sorted(random.randint(0, len(data)) for _ in range(2))
    pattern = random.choice(PATTERNS)
    flipped = bytes(byte ^ 1 << random.randrange(8) for byte in data[one : one + 1])
    return random.choice(
        (
            (one, two, b""),
            (one, one, pattern),
            (one, one + len(pattern), pattern),
            (one, one + 1, flipped),
        )
    )


def _line(data: bytes, random: Random) -> Damage:
    """A line is left out, written twice, or replaced by another one."""
    lines = list(LINE.finditer(data))
    one, two = random.choice(lines), random.choice(lines)
    return *one.span(), random.choice((b"", 2 * one[0], two[0]))


def _found(kind: re.Pattern[bytes], data: bytes, random: Random) -> re.Match[bytes]:
    """A match; half of the time one of the first: headers decide more than rows do."""
    found = list(kind.finditer(data)) or [NOTHING]
    return random.choice(found[:30] if random.random() < 0.5 else found)


def _number(data: bytes, random: Random) -> Damage:
    return *_found(NUMBER, data, random).span(), random.choice(VALUES)


def _word(data: bytes, random: Random) -> Damage:
    return *_found(WORD, data, random).span(), _found(WORD, data, random)[0]


DAMAGES: tuple[Callable[[bytes, Random], Damage], ...] = (_cut, _bytes, _word, _number, _line)


class ForbiddenError(Exception):
    """Something came out of reading that is neither an answer nor an error of scanfab."""


@contextmanager
def only_scanfabs_warnings() -> Iterator[None]:
    """ForbiddenError if a warning is not scanfab's."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        if not issubclass(warning.category, (ScanfabWarning, ScanfabNote)):
            place = f"{Path(warning.filename).name}:{warning.lineno}"
            raise ForbiddenError(f"{warning.category.__name__} at {place}: {warning.message}")


def read_everything(path: Path, format: str, options: ReadOptions) -> None:
    """All that the package does with a file, as grains and as contacts; any result will do."""
    reader = reader_named(format, options)
    grains, companion = companion_grains(format)
    path = entry(format, path)
    one = partial(Family, str(path), {1: path}, reader_named(format))
    with only_scanfabs_warnings():
        with suppress(ScanfabError):
            reader_for(path)
        with suppress(ScanfabError):
            reader.kind(path)
        with suppress(ScanfabError):
            frames = list(Series("", one("grains"), options=options))
            for frame in frames[:1] + frames[1:][-1:]:
                with suppress(ScanfabError):
                    frame.read()
        with suppress(ScanfabError):
            for snapshot in reader.snapshots(path)[-1:]:
                reader.read_contacts(snapshot, options, grains)
        if format != "yade":
            with suppress(ScanfabError):
                read_mesh(path)
        with suppress(ScanfabError):
            own = Series("", companion, (one("contacts"),), "auto", options)
            next(iter(own)).read()
