"""
Damaged texts, each read as a short one and as a long one: both must say the same.

    python tests/campaigns/short_and_long.py [--runs 20000] [--seed 0] [--out FOLDER] [READER ...]

Long texts are read by quick parsers, all others by tolerant ones. Small sound texts of each format,
often with their rows repeated, are damaged at random. Each is read with sizes from which a text is
long that none reaches, and with sizes that all reach, also in pieces of a few bytes. Grains,
contacts, columns to the last bit and warnings must be the same, or both readings end in a
ScanfabError, whose words may differ. Texts that differ are kept with what both said. One line for
each reader; the exit code is 1 if anything differed.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(ROOT)

from scanfab.base.errors import ScanfabError  # noqa: E402
from scanfab.io.formats import text_dump  # noqa: E402
from scanfab.io.parse import counted_rows, text_table  # noqa: E402
from scanfab.io.reader import GrainTable, ReadOptions  # noqa: E402
from scanfab.io.registry import reader_named  # noqa: E402
from scanfab.packing.cell import Cell  # noqa: E402
from tests.helpers import fuzzing, sound_files  # noqa: E402

READERS = [one for one in fuzzing.READERS if one not in ("gsd", "npz", "on-dem")]
ENDINGS = (".csv", ".tsv", ".txt", ".data", ".dat", ".fstat", ".mdpa", ".xyz", ".yaml", ".local")
ENDINGS += (".lammpstrj",)
VTK = (".vtk", ".vtp", ".vtu")
NEVER, MANY = 1 << 30, 40
# names of sizes, by module: from which a text is long, and what is read of it at a time
FROM = ((text_table, "LONG LARGE"), (counted_rows, "LONG"))

WORD = re.compile(rb"(?<![^\s,;])[^\s,;]+")
BLANK = re.compile(rb"[ \t,;]|\r?\n")
NUMBER = re.compile(rb"[-+]?[\d.]+(?:[eEdD][-+]?\d+)?\Z")
WORDS = (
    b"+1 1. .5 -.5 . - 1e5 1E+5 1e05 1d5 1D-5 1e 1d 0x10 1_0 --1 +-1 00012 -0 0.0 1.0 1e0 1e2 NaN "
    b"-nan +nan nan(1) +inf -inf Infinity infinity 1e-400 4.9e-324 2e-324 1e309 True T F 1% 1# # "
    b'\\N NA null "1" "1 1" \'1\' 1,5 1;2 1:2 (1) [1] 1f 1L 1j 9007199254740993 '
    b"-9007199254740993 9007199254740993.0 9223372036854775807 9223372036854775808 "
    b"18446744073709551615 -9223372036854775808 -9223372036854775809 +9007199254740993 1e18 "
    b"\xef\xbc\x91 \xd9\xa1 \xef\xbb\xbf1 \xc2\xa01 \xe2\x88\x921 \xb2 1\xb2 ITEM: I --- ... //1 !1"
).split()
BLANKS = (b"  ", b"\t", b" \t", b"\r", b"\r\n", b"\n", b"\n\n", b"\x0b", b"\x0c", b"\x1c", b"\x1f")
BLANKS += (b"\x85", b"\xa0", b"\xc2\xa0", b"\xe2\x80\x89", b"\0", b",", b", ", b";", b"", b" #")


def main() -> None:
    """Each reader in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", default=[])
    parser.add_argument("--runs", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("short_and_long"))
    given = parser.parse_args()
    differed, quick = 0, _counted()
    for name in given.readers or READERS:
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            found = compare(name, given.runs, Random(given.seed), Path(folder), given.out, quick)
        differed += found["differ"]
        said = ", ".join(f"{count} {what}" for what, count in sorted(found.items()))
        print(f"{name}: {given.runs} texts, {time.monotonic() - began:.0f} s: {said}", flush=True)
    sys.exit(differed > 0)


