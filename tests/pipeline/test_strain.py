"""Axial strain: what each mode measures, and strains from a file."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from scanfab.base.errors import ReadError, SettingsError
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample
from scanfab.pipeline.strain import StrainFile, axial_length
from scanfab.pipeline.values import AXES
from tests.helpers.dumps import write

POSITION = np.array([[1.0, 1, 1], [2, 3, 5], [1, 1, 0], [4, 4, 9]])
BOUNDARY = np.array([False, False, True, True])
DIAGONAL = (3**-0.5,) * 3


def sample(cell=None, boundary=BOUNDARY):
    return Sample(Packing(POSITION, 0.1, cell=cell), np.asarray(boundary))


def box(periodic=(True, True, True)):
    return Cell([10.0, 11.0, 12.0], periodic)


@pytest.mark.parametrize(("axis", "length"), [("x", 10.0), ("y", 11.0), ("z", 12.0)])
def test_auto_is_the_cell_where_it_repeats(axis, length):
    assert axial_length(sample(box()), "auto", AXES[axis]) == length


def test_auto_is_the_boundary_where_the_cell_does_not_repeat_along_the_axis():
    assert axial_length(sample(box((True, True, False))), "auto", AXES["z"]) == 9.0
    assert axial_length(sample(), "auto", AXES["x"]) == 3.0


def test_auto_is_nothing_without_either():
    assert axial_length(sample(boundary=[False] * 4), "auto", AXES["z"]) is None


def test_auto_is_the_boundary_along_other_axes():
    expected = np.ptp(POSITION[2:] @ np.array(DIAGONAL))
    assert axial_length(sample(box()), "auto", DIAGONAL) == pytest.approx(expected)


def test_cell_is_the_diagonal_entry_of_a_tilted_cell_too():
    cell = Cell([[10, 0, 0], [1, 11, 0], [2, 3, 12]])
    assert axial_length(sample(cell), "cell", AXES["z"]) == 12.0


def test_a_cell_that_does_not_repeat_may_be_asked_for():
    assert axial_length(sample(box((False, False, False))), "cell", AXES["z"]) == 12.0


def test_boundary_and_grains_are_extents_of_centres():
    assert axial_length(sample(), "boundary", AXES["z"]) == 9.0
    assert axial_length(sample(), "grains", AXES["z"]) == 4.0


@pytest.mark.parametrize(
    ("cell", "axis", "message"),
    [(None, AXES["z"], "the dump has no cell"), (box(), DIAGONAL, "the axis is not x, y or z")],
)
def test_a_cell_that_cannot_be_measured_is_an_error(cell, axis, message):
    with pytest.raises(SettingsError, match=f"strain: cell was asked for, but {message}"):
        axial_length(sample(cell), "cell", axis)


def test_a_boundary_that_is_not_named_is_an_error_that_asks_for_it():
    with pytest.raises(SettingsError, match=r"boundary was asked for.*name them with `boundary`"):
        axial_length(sample(boundary=[False] * 4), "boundary", AXES["z"])


def test_grains_that_do_not_exist_are_an_error():
    with pytest.raises(SettingsError, match="grains was asked for, but the frame has none"):
        axial_length(sample(boundary=[True] * 4), "grains", AXES["z"])


def test_a_file_names_strains_by_step(tmp_path):
    file = StrainFile(write(tmp_path / "s.csv", "step,strain\n0,0.0\n1000,0.05\n"))
    assert file.at(1, 1000) == 0.05
    assert file.at(1, 2000) is None
    assert file.at(1, None) is None


def test_a_file_names_strains_by_frame(tmp_path):
    file = StrainFile(write(tmp_path / "s.csv", "frame,strain\n0,0.0\n1,0.05\n"))
    assert file.at(1, 1000) == 0.05
    assert file.at(2, 1) is None


def test_steps_come_before_frames(tmp_path):
    file = StrainFile(write(tmp_path / "s.csv", "frame,step,strain\n0,1000,0.25\n"))
    assert file.at(7, 1000) == 0.25


def test_other_columns_and_blanks_do_not_matter(tmp_path):
    text = "\ufeff stress , step , strain \r\n 5 , 1e3 , 0.5 \r\n"
    assert StrainFile(write(tmp_path / "s.csv", text)).at(0, 1000) == 0.5


COLUMNS = "the columns step or frame, and strain, found "


@pytest.mark.parametrize(
    ("text", "expected"),
    [("", "a table"), ("step,epsilon\n1,2\n", COLUMNS), ("time,strain\n1,2\n", COLUMNS)],
)
def test_a_missing_column_is_an_error_that_names_the_file(tmp_path, text, expected):
    with pytest.raises(ReadError, match=rf"s\.csv: expected {expected}"):
        StrainFile(write(tmp_path / "s.csv", text))


@pytest.mark.parametrize("row", ["10,high", ",0.1", "10,", "10", "10.7,0.1", "1e999,0.1"])
def test_a_value_that_is_no_number_is_an_error_that_names_the_line(tmp_path, row):
    with pytest.raises(ReadError, match=r"s\.csv, line 3: expected"):
        StrainFile(write(tmp_path / "s.csv", f"step,strain\n0,0\n{row}\n"))


def test_a_file_that_is_no_text_is_an_error(tmp_path):
    path = tmp_path / "s.csv"
    path.write_bytes(b"step,strain\n\xff\xfe\x00\n")
    with pytest.raises(ReadError):
        StrainFile(path)


@pytest.mark.parametrize("cell", ["9" * 140_000, "0.\0"])
def test_a_cell_that_no_csv_file_has_is_an_error_that_names_the_file(tmp_path, cell):
    path = write(tmp_path / "s.csv", f"step,strain\n0,{cell}\n")
    with pytest.raises(ReadError, match=r"s\.csv, line 2: expected .*, found .{,100}$"):
        StrainFile(path)


@pytest.mark.parametrize("wrong", ["nan", "inf"])
def test_a_strain_that_is_not_finite_is_an_error_or_nothing(tmp_path, wrong):
    path = write(tmp_path / "s.csv", f"step,strain\n0,{wrong}\n")
    with contextlib.suppress(ReadError):
        assert StrainFile(path).at(0, 0) is None
