"""The parser of long regular tables against the tolerant one: the same numbers, or none."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest

from scanfab.io.parse import text_table as regular
from scanfab.io.parse.text_table import TextTable, read_regular, read_to_end
from tests.helpers.dumps import write

WIDTH = 3
# polars is told to be strict where all columns are wanted
SOME, ALL = (0, 2), (0, 1, 2)


@pytest.fixture(params=[1, 7, 100, regular.PIECE], autouse=True)
def _piece(request, monkeypatch):
    """Tables are parsed in pieces of about so many bytes."""
    monkeypatch.setattr(regular, "PIECE", request.param)


def columns_of(path, text, places=SOME, count=2, kind=float):
    """What the parser says of the columns of a file that is nothing but rows; None if nothing."""
    header = b"ITEM: ATOMS a b c\n"
    path.write_bytes(header + text)
    table = TextTable(path, len(header), len(header + text), WIDTH, count)
    found = {place: np.full(count, -1, kind) for place in places}
    return list(found.values()) if read_regular(table, found) else None


@pytest.mark.parametrize("end", [b" \n", b"\n"])
def test_regular_rows_are_read(tmp_path, end):
    found = columns_of(tmp_path / "a", b"1 2 3" + end + b"4 5 6" + end)
    np.testing.assert_array_equal(found, [[1, 4], [3, 6]])


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(b"1 2 3 \n4  5 6 \n", id="two blanks"),
        pytest.param(b"1 2 3 \n  5 6 \n", id="a value blanked out"),
        pytest.param(b"1 2 3 \n4 5 6  7 \n", id="a word behind two blanks"),
        pytest.param(b" 1 2 3 \n4 5 6 \n", id="leading blank"),
        pytest.param(b"1\t2 2 3 \n4 5 6 \n", id="tab"),
        pytest.param(b"1 2 3 \r\n4 5 6 \r\n", id="CRLF"),
        pytest.param(b"1 2 3 \n4 5 6", id="no line end"),
        pytest.param(b"1 2 3 \n4 5 \n", id="word missing"),
        pytest.param(b"1 2 3 \n4 5 6 7\n", id="word too many"),
        pytest.param(b"1 2 3\n4 5 6 7 8\n", id="words too many"),
        pytest.param(b"1 2 3 \n4 5 six \n", id="word"),
        pytest.param(b'1 2 3 \n"4" 5 6 \n', id="quotes"),
        pytest.param(b"x^1 2 3 \n4 5 6 \n", id="like a compressed file"),
        pytest.param(b"1 2 3 \n\x1f\x8b4 5 6 \n", id="like another compressed file"),
        pytest.param(b"1 2 3 \n\xef\xbb\xbf4 5 6 \n", id="byte order mark"),
        pytest.param(b"1 2 3 \n\n4 5 6 \n", id="blank line"),
        pytest.param(b"1 2 3 \n", id="row missing"),
        pytest.param(b"1 2 3 \n4 5 6 \n7 8 9 \n", id="row too many"),
        pytest.param(b"1 2 3 4\n5 6 \n", id="word in the line before"),
        pytest.param(b"1 2 3 \n4  5 6\n", id="blank from the end of its line"),
        pytest.param(b"1  2 3 \n4 5 6\n", id="blank from the end of another line"),
        pytest.param(b"4 5 6 \n 1 2 3\n", id="blank from the end to the beginning"),
    ],
)
@pytest.mark.parametrize("places", [SOME, ALL])
def test_what_is_not_regular_is_left_to_the_tolerant_parser(tmp_path, text, places):
    assert columns_of(tmp_path / "a", text, places) is None


@pytest.mark.parametrize("places", [SOME, ALL])
def test_a_blank_anywhere_is_seen(tmp_path, places):
    text = b"1 2 3 \n4 5 6 \n"
    assert columns_of(tmp_path / "a", text, places) is not None
    for place in range(len(text)):
        spoilt = text[:place] + b" " + text[place:]
        assert columns_of(tmp_path / "a", spoilt, places) is None, place


def test_a_file_that_is_replaced_is_read_as_it_was(tmp_path, monkeypatch):
    path, pieces = tmp_path / "a", regular._pieces

    def replaced(*args):
        for piece in pieces(*args):
            yield piece
            write(tmp_path / "b", "7 7 7 \n" * 4)
            (tmp_path / "b").replace(path)

    monkeypatch.setattr(regular, "_pieces", replaced)
    found = columns_of(path, b"1 2 3 \n4 5 6 \n")
    np.testing.assert_array_equal(found, [[1, 4], [3, 6]])


def number(generator):
    """The text of a number as programs write them."""
    bits = struct.unpack("d", struct.pack("Q", generator.getrandbits(64)))[0]
    value = generator.gauss(0, 1) * 10 ** generator.randint(-30, 30)
    shape = generator.choice(["%g", "%.17g", "%.20e", "%.1f"])
    return generator.choice([repr(bits), f"{bits:.17g}", shape % value, "-nan", "inf"])


def test_every_number_is_the_nearest_double(tmp_path):
    generator = random.Random(0)
    # a number is parsed in the same way in pieces of any size: small ones cut elsewhere
    words = [number(generator) for _ in range(3 * (20_000 if regular.PIECE > 100 else 1_000))]
    rows = [" ".join(words[k : k + 3]) for k in range(0, len(words), 3)]
    found = columns_of(tmp_path / "a", ("\n".join(rows) + "\n").encode(), (0, 1, 2), len(rows))
    right = np.array([float(word) for word in words]).reshape(-1, 3).T
    np.testing.assert_array_equal(found, right)


def test_ids_are_exact_up_to_two_to_the_53(tmp_path):
    text = b"%d 0 %d \n%d 0 0 \n" % (2**53, 2**53 - 1, 2**53 - 2)
    found = columns_of(tmp_path / "a", text)
    assert [int(id) for id in [*found[0], found[1][0]]] == [2**53, 2**53 - 2, 2**53 - 1]


def test_whole_numbers_are_exact(tmp_path):
    text = b"%d 0 %d \n%d 0 -7 \n" % (2**53 + 1, 2**62 - 1, 2**53)
    found = columns_of(tmp_path / "a", text, kind=int)
    assert [column.tolist() for column in found] == [[2**53 + 1, 2**53], [2**62 - 1, -7]]


@pytest.mark.parametrize("word", [b"1.0", b"1e3", b"nan", b"10000000000000000000", b"0x1"])
def test_what_is_no_whole_number_is_left_to_the_tolerant_parser(tmp_path, word):
    assert columns_of(tmp_path / "a", b"1 2 3 \n" + word + b" 5 6 \n", kind=int) is None


@pytest.mark.parametrize("seed", range(200))
def test_damaged_tables_give_the_numbers_of_the_tolerant_parser(tmp_path, seed):
    generator = random.Random(seed)
    end = generator.choice([b"\n", b" \n"])
    text = bytearray(b"".join(b"%d 0.5 1e-3" % k + end for k in range(1, 6)))
    for _ in range(generator.randint(1, 3)):
        place = generator.randrange(len(text))
        size = generator.choice([0, 1, 1, 5])
        text[place : place + size] = generator.choice([b"", b" ", b"\n", b"7", b"x", b".", b"\t"])
    if generator.random() < 0.5:  # blanks that change their place keep their number
        blanks = [place for place, byte in enumerate(text) if byte == 32]
        for place in generator.sample(blanks, min(len(blanks), 2)):
            del text[place]
            text.insert(generator.randrange(len(text)), 32)
    for places in (SOME, ALL):
        found = columns_of(tmp_path / "a", bytes(text), places, count=5)
        if found is not None:
            right = np.loadtxt(tmp_path / "a", usecols=places, ndmin=2, max_rows=5, skiprows=1)
            np.testing.assert_array_equal(np.transpose(found), right)


def test_a_text_whose_numbers_may_not_fit_into_memory_is_not_parsed_by_pieces(
    tmp_path, monkeypatch
):
    path = tmp_path / "a"
    path.write_text("1 1\n" * 1000)
    monkeypatch.setattr(regular, "PIECE", 100)
    for lacks in (0, 1):
        free = regular.ROOM + regular.NUMBERS * 4000 - lacks
        monkeypatch.setattr(regular, "free_memory", lambda free=free: free)
        assert (read_to_end(path, 0) is None) == bool(lacks)