def compare(
    name: str, runs: int, random: Random, folder: Path, out: Path, quick: list[None]
) -> Counter[str]:
    """
    How many texts were read or refused alike, and of how many the quick parsers read some rows.

    ``quick`` grows whenever one of them has.
    """
    endings = VTK if name == "vtk" else ENDINGS
    seeds = [one for one in sound_files.seeds(name, folder) if one[0].endswith(endings)]
    # each time one of two, the smaller: it takes less time
    seeds.sort(key=lambda one: len(one[1]))
    companion, _ = sound_files.companion_grains(name)
    found: Counter[str] = Counter()
    for number in range(runs):
        own, data = seeds[min(random.randrange(len(seeds)) for _ in range(2))]
        # beside sound files, which lists may name
        path = folder / f"{number % 50}_{own}"
        text = damaged(data, random)
        path.write_bytes(text)
        options = fuzzing.OPTIONS[0] if random.random() < 0.7 else random.choice(fuzzing.OPTIONS)
        # at most 10 pieces or so, each of which takes its time
        least = len(text) // 10
        pieces = [max(random.choice(some), least) for some in ((10, 100, 1000), (7, 64, 1000))]
        answers = []
        for place, sizes in enumerate(((NEVER, NEVER, NEVER), (0, *pieces))):
            _set_sizes(*sizes)
            # what is kept of a file is kept by its time
            os.utime(path, ns=(0, 1_000_000_000 * (2 * number + place + 1)))
            quick.clear()
            answers.append(answer(path, name, options, companion))
        same, what = _verdict(*answers)
        found[what] += 1
        found["by quick parsers"] += bool(quick)
        if not same:
            _keep(out / f"{name}_{number}_{own}", path, (options, *pieces), answers)
        path.unlink()
    return found


def _counted() -> list[None]:
    """What grows from now on whenever a quick parser has read some rows."""
    found: list[None] = []

    def counting(parse: Callable[..., Any]) -> Callable[..., Any]:
        def parsed(*given: Any, **named: Any) -> Any:
            answer = parse(*given, **named)
            if answer is not None:
                found.append(None)
            return answer

        return parsed

    for module, name in ((text_table, "_parse_piece"),):
        setattr(module, name, counting(getattr(module, name)))
    return found


def _set_sizes(least: int, piece: int, searched: int) -> None:
    for module, names in FROM:
        for name in names.split():
            setattr(module, name, least)
    text_table.PIECE = piece
    text_dump.PIECE = searched


def _verdict(short: Any, long: Any) -> tuple[bool, str]:
    if isinstance(short, str) and isinstance(long, str):
        is_bug = "Traceback" in short + long
        what = "refused" if short == long else "refused in other words"
        return not is_bug, "differ" if is_bug else what
    return short == long, "read" if short == long else "differ"


def _keep(path: Path, source: Path, how: tuple[Any, ...], answers: list[Any]) -> None:
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_bytes(source.read_bytes())
    said = "\n\n".join(
        f"{who}:\n{answer}" for who, answer in zip(("short", "long"), answers, strict=True)
    )
    path.with_name(f"{path.name}.report").write_text(f"{how}\n\n{said}\n", "utf-8", "replace")


