"""Tables that read back the same, and files that are broken, complete or untouched."""

import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanfab.base.errors import ReadError, SettingsError
from scanfab.table.columns import COLUMNS, table_columns
from scanfab.table.formats import OWN_FORMATS, read_rows
from scanfab.table.table import Table, load
from scanfab.table.writing import Excerpt, check_output, write_rows, write_to
from tests.table.test_table import a_row

DIGITS = (0, 18, "x", 2.5)
every_format = pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1),
)
def test_numbers_and_names_read_back_the_same_and_what_does_not_exist_is_empty(value, name):
    stream = io.StringIO(newline="")
    write_to(stream, OWN_FORMATS[0], [a_row(alpha_vs=value, source=name)], table_columns())
    (row,) = csv.DictReader(io.StringIO(stream.getvalue(), newline=""))
    assert row["alpha_vs"] == repr(value)
    assert (row["source"], row["strain"], row["step"], row["grains"]) == (name, "", "", "0")


def test_the_header_and_each_row_are_written_as_the_rows_come(tmp_path):
    path = tmp_path / "t.csv"

    def rows():
        for count in (0, 2, 3):
            assert len(path.read_text().splitlines()) == count
            yield a_row()

    with open(path, "w", newline="") as stream:
        OWN_FORMATS[0].write(stream, rows(), table_columns())
    lines = path.read_text().splitlines()
    assert (lines[0], len(lines)) == (",".join(COLUMNS), 4)


def test_a_table_replaces_the_old_one_and_its_manifest(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("old")
    (tmp_path / "t.csv.manifest.json").write_text("of the old file")
    write_rows(path, [a_row(frame=0), a_row(frame=1)], table_columns())
    assert load(path)["frame"].tolist() == [0, 1]
    assert list(tmp_path.iterdir()) == [path]
    # lines end alike everywhere
    assert b"\r" not in path.read_bytes()


@pytest.mark.parametrize("name", ["t.docx", "t", "t.csv.gz", ".csv", "nowhere/t.csv"])
def test_what_cannot_be_written_is_refused_before_anything_is(tmp_path, name):
    with pytest.raises(SettingsError, match=r"can be written as .csv|there is no folder .*nowhere"):
        check_output(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 17))
def test_digits_are_significant_ones_of_floats_alone(value, digits):
    excerpt = Excerpt.make(table_columns(), None, digits)
    found = excerpt.of(a_row(alpha_vs=value, frame=123456, mean_length=None, alpha_c=0.0123456))
    assert (found["frame"], found["mean_length"]) == (123456, None)
    assert found["alpha_c"] == pytest.approx(0.0123456, rel=10 ** (1 - digits))
    assert digits < 17 or found["alpha_vs"] == value
    assert digits != 3 or found["alpha_c"] == 0.0123
    # rounded again they stay as they are
    assert excerpt.of(found) == found
    assert list(found) == list(COLUMNS)


@every_format
def test_columns_come_in_the_order_in_which_they_are_named(tmp_path, suffix):
    path = tmp_path / f"t{suffix}"
    excerpt = Excerpt.make(table_columns(), "alpha_vs, frame,variant", 2)
    assert Excerpt.make(table_columns(), ["alpha_vs", "frame", "variant"], 2) == excerpt
    write_rows(path, [a_row(alpha_vs=0.125, frame=3, variant="c")], table_columns(), excerpt)
    (row,) = read_rows(path)
    assert list(row.items()) == [("alpha_vs", 0.12), ("frame", 3), ("variant", "c")]


REFUSED = [
    ("alpha_v", 17, "there is no column 'alpha_v': did you mean 'alpha_vs'?"),
    ("", 17, "there is no column ''"),
    ("frame,frame", 17, "the column frame is listed more than once"),
    (3, 17, "fields: expected names of columns, found 3"),
    ([], 17, r"fields: expected names of columns, found \[\]"),
    *((None, digits, f"expected a number from 1 to 17, found {digits!r}") for digits in DIGITS),
]


@pytest.mark.parametrize(("fields", "digits", "message"), REFUSED)
def test_columns_and_digits_that_do_not_exist_are_refused(fields, digits, message):
    with pytest.raises(SettingsError, match=message):
        Excerpt.make(table_columns(), fields, digits)


@every_format
def test_numbers_of_numpy_are_written_and_what_is_not_finite_or_no_row_is_missing(tmp_path, suffix):
    path = tmp_path / f"t{suffix}"
    numbers = {"frame": np.int64(0), "a": np.float64(0.125), "n": np.int32(3)}
    Table([{**numbers, "b": math.nan, "c": -math.inf}]).save(path, digits=2)
    assert read_rows(path) == [{"frame": 0, "a": 0.12, "n": 3, "b": None, "c": None}]
    Table().save(path)
    assert load(path) == Table()


@every_format
def test_lists_are_written_where_there_can_be_some(tmp_path, suffix):
    path, table = tmp_path / f"t{suffix}", Table([{"n": 1, "a": [1, 2]}, {"n": 2, "a": None}])
    table.save(path)
    is_text = suffix in (".csv", ".tsv")
    expected = [{"n": 1}, {"n": 2}] if is_text else [dict(row) for row in table]
    assert read_rows(path) == expected
    name, told = ("a", "cannot hold lists of numbers: a$") if is_text else ("b", "column 'b'")
    with pytest.raises(SettingsError, match=told):
        table.save(path, fields=name)
    if suffix == ".json":
        with pytest.raises(SettingsError, match=r"JSON cannot hold: .*complex"):
            Table([{"a": 1j}]).save(path)


@every_format
def test_the_content_tells_the_format(tmp_path, suffix):
    """A source that looks like a number stays a text; others write a mark and other line ends."""
    rows = [{"source": "1e3", "frame": 0, "alpha": 0.5}, {"source": "b", "frame": 1, "alpha": None}]
    Table(rows).save(tmp_path / f"t{suffix}")
    path = (tmp_path / f"t{suffix}").rename(tmp_path / "table.txt")
    assert read_rows(path) == rows
    assert type(read_rows(path)[0]["frame"]) is int
    if suffix != ".parquet":
        text = path.read_bytes().replace(b"\n", b"\r\n")
        path.write_bytes(b"\xef\xbb\xbf" + text if suffix == ".csv" else text + b"\r\n")
        assert read_rows(path) == rows


BROKEN = [
    (None, "cannot be read: No such file"),
    (b"", "expected a table, found an empty file"),
    (b"a,b\n1,2\n\n1\n", "line 4: expected 2 cells as in line 1, found 1: is"),
    (b"a,b\n1,2,3\n", "line 2: expected 2 cells as in line 1, found 3"),
    (b"frame,frame\n1,2\n", "two columns have the same name"),
    (b'[{"frame": 1' + b"0" * 400 + b"}]", "frame: no column can hold values of so differ"),
    (b'{"a": 1}\n{"a": \n', "cannot be read as JSON"),
    (b"[{]", "cannot be read as JSON"),
    (b"[1, 2]", "expected JSON objects, one for each row"),
    (b"[" * 100_000, "cannot be read as JSON"),
    (b'[{"a": ' + b"9" * 5000 + b"}]", "cannot be read as JSON"),
    (b"\xff\xfe\x00\x01", "expected text in UTF-8 or Parquet, found other bytes"),
    (b"PAR1 and nothing else", "cannot be read as Parquet"),
]


@pytest.mark.parametrize(("content", "message"), BROKEN)
def test_a_broken_table_is_named(tmp_path, content, message):
    path = tmp_path / "table.dat"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ReadError, match=message) as caught:
        load(path)
    assert str(caught.value).startswith(str(path))
