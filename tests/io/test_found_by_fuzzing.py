"""Files that once crashed a reader, took all memory, or drew a warning of a library."""

from __future__ import annotations

import time

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import PackingError, ReadError
from scanfab.io.formats.liggghts import LiggghtsReader
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from tests.helpers.dumps import (
    ROWS,
    dump_text,
    local_text,
    pairs_text,
    write,
    yade_lines,
    yade_spheres,
)
from tests.helpers.fuzzing import only_scanfabs_warnings


def refuses(read, *args, match=None, **options):
    """ReadError, and no warning of a library."""
    with only_scanfabs_warnings(), pytest.raises(ReadError, match=match):
        read(*args, **options)


def test_wall_contacts_name_grains_that_exist(tmp_path):
    position = np.array([row[2:5] for row in ROWS])
    grains = GrainTable(position, np.full(3, 0.1), np.array([1, 2, 3]), {}, None)
    rows = [(*place, 0, 0, id) for place, id in zip(position, (1, 2, 9), strict=True)]
    path = write(tmp_path / "a.txt", local_text(rows))
    snapshot = LiggghtsReader().snapshots(path)[0]
    read = LiggghtsReader().read_contacts
    refuses(read, snapshot, ReadOptions(), grains, match="names the grain 9, which is not")


def test_a_box_of_any_extent_fits_into_the_file(tmp_path):
    yade_spheres(tmp_path / "g1.vtk", [[0, 0, 0]], [1])
    extent = "0 1000000000 0 1 0 1"
    write(
        tmp_path / "gboundingBox_1.vtr",
        f'<VTKFile type="RectilinearGrid"><RectilinearGrid WholeExtent="{extent}">'
        f'<Piece Extent="{extent}"/></RectilinearGrid></VTKFile>',
    )
    refuses(scanfab.read, tmp_path / "g1.vtk", match="its Coordinates")


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_contacts_end_at_finite_places(tmp_path, value):
    ends = [[[0, 0, 0], [value, 0, 0]]]
    path = yade_lines(tmp_path / "a.vtk", ends)
    grains = GrainTable(np.zeros((1, 3)), np.ones(1), None, {}, None)
    read = VtkReader().read_contacts
    refuses(read, Snapshot(path), ReadOptions(), grains, match="finite ends")


@pytest.mark.parametrize(("position", "radius"), [(np.nan, 1), (0, np.nan), (0, 0), (0, np.inf)])
def test_contacts_need_grains_with_a_place_and_a_size(tmp_path, position, radius):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]])
    cell = scanfab.Cell([4, 4, 4])
    grains = GrainTable(np.full((1, 3), position), np.full(1, radius), None, {}, cell)
    refuses(VtkReader().read_contacts, Snapshot(path), ReadOptions(), grains, match="finite")


def test_a_large_grain_in_a_small_cell_has_few_images(tmp_path):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]])
    cell = scanfab.Cell([4, 4, 4])
    grains = GrainTable(np.zeros((1, 3)), np.full(1, 1e50), None, {}, cell)
    VtkReader().read_contacts(Snapshot(path), ReadOptions(), grains)


def test_ids_of_contacts_are_whole_numbers(tmp_path):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]], id1=[np.nan], id2=[1])
    grains = GrainTable(np.zeros((1, 3)), np.ones(1), np.array([1]), {}, None)
    read = VtkReader().read_contacts
    refuses(read, Snapshot(path), ReadOptions(), grains, match="ids must be whole numbers")


def test_a_text_export_may_be_called_gz(tmp_path):
    path = write(tmp_path / "a.txt.gz", "#format x_y_z_r\n0 0 0 1\n")
    assert len(scanfab.read(path)) == 1


def test_indented_comments_are_no_rows(tmp_path):
    path = write(tmp_path / "a.txt", "#format x_y_z_r\n  # none\n")
    with only_scanfabs_warnings():
        assert len(scanfab.read(path)) == 0


@pytest.mark.parametrize("edge", ["1e200", "-1e200", "inf", "nan"])
def test_a_text_exports_cell_is_finite(tmp_path, edge):
    path = write(tmp_path / "a.txt", f"##PERIODIC:: 1 1 {edge}\n0 0 0 1 -1\n")
    refuses(scanfab.read, path, match="expected three lengths")


def test_blank_lines_are_no_rows(tmp_path):
    text = dump_text(ROWS[:1]).replace("1 1 0.2 0.5 0.5 0.1", "")
    refuses(scanfab.read, write(tmp_path / "a.txt", text), match="counts 1 rows, found 0")


