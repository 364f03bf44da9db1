"""Texts that are long enough for the quick parser: the same grains as from the tolerant one."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.io.parse import text_table
from tests.helpers.made import esys, kratos, lf_dem, mercurydpm, mfix, musen
from tests.helpers.made.data_files import data_file
from tests.helpers.made.lammps import yaml_text

XYZ = (
    "3\nProperties=id:I:1:pos:R:3:radius:R:1\n"
    "3 0.5 1e-3 -.25 1\n9007199254740993 2.5 0 0 1\n1 5 0 0 1\n"
)
FILES = {
    "a.xyz": XYZ.replace("9007199254740993", "7"),
    "large_id.xyz": XYZ,
    "run.data": mercurydpm.data_frame(0.1),
    "par.dat": lf_dem.grains_text(),
    "particle_input.dat": "0.1 0.2 0.5D-1 2.65d3 7 8\n  0.4 0.2 0.5D-01 2650 7 8\n",
    "two.dat": mfix.version_2(),
    "a.mdpa": kratos.MDPA,
    "a.data": data_file(),
    "musen.txt": musen.export(*musen.ROWS),
    "a.yaml": yaml_text(100) + yaml_text(200),
    "yade.txt": "#format x_y_z_r\n0\t0\t0\t1\n2.5\t0\t-1e-3\t1\n",
    "blanks.txt": "#format x_y_z_r\n0 0  0 1\n 2.5 0\t-1e-3 1 \n\n",
    "two_blanks.txt": "#format x_y_z_r\n0  0  0  1\n2.5  0  -1e-3  1\n",
    "empty_windows.txt": "#format x_y_z_r\r\n\r\n0\t0\t0\t1\r\n2.5\t0\t-1e-3\t1\r\n",
}
ROWS = "3,0.5,1e-3,-.25,1\n9007199254740993,2.5,0,0,1\n1,5,0,0,1\n"
TABLES = {
    "aligned.txt": "id x y z radius\n" + "  " + ROWS.replace(",", "  ").replace("\n1", "\n  1"),
    "a.csv": "id,x,y,z,radius\n" + ROWS,
    "mark.csv": "\ufeffid,x,y,z,radius\n" + ROWS,
    "a.tsv": "# of a program\nid\tx\ty\tz\tradius\n" + ROWS.replace(",", "\t"),
    "blank.txt": "id x y z radius\n" + ROWS.replace(",", " "),
    "runs.txt": "id x y z radius\n" + ROWS.replace(",", "  "),
    "windows.csv": "id,x,y,z,radius\r\n" + ROWS.replace("\n", "\r\n"),
    "open.csv": "id,x,y,z,radius,\n" + ROWS.replace("\n", ",\n"),
    "semicolons.csv": "id;x;y;z;radius\n" + ROWS.replace(",", ";").replace(".", ","),
    "double.csv": "id,x,y,z,radius\n" + ROWS.replace("1e-3", "1D-3"),
    "words.csv": "id,x,y,z,radius,kind\n" + ROWS.replace("\n", ",sand\n"),
    "gaps.csv": "id,x,y,z,radius,force\n" + ROWS.replace("\n", ",7\n").replace(",7", ",", 1),
    "ends.csv": "id,x,y,z,radius\n" + ROWS + "\n\n",
}


@pytest.fixture(params=["LONG", "PIECE"])
def lengths(request, monkeypatch):
    """Sets what is long for the quick parser: a text in memory, or one that is read by pieces."""

    def both(read):
        found = []
        for length in (1 << 30, 0 if request.param == "LONG" else 10):
            monkeypatch.setattr(text_table, request.param, length)
            found.append(read())
        return found

    return both


def content(source):
    packings = [frame.read() for frame in scanfab.read_series(source)]
    return [
        [
            *(one.tolist() for one in (packing.id, packing.position, packing.radius)),
            *((name, np.asarray(values).tolist()) for name, values in packing.columns.items()),
        ]
        for packing in packings
    ]


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
@pytest.mark.parametrize("name", [*FILES, *TABLES])
def test_short_and_long_files_have_the_same_grains(tmp_path, lengths, name):
    path = tmp_path / name
    path.write_text((FILES | TABLES)[name], "utf-8", newline="")
    short, long = lengths(lambda: content(path))
    assert repr(short) == repr(long)
    assert len(short[0][0]) > 1


def test_workers_of_esys(tmp_path, lengths):
    path = esys.run(tmp_path)
    short, long = lengths(lambda: content(path))
    assert repr(short) == repr(long)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("a.xyz", "3 0.5", "3.5 0.5"),
        ("a.xyz", " -.25", " -.25 7"),
        ("a.xyz", "1e-3", "1_0"),
        ("yade.txt", "2.5\t0", "2.5\tx"),
        ("yade.txt", "2.5\t0", "2.5\t0\t0"),
        ("run.data", "0.29", "0.2\x019"),
        ("run.data", "0.29", "0.29\x0b"),
        ("particle_input.dat", "0.5D-1", "0.5D"),
        ("musen.txt", " 12 0.6 0.5 0.5 15", " 12 0.6 0.5 0.5 015"),
        ("run.data", "0.29", "0.29\r"),
        ("particle_input.dat", "7 8\n", "7  8\r\r\n"),
        ("yade.txt", "2.5\t0", "2.5\r\t0"),
        ("two_blanks.txt", "3  1\n", "3  1\r\r\n"),
        ("a.csv", "2.5,0", "2.5,0,0"),
        ("a.csv", "2.5,0", "2.5"),
        ("a.csv", "2.5,0", "2.5,x"),
        ("a.csv", "2.5,0", "2.5,"),
        ("a.csv", "2.5,0", "2.5,\0"),
        ("a.csv", "\n1,5", "\n\n1,5"),
        ("a.csv", "\n1,5", "\n# 1,5"),
        ("a.csv", "\n1,5", "\n1.5,5"),
        ("a.csv", "5,0,0,1\n", "5,0,0,1"),
        ("a.csv", "2.5,0", '"2.5",0'),
        ("blank.txt", "2.5 0", "2.5\t0"),
        ("blank.txt", "\n1 5", "\n 1 5"),
    ],
)
def test_what_is_wrong_in_a_short_file_is_wrong_in_a_long_one(tmp_path, lengths, name, old, new):
    text = (FILES | TABLES)[name]
    assert old in text
    path = tmp_path / name
    path.write_text(text.replace(old, new, 1), "utf-8", newline="")

    def said():
        try:
            return repr(content(path))
        except scanfab.ScanfabError as error:
            return str(error)

    short, long = lengths(said)
    assert short == long
