"""Tables of text as programs write them: the same numbers, or the line that is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scanfab.base.errors import ReadError
from scanfab.io.parse import sheet_columns
from scanfab.io.parse.kernels import single_blanks
from scanfab.io.parse.sheet_columns import read_columns
from scanfab.io.parse.sheet_layout import SAMPLE, layout_of, read_text
from tests.helpers.uncompiled import run_uncompiled

PATH = Path("t.csv")
ROWS = [[1, 0.5, -2.25, 1e-3], [2, 1.5, 0.125, 2e-3], [9007199254740993, 2.5, 3e5, 4e-3]]
NAMES = ["id", "x", "y", "radius"]


def table(separator=",", names=NAMES, rows=ROWS, end="\n", comma=False):
    lines = [separator.join(names)] if names else []
    for row in rows:
        line = separator.join(map(repr, row))
        lines.append(line.replace(".", ",") if comma else line)
    return "".join(line + end for line in lines)


def read(text, skip=0, numbers=(0, 1, 2, 3), whole=(0,)):
    data = text if isinstance(text, bytes) else text.encode()
    layout = layout_of(PATH, data, skip)
    return layout, read_columns(PATH, data, layout, numbers, whole)


# a comma cannot be both
SPELLINGS = [(one, False) for one in (",", ";", "\t", " ", "  ", "\t ", ", ")]
SPELLINGS += [(one, True) for one in (";", "\t", " ", "  ", "\t ")]


def assert_right(found):
    assert found[0].dtype == np.int64
    for place, expected in enumerate(zip(*ROWS, strict=True)):
        np.testing.assert_array_equal(found[place], expected)


@pytest.mark.parametrize("end", ["\n", "\r\n", " \n"])
@pytest.mark.parametrize("names", [NAMES, None])
@pytest.mark.parametrize(("separator", "comma"), SPELLINGS)
def test_all_separators_decimal_signs_and_line_ends_give_the_same_numbers(
    separator, names, end, comma
):
    layout, found = read(table(separator, names, end=end, comma=comma))
    assert layout.names == (None if names is None else tuple(names))
    assert layout.has_commas == comma
    assert_right(found)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings(tmp_path, encoding, end):
    path = tmp_path / "t.csv"
    path.write_bytes(table(end=end).encode(encoding))
    data = read_text(path)
    assert_right(read_columns(path, data, layout_of(path, data, 0), range(4), [0]))


def test_latin_1_in_names_and_words_is_no_hindrance():
    text = (
        table(names=["id", "x", "y", "größe"]).replace("\n", ",é\n").replace("größe,é", "größe,ö")
    )
    layout, found = read(text.encode("latin-1"))
    assert layout.names == ("id", "x", "y", "größe", "ö")
    assert_right(found)
    assert found[4].dtype.kind == "U"


def test_words_of_fortran_and_quotes():
    text = 'id,x,y,radius\n"1",.5D0,-22.5d-1,"1.0E-3"\n2,+1.5,1.25D-01,2D-3\n'
    _, found = read(text + "9007199254740993,2.5,3D5,4d-3\n")
    assert_right(found)


def test_values_that_are_no_numbers_stay_so_and_gaps_of_others_are_nan():
    _, found = read("x,y,z\n1,nan,\n-inf,NaN,3\n", numbers=(0,), whole=())
    np.testing.assert_array_equal(found[0], [1, -np.inf])
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2], [np.nan, 3])


def test_a_table_without_rows():
    layout, found = read("id,x,y,radius\n")
    assert layout.width == 4
    assert all(len(values) == 0 for values in found.values())


def test_comments_and_skipped_lines_stand_before_the_table():
    layout, found = read("made, by, hand\n2026\n\n% id x y radius\n" + table(" ", None), skip=2)
    assert layout.names == tuple(NAMES)
    assert layout.first_line == 5
    assert_right(found)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (table() + "1,2,3\n", "line 5: expected 4 columns as in line 2, found 3"),
        (table(rows=ROWS * 10) + "1,2,3\n", "line 32: expected 4 columns, found 3"),
        (table(rows=ROWS * 10) + "1,2,3,4,5\n" + table(names=None), "line 32: .*found 5"),
        (
            table(rows=ROWS * 10) + "1,2,,4\n",
            "line 32: expected a number in the column y, found no",
        ),
        (table(rows=ROWS * 10) + "1,2,q,4\n", "line 32: expected a number in the column y, .*'q'"),
        (table(rows=ROWS * 10) + "1,2,1 000,4\n", "line 32: .* the column y, found '1 000'"),
        (table(rows=ROWS * 10) + "\n" + table(names=None), "line 32: .* found an empty line"),
        (table(rows=ROWS * 10) + "# 2\n" + table(names=None), "line 32: .* found '# 2'"),
        (table(rows=ROWS * 10) + table(), "line 32: expected a number .*, found 'id'"),
        (table(";", rows=ROWS * 10, comma=True) + "1;2,5;1.000;4\n", "line 32: .* decimal comma"),
        (table(names=["id", "x", "y"]), "names of the columns are 3 .* but 4 columns follow"),
        (table(names=[*NAMES, "z"]), "names of the columns are 5 .* but 4 columns follow"),
        ("id,x,y,radius\n-,m,m,m\n" + table(names=None), "line 2: expected numbers below the na"),
        ("", "expected a table, found no row"),
        ("# only\n\n", "expected a table, found no row"),
        (table(rows=ROWS * 10) + '"1,2,3,4\n', "line 32: expected"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(text, message):
    with pytest.raises(ReadError, match=message):
        read(text)


def test_more_lines_are_skipped_than_there_are():
    with pytest.raises(ReadError, match="`skip=9` leaves no line: it has 4"):
        read(table(), skip=9)


@pytest.mark.parametrize("byte", [b"\0", b"\x01"])
def test_what_is_no_text_is_told(tmp_path, byte):
    path = tmp_path / "t.csv"
    path.write_bytes(table().encode() + byte)
    with pytest.raises(ReadError, match=f"line 5: expected text, found the byte {byte[0]}"):
        read_text(path)


@pytest.mark.parametrize("word", ["1", "grain"])
def test_a_byte_of_zero_behind_the_first_rows_is_told(word):
    rows = f"1,2,3,4,{word}\n" * 20_000
    with pytest.raises(ReadError, match="line 20002: expected text, found the byte 0"):
        read(f"x,y,z,radius,kind\n{rows}1,2,3,4,{word}\0\n", whole=())


def test_names_are_not_read_as_others_where_a_row_has_an_empty_word_at_its_end():
    layout, found = read(table().replace("\n", ",\n", 1))
    assert layout.names == tuple(NAMES)
    assert_right(found)
    _, found = read("id,x,y,radius\n" + table(names=None).replace("\n", ",\n"))
    assert_right(found)


NUMBERS = st.floats(allow_nan=False, width=64)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    rows=st.lists(st.lists(NUMBERS, min_size=3, max_size=3), min_size=1, max_size=2 * SAMPLE),
    separator=st.sampled_from([",", ";", "\t", " ", "   "]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_numbers_are_those_of_python(rows, separator, end):
    layout, found = read(table(separator, ["a", "b", "c"], rows, end), numbers=(0, 1, 2), whole=())
    for place in range(3):
        np.testing.assert_array_equal(found[place], [row[place] for row in rows])
    assert layout.width == 3


def squeezed(text):
    """In plain words: one blank between two words, and none around them."""
    return b"\n".join(b" ".join(line.split()) for line in text.split(b"\n"))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.text(alphabet="1. \t\n\r\v\0", max_size=60))
def test_blanks_are_made_single(text):
    data = np.frombuffer(text.encode(), np.uint8)
    out = np.empty_like(data)
    size = single_blanks(data, out)
    # returns stand at the end of a line, or no parser takes them for blanks
    assert (size < 0) == bool(re.search(r"[\v\0]|\r(?![\r\n]|\Z)", text))
    assert size < 0 or out[:size].tobytes() == squeezed(text.encode())


def outcome(text, numbers, whole):
    try:
        _, found = read(text, numbers=numbers, whole=whole)
    except ReadError as error:
        return str(error)
    return {place: (str(values.dtype), str(values.tolist())) for place, values in found.items()}


# most are numbers, or nothing
WORDS = ["", "1", "2.5", "-3e2", "nan"] * 5
WORDS += [" 4", "x", "1,5", "1d3", '"6"', "7\r", "#", "8 ", "\t"]


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    rows=st.lists(st.lists(st.sampled_from(WORDS), min_size=4, max_size=5), max_size=5),
    separator=st.sampled_from([",", ";", "\t", " "]),
    end=st.sampled_from(["\n", "\n", "\r\n", "\n\n"]),
    whole=st.sampled_from([(), (), (0,)]),
    numbers=st.sampled_from([(), (0,), (0, 1, 2)]),
    has_end=st.booleans(),
    cut=st.sampled_from([0, 0, 1, 2]),
)
def test_gaps_are_the_same_word_by_word(rows, separator, end, whole, numbers, has_end, cut):
    sound = [["1", "2.5", "3", "4", "", ""][: 4 + has_end]] * 2
    text = "".join(separator.join(row) + end for row in [*sound, *rows])
    text = text[: len(text) - cut]
    quick = outcome(text, numbers, whole)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sheet_columns, "_regular", lambda *given, **named: None)
        assert quick == outcome(text, numbers, whole)


def test_a_word_more_at_the_end_does_not_hide_a_row_that_lacks_one():
    rows = "1,0,1,0.5,7,\n" * 25 + "1,0,1,0.5,\n" + "2,0,7,3.0,0.5,7,"
    with pytest.raises(ReadError, match="line 27: expected 6 columns, found 5"):
        read("y,z,x,radius,a,\n" + rows)


@pytest.mark.parametrize("separator", [",", ";"])
def test_an_id_that_is_a_tab_is_none(separator):
    rows = "id,x,y,radius\n\t,1,0,0.5\n2,2,0,0.5\n".replace(",", separator)
    with pytest.raises(ReadError, match="line 2: expected a number in the column id"):
        read(rows)


def test_a_long_table_with_an_empty_word_at_each_end_is_read_by_polars(monkeypatch):
    monkeypatch.setattr(sheet_columns, "_word_by_word", None)
    layout, found = read("id,x,y,radius,\n" + "1,0.5,2.5,3,\n" * 50)
    assert layout.names == ("id", "x", "y", "radius", "")
    assert found[3].tolist() == [3.0] * 50
    assert np.isnan(found[4]).all()


def test_blanks_are_made_single_without_the_compiler():
    run_uncompiled(
        "import numpy as np; from scanfab.io.parse.kernels import single_blanks\n"
        "data = np.frombuffer(b'  1 \\t 2 \\n\\n 3', np.uint8); out = np.empty_like(data)\n"
        "assert out[: single_blanks(data, out)].tobytes() == b'1 2\\n\\n3'"
    )


def test_a_first_row_that_begins_with_a_word_is_no_header():
    layout, found = read("P 0.5 1.5 2.5\nP 3.5 4.5 5.5\n", numbers=(1, 2, 3), whole=())
    assert layout.names is None
    np.testing.assert_array_equal(found[1], [0.5, 3.5])
