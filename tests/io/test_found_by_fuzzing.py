"""Files that once crashed a reader, took all memory, or drew a warning of a library."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabError
from tests.helpers.dumps import dump_text, write, yade_spheres
from tests.helpers.fuzzing import only_scanfabs_warnings


def refuses(*args, match=None, **options):
    """An error of the package, and no warning of a library."""
    with only_scanfabs_warnings(), pytest.raises(ScanfabError, match=match):
        scanfab.read(*args, **options)


ODD = [
    # bounds without an end are no box: their difference made NumPy warn
    ("a.data", "1 0.5 inf 0 inf 2 \n0.1 1 9 9 0.1 0 0 0\n", 1),
    ("a.txt.gz", "#format x_y_z_r\n0 0 0 1\n", 1),
    ("a.txt", "#format x_y_z_r\n  # none\n", 0),
    ("a.txt", dump_text(box=((-1e300, 1e300), (0, 1), (0, 1))), 3),
]


@pytest.mark.parametrize(("name", "text", "count"), ODD)
def test_an_odd_text_is_read(tmp_path, name, text, count):
    with only_scanfabs_warnings():
        packing = scanfab.read(write(tmp_path / name, text))
    assert (len(packing), packing.cell) == (count, None)


def test_a_box_of_any_extent_fits_into_the_file(tmp_path):
    yade_spheres(tmp_path / "g1.vtk", [[0, 0, 0]], [1])
    extent = 'Extent="0 1000000000 0 1 0 1"'
    text = f"<RectilinearGrid Whole{extent}><Piece {extent}/></RectilinearGrid></VTKFile>"
    write(tmp_path / "gboundingBox_1.vtr", f'<VTKFile type="RectilinearGrid">{text}')
    refuses(tmp_path / "g1.vtk", match="its Coordinates")


@pytest.mark.parametrize("rows", ["", "1,2,0.5,0,\n"])
def test_a_column_without_name_and_numbers_that_the_user_names(tmp_path, rows):
    grains = write(tmp_path / "d1.csv", "id,x,y,z,radius\n1,0,0,0,1\n2,2,0,0,1\n")
    pairs = write(tmp_path / "p1.csv", f"id1,id2,fx,fy,\n{rows}")
    named = "id1=id1,id2=id2,fx2=fx,fy2=fy,fz2=5"
    refuses(grains, contacts=pairs, contact_columns=named, match="contacts")


def test_a_row_too_short_for_the_columns_of_contacts_that_the_user_names(tmp_path):
    pairs = write(tmp_path / "p1.txt", "id\tx\t\tz\tr\n1\n")
    refuses(pairs, format="table", contact_columns="id1=id,id2=r", match="p1.txt")


@pytest.mark.filterwarnings("ignore:.*packing.nfo")
def test_doubles_that_begin_as_an_archive_does(tmp_path):
    rows = np.column_stack([np.arange(12.0), np.zeros((12, 2)), np.ones(12)]).astype("<f8")
    rows[0, 0] = np.frombuffer(b"PK" + bytes(6), "<f8")[0]
    (tmp_path / "a.xyzd").write_bytes(rows.tobytes())
    assert len(scanfab.read(tmp_path / "a.xyzd")) == 12
