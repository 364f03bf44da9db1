"""CSV that reads back the same, and result files that are complete or untouched."""

from __future__ import annotations

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanfab.errors import SettingsError
from scanfab.table import COLUMNS
from scanfab.writers.rows import CsvWriter, check_suffix, open_result
from tests.test_table import a_row


def written(*rows):
    stream = io.StringIO(newline="")
    writer = CsvWriter(stream)
    for row in rows:
        writer.write(row)
    return stream.getvalue()


def read_back(text):
    return list(csv.DictReader(io.StringIO(text, newline="")))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_read_back_the_same(value):
    (row,) = read_back(written(a_row(alpha_vs=value)))
    assert float(row["alpha_vs"]) == value
    assert math.copysign(1, float(row["alpha_vs"])) == math.copysign(1, value)


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-300, 5e-324, 123456789.123456789])
def test_numbers_are_in_the_shortest_form(value):
    assert f",{value!r}," in written(a_row(alpha_vs=value))


def test_numbers_of_numpy_are_plain_numbers():
    import numpy as np

    text = written(a_row(alpha_vs=np.float64(0.5), grains=np.int64(7), strain=np.float64(0.1)))
    assert "np." not in text
    assert read_back(text)[0]["alpha_vs"] == "0.5"


def test_what_does_not_exist_is_an_empty_cell():
    (row,) = read_back(written(a_row(grains=5)))
    assert row["strain"] == row["alpha_vs"] == row["step"] == ""
    assert row["grains"] == "5"
    assert "nan" not in str(row).lower()


@given(st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1))
def test_names_read_back_the_same(name):
    (row,) = read_back(written(a_row(source=name)))
    assert row["source"] == name


def test_the_header_comes_once_with_the_first_row():
    assert written() == ""
    lines = written(a_row(), a_row()).splitlines()
    assert lines[0] == ",".join(COLUMNS)
    assert len(lines) == 3


def test_each_row_is_written_at_once(tmp_path):
    path = tmp_path / "t.csv"
    with open(path, "w", newline="") as stream:
        writer = CsvWriter(stream)
        for count in (2, 3):
            writer.write(a_row())
            assert len(path.read_text().splitlines()) == count


def test_lines_end_alike_everywhere(tmp_path):
    with open_result(tmp_path / "t.csv") as stream:
        CsvWriter(stream).write(a_row())
    data = (tmp_path / "t.csv").read_bytes()
    assert b"\r" not in data
    assert data.endswith(b"\n")


def test_a_result_appears_when_it_is_complete(tmp_path):
    path = tmp_path / "t.csv"
    with open_result(path) as stream:
        stream.write("half")
        assert not path.exists()
        assert (tmp_path / "t.csv.part").exists()
    assert path.read_text() == "half"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_the_old_result_and_keeps_the_part(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("old")

    def fail():
        with open_result(path) as stream:
            stream.write("new")
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        fail()
    assert path.read_text() == "old"
    assert (tmp_path / "t.csv.part").read_text() == "new"


@pytest.mark.parametrize("name", ["t.docx", "t", "t.csv.gz", ".csv"])
def test_other_endings_are_refused_before_anything_is_written(tmp_path, name):
    with pytest.raises(SettingsError, match=r"results can be written as .csv"):
        check_suffix(tmp_path / name)
    with (
        pytest.raises(SettingsError, match=r"results can be written as .csv"),
        open_result(tmp_path / name),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_the_ending_may_be_in_capitals(tmp_path):
    check_suffix(tmp_path / "T.CSV")
