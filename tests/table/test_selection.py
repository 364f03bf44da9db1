"""Which rows of fabric tables stand side by side: checked, of one cut-off, each frame once."""

from __future__ import annotations

import math
import warnings

import pytest

from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.pipeline.calibration_ladders import StepRow
from scanfab.pipeline.inspection import FrameReport
from scanfab.table.columns import columns_of
from scanfab.table.comparison_rows import DifferenceRow, FrameRow, SummaryRow
from scanfab.table.reading import number_of
from scanfab.table.selection import choose_rows
from tests.helpers.tables import curve

CUTOFFS = (0.0, 0.00080000001, 0.0016)


def of_cutoffs(source="one"):
    return [
        {**row, "cutoff": cutoff, "alpha_vs_axial": row["alpha_vs_axial"] * (1 + place)}
        for row in curve(source)
        for place, cutoff in enumerate(CUTOFFS)
    ]


@pytest.mark.parametrize(
    ("asked", "expected"), [(0.0, 0.0), (0.0008, 0.00080000001), (0.00160001, 0.0016)]
)
def test_the_rows_of_one_cutoff_are_chosen_to_three_digits(asked, expected):
    (rows,) = choose_rows([("t.csv", of_cutoffs())], cutoff=asked)
    assert len(rows) == 5
    assert {row["cutoff"] for row in rows} == {expected}


@pytest.mark.parametrize("asked", [0.00081, 1.0, -0.0016, math.nan, math.inf])
def test_a_cutoff_that_no_row_has_is_an_error_that_lists_those_that_exist(asked):
    message = r"^t.csv: no row has the cut-off .* of the table's: 0, 0.0008, 0.0016$"
    with pytest.raises(SettingsError, match=message):
        choose_rows([("t.csv", of_cutoffs())], cutoff=asked)


def test_a_table_without_cutoffs_says_so():
    with pytest.raises(SettingsError, match="expected one of the table's: none in this table"):
        choose_rows([("t.csv", curve())], cutoff=1.0)


def test_a_frame_without_grains_has_no_cutoff_and_stays_once():
    rows = of_cutoffs()
    for row in rows[:3]:
        row.update(cutoff=None, alpha_vs_axial=None)
    (chosen,) = choose_rows([("t.csv", rows)], cutoff=0.0016)
    assert [row["frame"] for row in chosen] == [0, 1, 2, 3, 4]


def test_labels_tell_two_runs_of_one_sample_apart():
    one, two = choose_rows(
        [("1.csv", curve()), ("2.csv", curve(factor=2.0))], labels=["coarse", "fine"]
    )
    assert {row["source"] for row in one} == {"coarse"}
    assert {row["source"] for row in two} == {"fine"}


def test_a_label_of_a_table_of_several_sources_stands_before_them():
    (rows,) = choose_rows([("t.csv", [*curve("one"), *curve("two")])], labels=["new"])
    assert {row["source"] for row in rows} == {"new, one", "new, two"}


@pytest.mark.parametrize("labels", [["a"], ["a", "b", "c"]])
def test_there_are_as_many_labels_as_tables(labels):
    with pytest.raises(SettingsError, match=f"found {len(labels)} for 2"):
        choose_rows([("1.csv", curve()), ("2.csv", curve("two"))], labels=labels)


@pytest.mark.parametrize("source", ["one", "./one", "two/../one/"])
def test_rows_that_are_there_already_count_once_with_one_warning(source):
    with pytest.warns(ScanfabWarning) as caught:
        first, second = choose_rows([("1.csv", curve("one")), ("2.csv", curve(source))])
    assert len(first) == 5
    assert second == []
    assert {str(one.message) for one in caught} == {
        f"2.csv: rows of {source} that 1.csv holds already count once"
    }


def test_other_results_of_the_same_source_are_not_dropped():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        first, second = choose_rows([("1.csv", curve()), ("2.csv", curve(factor=2.0))])
    assert len(first) == len(second) == 5


def test_a_packing_without_a_name_comes_back_from_csv():
    (rows,) = choose_rows([("t.csv", [{**row, "source": None} for row in curve()])])
    assert {row["source"] for row in rows} == {""}


VALUES = ["abc", True, [1], {"a": [1]}, float("nan"), float("inf"), 10**400, b"x"]


@pytest.mark.parametrize(
    "column", ["frame", "strain", "alpha_vs_axial", "alpha_c_axial_without_3", "coaxiality_deg"]
)
@pytest.mark.parametrize("value", VALUES, ids=lambda value: repr(value)[:12])
def test_a_value_of_another_kind_is_named_by_table_row_and_column(column, value):
    rows = [*curve()[:2], {**curve()[2], column: value}]
    with pytest.raises(
        SettingsError, match=f"^t.csv: row 3: {column}: expected a number, found "
    ) as caught:
        choose_rows([("t.csv", rows)])
    assert len(str(caught.value)) < 120


@pytest.mark.parametrize("column", ["source", "variant"])
@pytest.mark.parametrize("value", [1, True, ["c"], {}])
def test_a_name_of_another_kind_is_named(column, value):
    rows = [*curve()[:2], {**curve()[2], column: value}]
    with pytest.raises(SettingsError, match=f"^t.csv: row 3: {column}: expected a name, found "):
        choose_rows([("t.csv", rows)])


@pytest.mark.parametrize("value", [None, 1.5])
def test_frames_are_whole_numbers(value):
    rows = [{**curve()[0], "frame": value}]
    with pytest.raises(SettingsError, match=r"t.csv: row 1: frame: expected a whole number, found"):
        choose_rows([("t.csv", rows)])


def test_a_column_that_some_rows_lack_is_named_with_the_row():
    rows = curve()
    rows[3].pop("alpha_c_axial")
    with pytest.raises(SettingsError, match=r"^t.csv: row 4: there is no column alpha_c_axial: "):
        choose_rows([("t.csv", rows)])


@pytest.mark.parametrize(
    ("row", "other"),
    [
        (FrameRow, "a table of scanfab compare"),
        (SummaryRow, "the summary of scanfab compare"),
        (DifferenceRow, "the differences of scanfab compare"),
        (StepRow, "a table of scanfab calibrate"),
        (FrameReport, "the frames of scanfab inspect"),
    ],
)
def test_other_tables_are_called_by_their_name(row, other):
    rows = [{column.name: None for column in columns_of(row)}]
    with pytest.raises(SettingsError, match=f"^t.csv: this is {other}: "):
        choose_rows([("t.csv", rows)])


def test_a_table_of_another_program_is_told_by_its_columns():
    rows = [{f"column_{k}": k for k in range(100)}]
    with pytest.raises(SettingsError, match=r"^t.csv: there is no column source, .* found the col"):
        choose_rows([("t.csv", rows)])


@pytest.mark.parametrize("value", VALUES)
def test_what_is_no_number_is_none_to_readers_of_single_values(value):
    assert number_of({"a": value}, "a") is None
