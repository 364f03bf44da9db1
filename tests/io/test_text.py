"""One table of text: the same numbers however it is written, or the line that is wrong."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scanfab
from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io import text
from scanfab.io.files import growing
from scanfab.io.reader import Snapshot
from scanfab.io.text import Layout, read_rows
from tests.helpers.dumps import refuses, write

HERE = Snapshot(Path("t.txt"))
ROWS = [[1, 0.5, -2.25, 1e-3], [2, 1.5, 0.125, 2e-3], [9007199254740993, 2.5, 3e5, 4e-3]] * 9
NAMES = ["id", "x", "y", "radius"]
# a comma cannot be both
SPELLINGS = [(one, False) for one in (",", ";", "\t", " ", "  ", "\t ", ", ")]
SPELLINGS += [(one, True) for one in (";", "\t", " ", "  ", "\t ")]


def table(separator=",", names=NAMES, rows=ROWS, end="\n", comma=False):
    text = "".join(separator.join(map(repr, row)) + end for row in rows)
    head = separator.join(names) + end if names else ""
    return head + (text.replace(".", ",") if comma else text)


def read(path, content, **options):
    """A table of any layout, whose columns are named by their numbers if it has no names."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    columns = {"id": "1", "x": "2", "y": "3", "radius": "4", "z": "5"}
    return scanfab.read(path, format="table", columns=columns, contacts="geometric", **options)


@pytest.mark.parametrize("end", ["\n", "\r\n", " \n"])
@pytest.mark.parametrize("names", [[*NAMES, "z"], None])
@pytest.mark.parametrize(("separator", "comma"), SPELLINGS)
def test_all_ways_to_write_a_table_give_the_same_numbers(tmp_path, separator, names, end, comma):
    rows = [[number, *row[1:], 7] for number, row in enumerate(ROWS, start=2**53 + 1)]
    content = table(separator, names, rows, end, comma)
    packing = read(tmp_path / "t.csv", content)
    np.testing.assert_array_equal(packing.id, [row[0] for row in rows])
    np.testing.assert_array_equal(packing.position[:, :2], [row[1:3] for row in rows])
    np.testing.assert_array_equal(packing.radius, [row[3] for row in rows])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_encodings(tmp_path, encoding):
    content = "id,x,y,größe,z\n1,2,3,4,5\n6,7,8,9,9\n".encode(encoding)
    assert read(tmp_path / "t.csv", content).radius.tolist() == [4, 9]


def rows_of(content, names="abcd", **layout):
    return read_rows(HERE, content.encode(), Layout(tuple(names), **layout))


def test_words_of_fortran_and_quotes_are_numbers():
    found = rows_of('"1",.5D0,-2.5d-1,"1.0E-3"\n2,+1.5,1,2D-3\n', separator=",", whole="a")
    assert [*zip(*found.values(), strict=True)] == [(1, 0.5, -0.25, 1e-3), (2, 1.5, 1, 2e-3)]


def test_kinds_of_columns():
    content = "1,C,,x y\n2.5,H,3,\n9007199254740993,N,nan,-\n"
    found = rows_of(content, separator=",", text="b", optional="cd")
    assert found["a"].dtype == np.float64
    assert found["b"].tolist() == ["C", "H", "N"]
    np.testing.assert_array_equal(found["c"], [np.nan, 3, np.nan])
    assert found["d"].tolist() == ["x y", "", "-"]
    found = rows_of("1 2\n3 2.0\n", "ab", whole="ab")
    assert (found["a"].dtype, found["b"].dtype) == (np.int64, np.float64)
    assert rows_of("1 2 3\n", "aba")["a"].tolist() == [1]
    found = rows_of("\n \n", "ab", whole="a")
    assert [found[name].dtype.kind + str(len(found[name])) for name in "ab"] == ["i0", "f0"]


WRONG_LINES = [
    ("1,2,3", "line 20: expected 4 columns, found 3"),
    ("1,2,3,4,5", "line 20: expected 4 columns, found 5"),
    ("1,2,,4", "line 20: expected a number in the column c, found nothing"),
    ("1,2,q,4", "line 20: expected a number in the column c, found 'q'"),
    ("1,2,1_000,4", "line 20: .*'1_000'"),
    ("1,2,0x10,4", "line 20: .*'0x10'"),
    ("1,2,3\0,4", "line 20: .*'3.x00'"),
    ("\n1,2,3,4", "line 20: expected 4 columns, found 0"),
    ("# 2\n1,2,3,4", "line 20: expected 4 columns"),
    ('"1,2,3,4', "line 20: expected 4 columns"),
    ("1,2\r3,4,5", "line 20: expected"),
    ("\t,2,3,4", "line 20: expected a number in the column a, found nothing"),
]


@pytest.mark.parametrize(("last", "message"), WRONG_LINES)
@pytest.mark.parametrize("separator", [",", ";", " "])
def test_what_is_wrong_is_told_with_its_line(last, message, separator):
    content = ("1,2,3,4\n" * 10 + last + "\n" + "1,2,3,4\n" * 9).replace(",", separator)
    if separator == " " and (",," in last or '"' in last or "\t" in last):
        message = "line 20: expected"
    with pytest.raises(ReadError, match=f"t.txt, {message}"):
        rows_of(content, separator=separator, line=10)


