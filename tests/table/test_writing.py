"""CSV that reads back the same, and result files that are complete or untouched."""

from __future__ import annotations

import contextlib
import csv
import io
import math
import os
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scanfab.base.errors import ReadError, SettingsError
from scanfab.table.columns import COLUMNS, table_columns
from scanfab.table.formats import OWN_FORMATS, format_of
from scanfab.table.reading import read_rows
from scanfab.table.result_file import ResultFile, is_finished, manifest_of
from scanfab.table.row import Row
from scanfab.table.table import Table
from scanfab.table.writing import ALL, Excerpt
from tests.table.test_table import a_row

SUFFIXES = [one.suffix for one in OWN_FORMATS]


def result_in(folder):
    return ResultFile(folder / "t.csv", Row)


def interrupt(result, asked, rows):
    """Write rows, and stop before the file is complete."""
    with contextlib.suppress(KeyboardInterrupt), result.writer(asked) as writer:
        for row in rows:
            writer.write(row)
        raise KeyboardInterrupt


def written(*rows):
    stream = io.StringIO(newline="")
    OWN_FORMATS[0].write(stream, map(ALL.of, rows), table_columns() if rows else [])
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


def test_the_header_and_each_row_are_written_as_the_rows_come(tmp_path):
    path = tmp_path / "t.csv"

    def rows():
        for count in (0, 2, 3):
            lines = path.read_text().splitlines()
            assert len(lines) == count
            assert lines[:1] in ([], [",".join(COLUMNS)])
            yield a_row()

    with open(path, "w", newline="") as stream:
        OWN_FORMATS[0].write(stream, rows(), table_columns())
    assert len(path.read_text().splitlines()) == 4


def test_lines_end_alike_everywhere(tmp_path):
    result = result_in(tmp_path)
    with result.writer({}) as writer:
        writer.write(a_row())
    data = result.path.read_bytes()
    assert b"\r" not in data
    assert data.endswith(b"\n")


def test_a_result_appears_when_it_is_complete(tmp_path):
    result = result_in(tmp_path)
    with result.writer({}) as writer:
        writer.write(a_row())
        assert not result.path.exists()
        assert result.part.exists()
    assert list(tmp_path.iterdir()) == [result.path]


def test_an_error_leaves_the_old_result_and_keeps_the_part(tmp_path):
    result = result_in(tmp_path)
    result.path.write_text("old")

    interrupt(result, {}, [a_row()])
    assert result.path.read_text() == "old"
    assert read_rows(result.part) == [dict(a_row())]


@pytest.mark.parametrize("name", ["t.docx", "t", "t.csv.gz", ".csv"])
def test_other_endings_are_refused_before_anything_is_written(tmp_path, name):
    with pytest.raises(SettingsError, match=r"results can be written as .csv"):
        format_of(tmp_path / name)
    with pytest.raises(SettingsError, match=r"results can be written as .csv"):
        ResultFile(tmp_path / name, Row)
    assert list(tmp_path.iterdir()) == []


def test_the_ending_may_be_in_capitals(tmp_path):
    format_of(tmp_path / "T.CSV")


@pytest.mark.parametrize("ending", SUFFIXES)
def test_every_format_reads_back_the_same(tmp_path, ending):
    rows = [a_row(frame=0, alpha_vs=1 / 3, grains=7), a_row(frame=1, strain=-1e-300, step=10**12)]
    result = ResultFile(tmp_path / f"t{ending}", Row)
    with result.writer({}) as writer:
        for row in rows:
            writer.write(row)
    assert [Row(**row) for row in read_rows(result.path)] == rows
    assert list(tmp_path.iterdir()) == [result.path]


@pytest.mark.parametrize("ending", SUFFIXES)
def test_finished_frames_are_kept_and_a_half_one_is_cut_off(tmp_path, ending):
    result = ResultFile(tmp_path / f"t{ending}", Row)
    rows = [a_row(frame=k // 2, variant="ab"[k % 2], alpha_vs=0.1 * k) for k in range(6)]
    asked = {"seed": 0}
    interrupt(result, asked, rows[:5])
    with open(result.part, "a") as stream:
        stream.write("half a li")
    done = result.finished_rows(asked, 2)
    assert [Row(**row) for row in done] == rows[:4]
    with result.writer(asked, resume=True) as writer:
        for row in rows[4:]:
            writer.write(row)
    assert [Row(**row) for row in read_rows(result.path)] == rows


def test_other_settings_are_refused(tmp_path):
    result = result_in(tmp_path)
    interrupt(result, {"seed": 0, "rv": 0.7}, [a_row()])
    with pytest.raises(SettingsError, match=r"made with other settings \(seed\)"):
        result.finished_rows({"seed": 1, "rv": 0.7}, 1)


def test_a_part_that_is_not_json_lines_is_refused(tmp_path):
    result = result_in(tmp_path)
    result.part.write_text("source,frame\na,0\n")
    with pytest.raises(ReadError, match=r"t\.csv\.part: cannot be read as JSON"):
        result.finished_rows({}, 1)


def test_a_run_that_was_killed_before_it_removed_its_part_is_finished(tmp_path):
    result = result_in(tmp_path)
    with result.writer({}, save_manifest=lambda path: path.write_text("{}")) as writer:
        writer.write(a_row())
    whole = result.path.read_bytes()
    # what such a run leaves: FILE, its rows in FILE.part, the manifest under its first name
    result.part.write_text("{}\n")
    os.utime(result.part, (0, 0))
    result.manifest.rename(tmp_path / "t.csv.manifest.json.new")
    assert is_finished(result.path)
    assert manifest_of(result.path).exists()
    with result.alone():
        assert not result.has_part
    assert {path.name for path in tmp_path.iterdir()} == {"t.csv", "t.csv.manifest.json"}
    assert result.path.read_bytes() == whole


def test_without_a_part_there_is_nothing_to_go_on_with(tmp_path):
    assert result_in(tmp_path).finished_rows({}, 4) == []


def test_rows_of_other_settings_are_gone_before_the_new_settings_stand(tmp_path, monkeypatch):
    """A process may be killed between the two."""
    result = result_in(tmp_path)
    interrupt(result, {"seed": 0}, [a_row()])

    def killed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(ResultFile, "_begin_record", killed)
    interrupt(result, {"seed": 1}, [a_row()])
    assert result.finished_rows({"seed": 1}, 1) == []


def test_a_folder_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(SettingsError, match=r"there is no folder .*nowhere to write to"):
        ResultFile(tmp_path / "nowhere" / "t.csv", Row)


def test_digits_are_significant_ones_of_floats_alone():
    row = a_row(alpha_vs=0.0123456789, frame=123456, mean_length=None, alpha_c=1e-300)
    found = Excerpt.make(Row, None, 3).of(row)
    assert (found["alpha_vs"], found["frame"], found["mean_length"]) == (0.0123, 123456, None)
    assert found["alpha_c"] == 1e-300
    assert list(found) == list(COLUMNS)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 17))