@pytest.mark.parametrize("value", ["inf", "nan", "1e300"])
def test_fractions_of_the_box_are_numbers(tmp_path, value):
    rows = [(1, value, 0.5, 0.5, 0.1)]
    path = write(tmp_path / "a.txt", dump_text(rows, "id xs ys zs radius"))
    with only_scanfabs_warnings(), pytest.raises(scanfab.ScanfabError):
        scanfab.read(path)


def test_a_box_without_limits_is_no_box(tmp_path):
    path = write(tmp_path / "a.txt", dump_text(box=((-1e300, 1e300), (0, 1), (0, 1))))
    with only_scanfabs_warnings():
        assert scanfab.read(path).cell is None


@pytest.mark.parametrize("name", ["x", "radius"])
def test_coordinates_and_radii_are_lengths(tmp_path, name):
    rows = [(1, *(1e200 if one == name else 0.5 for one in ("x", "y", "z", "radius")))]
    path = write(tmp_path / "a.txt", dump_text(rows, "id x y z radius"))
    refused = pytest.raises(PackingError, match=r"a\.txt: grain 1: .* cannot be a length")
    with only_scanfabs_warnings(), refused:
        scanfab.read(path)


def test_a_grain_is_not_too_far_away_for_its_radius(tmp_path):
    rows = [(1, 1e30, 0.5, 0.5, 0.1)]
    text = dump_text(rows, "id x y z radius", flags=" pp pp pp")
    refuses(scanfab.read, write(tmp_path / "a.txt", text), match=r"coordinate of 1e\+30")


@pytest.mark.parametrize("id", ["1e300", "nan", "inf", "0.5"])
def test_ids_are_whole_numbers(tmp_path, id):
    path = write(tmp_path / "a.txt", dump_text([(id, 1, 0.5, 0.5, 0.5, 0.1)]))
    refuses(scanfab.read, path, match="ids must be whole numbers")


def test_forces_of_any_size_draw_no_warning(tmp_path):
    write(tmp_path / "d1.txt", dump_text())
    write(tmp_path / "p1.txt", pairs_text().replace("-1.5", "-1e308"))
    with only_scanfabs_warnings():
        assert len(scanfab.read(tmp_path).contacts) == 2


@pytest.mark.parametrize("word", ["9" * 5000 + "x", "9" * 5000 + ".5.5", "1" * 5000 + "e"])
def test_words_of_many_digits_take_no_time(tmp_path, word):
    """A pattern that could cut the digits anywhere tried all places: 32 s for a table of these."""
    rows = f"1,0,{word},0,1\n" * 40
    path = write(tmp_path / "a.csv", f"id,x,y,z,radius\n{rows}")
    began = time.monotonic()
    refuses(scanfab.read, path)
    assert time.monotonic() - began < 5


def test_radii_near_zero_prove_nothing(tmp_path):
    rows = "".join(f"{k}e300 0 0 1e-300\n" for k in range(12))
    with pytest.raises(PackingError, match="below 1e-100"):
        scanfab.read(write(tmp_path / "a.txt", rows), format="table")


@pytest.mark.parametrize("rows", ["", "1,2,0.5,0,\n"])
def test_a_column_without_name_and_numbers_that_the_user_names(tmp_path, rows):
    grains = write(tmp_path / "d1.csv", "id,x,y,z,radius\n1,0,0,0,1\n2,2,0,0,1\n")
    pairs = write(tmp_path / "p1.csv", f"id1,id2,fx,fy,\n{rows}")
    named = "id1=id1,id2=id2,fx2=fx,fy2=fy,fz2=5"
    refuses(scanfab.read, grains, contacts=pairs, contact_columns=named, match="contacts")


def test_tables_by_an_ending_that_says_doubles(tmp_path):
    """Arrays of NumPy in an .xyzd file were read as such, and then held for x y z d."""
    with open(tmp_path / "a.xyzd", "wb") as file:
        np.savez(file, radius=np.ones(12), other=np.ones(12))
    refuses(scanfab.read, tmp_path / "a.xyzd", format="table")


@pytest.mark.filterwarnings("ignore:.*packing.nfo")
def test_doubles_that_begin_as_an_archive_does(tmp_path):
    rows = np.column_stack([np.arange(12.0), np.zeros((12, 2)), np.ones(12)]).astype("<f8")
    rows[0, 0] = np.frombuffer(b"PK" + bytes(6), "<f8")[0]
    (tmp_path / "a.xyzd").write_bytes(rows.tobytes())
    assert len(scanfab.read(tmp_path / "a.xyzd")) == 12