def test_a_row_that_lacks_a_word_is_not_hidden_by_gaps_or_by_one_with_a_word_more():
    rows = "1,0,,0.5,7,\n" * 25 + "1,0,1,0.5,\n" + "2,0,7,3.0,0.5,7,\n"
    with pytest.raises(ReadError, match="line 26: expected"):
        rows_of(rows, "abcde", separator=",", optional="c")
    with pytest.raises(ReadError, match="line 27: expected 5 columns, found 7"):
        rows_of(rows.replace("7", '"7"'), "abcde", separator=",", optional="ce")


def test_a_point_beside_decimal_commas_may_be_a_sign_of_thousands():
    with pytest.raises(ReadError, match=r"line 2: .* decimal comma in the column b, .*'1\.000'"):
        rows_of("1,5;2\n3;1.000\n", "ab", separator=";", comma=True)


@pytest.mark.parametrize("count", [1, 3])
def test_rows_are_as_many_as_the_header_counts(count):
    with pytest.raises(ReadError, match=f"step 7: the header counts {count} atoms, found 2"):
        read_rows(Snapshot(HERE.path, 7), b"1\n2\n", Layout(("a",)), count=count, what="atoms")


def test_a_last_line_without_an_end_is_told_and_an_error_while_the_file_grows():
    with pytest.warns(ScanfabWarning, match=r"t\.txt: the last line has no end"):
        assert rows_of("1 2\n3 4", "ab")["b"].tolist() == [2, 4]
    with growing(), pytest.raises(ReadError, match="still being written"):
        rows_of("1 2\n3 4", "ab")


def test_empty_lines_around_the_rows_are_left_out_however_many():
    """Also hundreds of millions, in one pass."""
    empty = "\n" * 500_000
    assert rows_of(f"{empty} 1\t2 \n3 4\n \t\n{empty}", "ab")["b"].tolist() == [2, 4]
    with pytest.raises(ReadError, match="line 500002: expected a number in the column a"):
        rows_of(f"{empty}1 2\nx 4\n{empty}", "ab")


WORDS = ["1", "2.5", "-3e2", "nan"] * 6 + ["", " 4", "x", "1,5", "1d3", '"6"', "7\r", "#", "\t"]


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    rows=st.lists(st.lists(st.sampled_from(WORDS), min_size=3, max_size=4), max_size=5),
    separator=st.sampled_from([",", ";", "\t", " "]),
    end=st.sampled_from(["\n", "\n", "\r\n", "\n\n"]),
    behind=st.booleans(),
)
def test_no_word_is_lost_or_moved(rows, separator, end, behind):
    """What is read is what each line holds, word by word; all else is an error."""
    rows = [["1", "2.5", "3"]] * 2 + rows
    content = "".join(separator.join([*row, *([""] * behind)]) + end for row in rows)
    try:
        found = rows_of(content, "abc", separator=separator, optional="bc")
    except ReadError:
        return
    lines = [line for line in content.replace("\r\n", "\n").split("\n") if line.strip()]
    assert len(found["a"]) == len(lines)
    for row, line in enumerate(lines):
        for name, word in zip("abc", text.words_of(line, separator), strict=False):
            value, plain = found[name][row], word.strip().replace("d", "e")
            same = str(value) == word.strip() or (not plain and np.isnan(value))
            assert same or np.array_equal(float(value), float(plain), equal_nan=True)


def test_a_text_that_looks_compressed_is_not_unpacked():
    assert rows_of("1 2\n", "ab", text="a")["b"].tolist() == [2]
    with pytest.raises(ReadError, match="cannot be read as a table"):
        rows_of("x^ 2\n", "ab", text="a")


# layouts, by the first rows


def test_comments_and_skipped_lines_stand_before_the_table(tmp_path):
    path = write(tmp_path / "t.csv", "made, by, hand\n2026\n\n% x y z r\n1 2 3 4\n")
    assert scanfab.read(path, skip=2).radius.tolist() == [4]
    refuses(path, r"no row .`skip=9`", skip=9, format="table")


@pytest.mark.parametrize("behind", [(",", ","), ("", ","), (",", "")])
def test_a_separator_at_the_end_of_each_row_is_no_column(tmp_path, behind):
    names, rows = behind
    path = write(tmp_path / "t.csv", f"x,y,z,radius{names}\n1,2,3,4{rows}\n5,2,3,4{rows}\n")
    assert scanfab.read(path).radius.tolist() == [4, 4]


def test_signs_of_thousands_are_no_decimal_commas(tmp_path):
    content = "x\ty\tz\tradius\n120\t840\t1,080\t60\n240\t1,200\t10\t60\n"
    refuses(write(tmp_path / "a.tsv", content), "'1,080' may be a decimal sign or separate thous")
    packing = scanfab.read(write(tmp_path / "b.tsv", content.replace("840", "0,840")))
    np.testing.assert_array_equal(packing.position, [[120, 0.84, 1.08], [240, 1.2, 10]])
