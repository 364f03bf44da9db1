"""Cells that YADE writes beside its VTK files: taken where they are clear, refused where not."""

from __future__ import annotations

import shutil
import warnings

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.pipeline.options import as_options
from tests.helpers.truth import SAMPLE_DATA, csv_rows

STRAINED = SAMPLE_DATA / "yade_strained"
TRUTH = csv_rows(STRAINED / "truth.csv")
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def vectors():
    """The true cells, shape (frames, 3, 3)."""
    cells = np.zeros((len(TRUTH["step"]), 3, 3))
    for name, place in zip(
        ("lx", "ly", "lz", "xy", "xz", "yz"),
        ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1)),
        strict=True,
    ):
        cells[(slice(None), *place)] = TRUTH[name]
    return cells


def frames(pattern, **options):
    return [frame.read() for frame in scanfab.read_series(STRAINED / pattern, **options)]


@pytest.mark.parametrize(
    "pattern",
    ["before-spheres-*", "after-spheres-*", "rec_spheres.*", "saved_spheres.*"],
)
def test_every_frame_has_its_own_cell_and_all_contacts(pattern):
    packings = frames(pattern)
    for packing, cell, contacts in zip(packings, vectors(), TRUTH["contacts"], strict=True):
        np.testing.assert_allclose(packing.cell.vectors, cell, rtol=0, atol=1e-7)
        assert packing.cell.periodic == (True, True, True)
        if packing.contacts is not None:
            assert len(packing.contacts) == contacts
        # positions have six or seven digits
        geometric = scanfab.find_contacts(packing).contacts
        assert abs(len(geometric) - contacts) <= 3


def test_contacts_of_the_exporter_come_along():
    assert [len(packing.contacts) for packing in frames("after-spheres-*")] == [261, 260, 256]


def test_one_file_has_the_cell_of_its_own_frame():
    packing = scanfab.read(STRAINED / "after-spheres-00000001.vtk.gz")
    np.testing.assert_allclose(packing.cell.vectors, vectors()[1], rtol=0, atol=1e-7)


def test_the_user_is_told_where_the_cell_comes_from():
    with pytest.warns(ScanfabNote, match=r"the cell is read from .*rec_pericell.\*.vtu, beside"):
        frames("rec_spheres.*")


def test_cells_that_were_overwritten_are_not_taken():
    """Without files of interactions all cells have the number 0: the last one is left."""
    with pytest.warns(ScanfabWarning, match=r"lone-periCell.*1 cells beside 3 files of spheres"):
        packings = frames("lone-spheres-*")
    assert [packing.cell for packing in packings] == [None] * 3


def test_the_cell_of_another_frame_is_refused(tmp_path):
    """One file of spheres and one cell, whose number fits, but it is that of the last frame."""
    for name in ("lone-spheres-00000000.vtk.gz", "lone-periCell-00000000.vtk.gz"):
        shutil.copy(STRAINED / name, tmp_path)
    with pytest.raises(ReadError, match=r"grains lie outside the cell of .*`cell=.FILE.csv"):
        scanfab.read(tmp_path / "lone-spheres-00000000.vtk.gz")


def test_a_saved_state_of_another_step_is_not_taken(tmp_path):
    shutil.copy(STRAINED / "saved_spheres.27500.vtu", tmp_path)
    shutil.copy(STRAINED / "saved_17500.xml.bz2", tmp_path / "saved_27500.xml.bz2")
    assert scanfab.read(tmp_path / "saved_spheres.27500.vtu").cell is None


def test_the_user_s_own_cell_comes_first():
    packing = scanfab.read(STRAINED / "rec_spheres.17500.vtu", cell=(1.0, 1.0, 1.0))
    assert np.diag(packing.cell.vectors).tolist() == [1.0, 1.0, 1.0]
    assert scanfab.read(STRAINED / "rec_spheres.17500.vtu", periodic="").is_periodic is False


