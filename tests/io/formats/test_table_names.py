"""Which column is what: none serves twice, and units are not guessed in silence."""

from __future__ import annotations

import warnings

import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabWarning, SettingsError
from scanfab.io.options import parse_columns
from tests.helpers.dumps import dump_text, write

ROWS = "0,0,0,0.5,7\n1,0,0,0.5,7\n"
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def of_names(folder, names, name="g.csv"):
    return write(folder / name, f"{names}\n{ROWS}")


@pytest.mark.parametrize("format", [None, "table"])
@pytest.mark.parametrize(
    ("names", "columns", "twice"),
    [
        ("", {"x": 2, "y": "2", "z": 4, "radius": 5}, "'2' is named twice .*, as x and as y"),
        ("a,b,c,d,e", {"x": "a", "y": 2, "z": "b", "radius": "d"}, "'b' .*, as y and as z"),
        ("x,y,z,r,e", {"radius": "r", "age": "r"}, "'r' is named twice in .*, as radius and"),
    ],
)
def test_a_column_that_serves_twice_is_named(tmp_path, names, columns, twice, format):
    path = of_names(tmp_path, names) if names else write(tmp_path / "g.csv", ROWS)
    with pytest.raises(ReadError, match=f"the column {twice}"):
        scanfab.read(path, columns=columns, format=format)


def test_so_it_is_of_dumps_and_of_contacts(tmp_path):
    dump = write(tmp_path / "dump.txt", dump_text())
    with pytest.raises(ReadError, match="'x' is named twice in `columns`, as x and as y"):
        scanfab.read(dump, columns={"x": "x", "y": "x"})
    path, pairs = of_names(tmp_path, "x,y,z,r,id"), write(tmp_path / "p.csv", "id1,id2\n0,1\n")
    twice = "the column 'id1' is named twice in `contact_columns`, as id1 and as id2"
    options = {"contacts": pairs, "contact_columns": "id1=id1,id2=1", "format": "table"}
    with pytest.raises(ReadError, match=twice):
        scanfab.read(path, **options)


def test_what_is_named_by_two_columns_is_refused():
    with pytest.raises(SettingsError, match="columns: expected one column as x, found 'x=1,y=2,x"):
        parse_columns("columns", "x=1,y=2,x=3")


def test_contact_columns_that_no_file_has_are_told(tmp_path):
    path = of_names(tmp_path, "x,y,z,r,age")
    write(tmp_path / "g.contacts.csv", "a,b\n0,1\n")
    with pytest.warns(ScanfabWarning, match="there is no file of contacts with such columns"):
        scanfab.read(path, contact_columns="id1=a,id2=c")
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        assert len(scanfab.read(path, contact_columns="id1=a,id2=b").contacts) == 1
        scanfab.read(path, contact_columns="id1=a,id2=c", contacts="geometric")


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("x [mm],y [mm],z [mm],radius,e", r"x \[mm\], y \[mm\], z \[mm\] name a unit, radius none"),
        ("x,y,z,radius (m),e", r"radius \(m\) name a unit, x, y, z none"),
        ("x,y,z,diameter (m),e [s]", r"diameter \(m\) name a unit, x, y, z none"),
    ],
)
def test_lengths_without_a_unit_beside_others_are_told(tmp_path, names, told):
    with pytest.warns(ScanfabWarning, match=rf"g\.csv: {told}: all are taken to be in the same"):
        scanfab.read(of_names(tmp_path, names))


@pytest.mark.parametrize("names", ["x,y,z,radius,age [s]", "x [mm],y [mm],z [mm],radius [mm],e"])
def test_of_lengths_with_one_unit_or_none_nothing_is_said(tmp_path, names):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        scanfab.read(of_names(tmp_path, names))
