"""Files that once crashed a reader, took all memory, or drew a warning of a library."""

from __future__ import annotations

import time

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabError
from tests.helpers.dumps import (
    ROWS,
    dump_text,
    local_text,
    pairs_text,
    write,
    yade_spheres,
)
from tests.helpers.fuzzing import only_scanfabs_warnings

RADII = "id x y z radius"


def refuses(*args, match=None, **options):
    """An error of the package, and no warning of a library."""
    with only_scanfabs_warnings(), pytest.raises(ScanfabError, match=match):
        scanfab.read(*args, **options)


FAR = [(1, 1e30, 0.5, 0.5, 0.1)]
FAR_CELL = (
    '1\nLattice="1 0 0 0 1 0 0 0 1" Origin="1e30 0 0" Properties=pos:R:3:radius:R:1\n0 0 0 1\n'
)
LONG = ["9" * 5000 + "x", "9" * 5000 + ".5.5", "1" * 5000 + "e"]
NEAR_ZERO = "".join(f"{k}e300 0 0 1e-300\n" for k in range(12))
TEXTS = [
    *((f"##PERIODIC:: 1 1 {edge}\n0 0 0 1 -1\n", "must be finite numbers")
      for edge in ("1e200", "-1e200", "inf", "nan")),
    (dump_text(ROWS[:1]).replace("1 1 0.2 0.5 0.5 0.1", ""), "counts 1 rows, found 0"),
    *((dump_text([(1, value, 0.5, 0.5, 0.1)], "id xs ys zs radius"), "")
      for value in ("inf", "nan", "1e300")),
    (dump_text([(1, 1e200, 0.5, 0.5, 0.5)], RADII), "grain 1: .* cannot be a length"),
    (dump_text([(1, 0.5, 0.5, 0.5, 1e200)], RADII), "grain 1: .* cannot be a length"),
    (dump_text(FAR, RADII, flags=" pp pp pp"), r"grain 1 lies 1e\+30 from the origin"),
    (dump_text(box=((-1e30, 1 - 1e30), (0, 1), (0, 1)), flags=" pp pp pp"), "no volume"),
    (FAR_CELL, r"grain 1 lies 1e\+30 from the origin"),
    *((dump_text([(id, 1, 0.5, 0.5, 0.5, 0.1)]), "ids must be whole numbers")
      for id in ("1e300", "nan", "inf", "0.5")),
    # a pattern that could cut the digits anywhere tried all places: 32 s for a table of these
    *(("id,x,y,z,radius\n" + f"1,0,{word},0,1\n" * 40, "") for word in LONG),
]  # fmt: skip


@pytest.mark.parametrize(("text", "match"), TEXTS)
def test_a_text_that_cannot_be_right_is_refused_at_once(tmp_path, text, match):
    began = time.monotonic()
    refuses(write(tmp_path / "a.txt", text), match=rf"a\.txt.*{match}")
    assert time.monotonic() - began < 5


def test_numbers_near_zero_are_no_radii(tmp_path):
    refuses(write(tmp_path / "a.txt", NEAR_ZERO), format="table", match="below 1e-100")


@pytest.mark.parametrize(
    ("name", "text", "count"),
    [
        ("a.txt.gz", "#format x_y_z_r\n0 0 0 1\n", 1),
        ("a.txt", "#format x_y_z_r\n  # none\n", 0),
        ("a.txt", dump_text(box=((-1e300, 1e300), (0, 1), (0, 1))), 3),
    ],
)
def test_an_odd_text_is_read(tmp_path, name, text, count):
    with only_scanfabs_warnings():
        packing = scanfab.read(write(tmp_path / name, text))
    assert (len(packing), packing.cell) == (count, None)


def test_wall_contacts_name_grains_that_exist(tmp_path):
    rows = [(*row[2:5], 0, 0, id) for row, id in zip(ROWS, (1, 2, 9), strict=True)]
    grains = write(tmp_path / "d.txt", dump_text())
    pairs = write(tmp_path / "p.txt", local_text(rows))
    refuses(grains, contacts=pairs, match="names the grain 9, which is not")


def test_a_box_of_any_extent_fits_into_the_file(tmp_path):
    yade_spheres(tmp_path / "g1.vtk", [[0, 0, 0]], [1])
    extent = "0 1000000000 0 1 0 1"
    write(
        tmp_path / "gboundingBox_1.vtr",
        f'<VTKFile type="RectilinearGrid"><RectilinearGrid WholeExtent="{extent}">'
        f'<Piece Extent="{extent}"/></RectilinearGrid></VTKFile>',
    )
    refuses(tmp_path / "g1.vtk", match="its Coordinates")


def test_forces_of_any_size_draw_no_warning(tmp_path):
    write(tmp_path / "d1.txt", dump_text())
    write(tmp_path / "p1.txt", pairs_text().replace("-1.5", "-1e308"))
    with only_scanfabs_warnings():
        assert len(scanfab.read(tmp_path).contacts) == 2


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