def answer(path: Path, name: str, options: ReadOptions, companion: GrainTable) -> Any:
    """All that a reader says of a file, as what can be compared; or its error as a text."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            # columns of a large dump are read when they are looked at
            found = plain(read(sound_files.entry(name, path), name, options, companion))
    except ScanfabError as error:
        return str(error)
    except Exception:
        return traceback.format_exc()
    return found, [(one.category.__name__, str(one.message)) for one in caught]


def read(path: Path, name: str, options: ReadOptions, companion: GrainTable) -> list[Any]:
    """Grains or contacts of the last two frames, and what the frames are."""
    reader = reader_named(name, options)
    kind, frames = reader.kind(path), reader.snapshots(path)
    found: list[Any] = [kind, frames]
    for frame in frames[-2:]:
        if kind == "contacts":
            found.append(reader.read_contacts(frame, options, companion))
        else:
            found.append(reader.read_grains(frame, options))
    return found


def plain(value: Any) -> Any:
    """A value as tuples of texts, of which arrays are equal if they are so to the last bit."""
    if isinstance(value, Mapping):
        return tuple((key, plain(one)) for key, one in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(plain, value))
    if isinstance(value, Cell):
        return plain([value.vectors, value.origin, value.periodic, repr(value.space)])
    if isinstance(value, np.ndarray):
        # there is one kind only of what is no number
        same = np.where(np.isnan(value), np.nan, value) if value.dtype.kind == "f" else value
        return value.dtype.str, value.shape, same.tobytes().hex()
    return repr(value)


def damaged(data: bytes, random: Random) -> bytes:
    """A text with more rows, with words and blanks of other kinds, or with any damage."""
    if random.random() < 0.8:
        # ids, too, have decimals in some seeds
        data = re.sub(rb"(?<=\d)\.0(?!\d)", b"", data)
    if random.random() < 0.6:
        data = _repeated(data, random)
    for _ in range(random.choice((0, 0, 1, 1, 1, 2))):
        change = random.choice((_other_word, _other_word, _other_blank, _other_blanks, _decimals))
        data = change(data, random)
    return fuzzing.mutate(data, random) if random.random() < 0.2 else data


def _repeated(data: bytes, random: Random) -> bytes:
    """Rows of numbers several times, with other ids, and their number corrected above them."""
    lines = data.split(b"\n")
    runs, begin = [], 0
    for end in range(1, len(lines) + 1):
        if end == len(lines) or _shape(lines[end]) != _shape(lines[begin]):
            if _shape(lines[begin]):
                runs.append((begin, end))
            begin = end
    if not runs:
        return data
    most = max(runs, key=lambda one: one[1] - one[0])
    first, stop = most if random.random() < 0.7 else random.choice(runs)
    old, rows = stop - first, lines[first:stop]
    times = random.randint(1, max(MANY // old, 1))
    ids = random.random() < 0.3
    for k in range(1, times):
        rows += [_with_id(line, 1000 * k) if ids else line for line in lines[first:stop]]
    above = b"\n".join([*lines[:first], b""])
    count = re.compile(rb"(?<!\S)%d(?=\s)" % old)
    return b"\n".join([count.sub(b"%d" % (old * times), above) + rows[0], *rows[1:], *lines[stop:]])


def _shape(line: bytes) -> int:
    """How many words a line of numbers has; 0 if there are others among them."""
    words = WORD.findall(line)
    return len(words) if sum(NUMBER.match(word) is not None for word in words) > 1 else 0


def _with_id(line: bytes, more: int) -> bytes:
    """A row whose first whole number is larger."""
    return re.sub(
        rb"(?<![\w.-])\d+(?![\w.])", lambda one: b"%d" % (int(one[0]) + more), line, count=1
    )


def _other_word(data: bytes, random: Random) -> bytes:
    found = list(WORD.finditer(data))
    if not found:
        return data
    match = random.choice(found[-100:] if random.random() < 0.7 else found)
    word = random.choice([*WORDS, *fuzzing.VALUES])
    word = random.choice((word, word, word + match[0], match[0] + word))
    return data[: match.start()] + word + data[match.end() :]


def _other_blank(data: bytes, random: Random) -> bytes:
    found = list(BLANK.finditer(data))
    if not found:
        return data
    match = random.choice(found[-100:] if random.random() < 0.7 else found)
    blank = random.choice(BLANKS)
    blank = random.choice((blank, blank + match[0], match[0] + blank))
    return data[: match.start()] + blank + data[match.end() :]


def _other_blanks(data: bytes, random: Random) -> bytes:
    """The same blank in all lines."""
    old, new = random.choice(
        (
            (b"\n", b"\r\n"),
            (b"\n", random.choice(BLANKS) + b"\n"),
            (b"\n", b"\n" + random.choice(BLANKS)),
            (b" ", random.choice(BLANKS)),
            (b",", random.choice(BLANKS)),
            (b"\t", random.choice(BLANKS)),
        )
    )
    place = 0 if random.random() < 0.3 else data.find(b"\n", random.randint(0, len(data))) + 1
    return data[:place] + data[place:].replace(old, new)


def _decimals(data: bytes, random: Random) -> bytes:
    """Numbers of many digits in the place of some, whose nearest double is not found easily."""

    def number(match: re.Match[bytes]) -> bytes:
        if NUMBER.match(match[0]) is None or random.random() < 0.5:
            return match[0]
        digits, power = random.randint(1, 22), random.choice((0, 0, random.randint(-330, 310)))
        word = f"{random.choice((0, 1, 7, 100)) + random.random():.{digits}f}"
        return (word + f"e{power}" * (power != 0)).encode()

    place = data.find(b"\n", random.randint(0, len(data))) + 1
    return data[:place] + WORD.sub(number, data[place:])


if __name__ == "__main__":
    main()