def test_the_file_of_a_cell_is_not_passed_over(tmp_path):
    for name in ("rec_spheres.17500.vtu", "rec_pericell.17500.vtu"):
        shutil.copy(STRAINED / name, tmp_path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scanfab.read_series(tmp_path)
    assert not caught


@pytest.mark.parametrize("key", ["frame", "step"])
def test_cells_of_the_frames_come_from_a_csv_file(tmp_path, key):
    """By frame, or by the step in the names of the recorder's files."""
    header, *rows = (STRAINED / "truth.csv").read_text().splitlines()
    path = tmp_path / "cells.csv"
    if key == "frame":
        header = header.replace("step", "frame")
        rows = [f"{number},{row.partition(',')[2]}" for number, row in enumerate(rows)]
    path.write_text("\n".join([header, *rows]) + "\n")
    packings = frames("lone-spheres-*" if key == "frame" else "rec_spheres.*", cell=path)
    for packing, cell in zip(packings, vectors(), strict=True):
        np.testing.assert_array_equal(packing.cell.vectors, cell)


def test_a_frame_that_the_csv_file_does_not_name_is_an_error_that_names_it(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text("step,lx,ly,lz\n17500,1,1,1\n37500,1,1,1\n")
    with pytest.raises(ReadError, match=r"cells.csv: names no cell for step 27500.*27500.vtu"):
        frames("rec_spheres.*", cell=path)


@pytest.mark.parametrize("file", ["after-periCell-00000002.vtk.gz", "rec_pericell.27500.vtu"])
def test_a_cell_of_yade_as_the_file_of_cells_is_an_error_with_its_numbers(file):
    """It is that of one frame; the numbers are those that a user may name instead."""
    with pytest.raises(ReadError, match="is the cell of one frame in a VTK file") as told:
        frames("rec_spheres.27500*", cell=STRAINED / file)
    numbers = tuple(map(float, as_options(str(told.value)).partition("--cell ")[2].split()))
    assert len(numbers) == 6 if np.any(vectors()[1][np.tril_indices(3, -1)]) else 3
    (packing,) = frames("rec_spheres.27500*", cell=numbers)
    np.testing.assert_allclose(packing.cell.vectors, vectors()[1], rtol=0, atol=1e-7)


def test_a_turned_cell_of_yade_has_no_such_numbers(tmp_path):
    text = (SAMPLE_DATA / "yade_formats" / "periodic-periCell-00000001.vtk").read_text()
    path = tmp_path / "x-periCell-00000001.vtk"
    # its first vector leaves the axis x
    path.write_text(text.replace("\n0.0286394 0 0\n", "\n0.0286394 0.001 0\n"))
    with pytest.raises(ReadError, match="lay it beside its spheres") as told:
        frames("rec_spheres.27500*", cell=path)
    assert "`cell" not in str(told.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("step,lx,ly\n0,1,1\n", "expected the columns step or frame, and lx, ly, lz; found"),
        ("frame,lx,ly,lz,xy\n0,1,1,1,0\n", "lx, ly, lz, xy, xz, yz; found"),
        ("frame,lx,ly,lz\n0,1,0,1\n", r"line 2: expected numbers.*above 0: lx, ly, lz.*'0'"),
        ("frame,lx,ly,lz\n0,1,1,1\n0,1,1,2\n", "line 3: frame 0 occurs twice"),
    ],
)
def test_a_csv_file_of_cells_that_is_wrong_is_an_error_that_says_where(tmp_path, text, message):
    path = tmp_path / "cells.csv"
    path.write_text(text)
    with pytest.raises(ReadError, match=f"cells.csv.*{message}"):
        scanfab.read_series(STRAINED / "rec_spheres.*", cell=path)


def test_a_saved_state_is_no_cell_of_the_exporters_files_which_are_counted(tmp_path):
    """Number 0 of the exporter is its first file, that of O.save the step 0 of the simulation."""
    saved = next(STRAINED.glob("saved*.xml*"))
    step = int("".join(filter(str.isdigit, saved.name.partition(".xml")[0])))
    spheres = tmp_path / f"x-spheres-{step:08d}.vtk.gz"
    shutil.copy(STRAINED / "after-spheres-00000001.vtk.gz", spheres)
    shutil.copy(saved, tmp_path / saved.name.replace("saved", "x"))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert scanfab.read(spheres).cell is None
    assert not any("the cell is read from" in str(one.message) for one in told)