def test_rounded_numbers_stay_as_they_are_when_they_are_rounded_again(value, digits):
    excerpt = Excerpt.make(Row, None, digits)
    once = excerpt.of(a_row(alpha_vs=value))["alpha_vs"]
    assert excerpt.of(a_row(alpha_vs=once))["alpha_vs"] == once
    assert digits < 17 or once == value


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_columns_come_in_the_order_in_which_they_are_named(tmp_path, suffix):
    path = tmp_path / f"t{suffix}"
    excerpt = Excerpt.make(Row, "alpha_vs, frame,variant", 2)
    with ResultFile(path, Row, excerpt).writer({}) as writer:
        writer.write(a_row(alpha_vs=0.125, frame=3, variant="c"))
    (row,) = read_rows(path)
    assert list(row.items()) == [("alpha_vs", 0.12), ("frame", 3), ("variant", "c")]


@pytest.mark.parametrize(
    ("fields", "digits", "message"),
    [
        ("alpha_v", 17, "there is no column 'alpha_v': did you mean alpha_vs?"),
        ("nonsense", 17, "there is no column 'nonsense': the columns are source, frame, step"),
        ("", 17, "there is no column ''"),
        ("frame,frame", 17, "the column frame is named more than once"),
        (None, 0, "digits: expected 1 to 17 of them, found 0"),
        (None, 18, "digits: expected 1 to 17 of them, found 18"),
    ],
)
def test_columns_and_digits_that_do_not_exist_are_refused(fields, digits, message):
    with pytest.raises(SettingsError, match=re.escape(message)):
        Excerpt.make(Row, fields, digits)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_numbers_of_numpy_are_written_and_what_is_not_finite_is_missing(tmp_path, suffix):
    path = tmp_path / f"t{suffix}"
    row = {
        "frame": np.int64(0),
        "a": np.float64(0.5),
        "n": np.int32(3),
        "b": math.nan,
        "c": -math.inf,
    }
    Table([row]).save(path)
    assert read_rows(path) == [{"frame": 0, "a": 0.5, "n": 3, "b": None, "c": None}]


@pytest.mark.parametrize("suffix", [".json", ".parquet"])
def test_lists_are_written_where_there_are_some(tmp_path, suffix):
    Table([{"a": [1, 2]}, {"a": None}]).save(tmp_path / f"t{suffix}")
    assert read_rows(tmp_path / f"t{suffix}") == [{"a": [1, 2]}, {"a": None}]


def test_what_json_cannot_hold_is_an_error_of_the_package(tmp_path):
    with pytest.raises(SettingsError, match=r"JSON cannot: .*complex"):
        Table([{"a": 1j}]).save(tmp_path / "t.json")


@pytest.mark.parametrize("suffix", [".csv", ".json", ".jsonl", ".parquet"])
def test_a_table_without_rows_reads_back(tmp_path, suffix):
    Table().save(tmp_path / f"t{suffix}")
    assert read_rows(tmp_path / f"t{suffix}") == []


def test_the_names_of_columns_come_as_a_list_too(tmp_path):
    table = Table([{"frame": 0, "step": 7, "alpha_vs": 0.5}])
    table.save(tmp_path / "t.csv", fields=["alpha_vs", "frame"])
    assert (tmp_path / "t.csv").read_text() == "alpha_vs,frame\n0.5,0\n"


WRONG = [
    ({"fields": 3}, "fields: expected names of columns, found 3"),
    ({"fields": []}, r"fields: expected names of columns, found \[\]"),
    ({"fields": ["fram"]}, "fields: .*did you mean frame"),
    ({"digits": "x"}, "digits: expected 1 to 17 of them, found 'x'"),
    ({"digits": 2.5}, "digits: expected 1 to 17 of them, found 2.5"),
]


@pytest.mark.parametrize(("options", "told"), WRONG)
def test_other_columns_and_digits_are_refused(tmp_path, options, told):
    with pytest.raises(SettingsError, match=told):
        Table([{"frame": 0}]).save(tmp_path / "t.csv", **options)
