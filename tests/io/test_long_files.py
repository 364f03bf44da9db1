"""Texts that are long enough for the quick parser: the same grains as from the tolerant one."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.io.parse import text_table
from tests.helpers.made import esys, kratos, lf_dem, mercurydpm, mfix
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
    "a.yaml": yaml_text(100) + yaml_text(200),
    "yade.txt": "#format x_y_z_r\n0\t0\t0\t1\n2.5\t0\t-1e-3\t1\n",
    "blanks.txt": "#format x_y_z_r\n0 0  0 1\n 2.5 0\t-1e-3 1 \n\n",
    "comments.txt": "#format x_y_z_r\n0 0 0 1 # the first\n# another\n2.5 0 -1e-3 1\n",
}


def content(source):
    packings = [frame.read() for frame in scanfab.read_series(source)]
    return [
        [
            *(one.tolist() for one in (packing.id, packing.position, packing.radius)),
            *((name, np.asarray(values).tolist()) for name, values in packing.columns.items()),
        ]
        for packing in packings
    ]


@pytest.mark.parametrize("name", FILES)
def test_short_and_long_files_have_the_same_grains(tmp_path, monkeypatch, name):
    path = tmp_path / name
    path.write_text(FILES[name])
    found = []
    for length in (1 << 30, 0):
        monkeypatch.setattr(text_table, "LONG", length)
        found.append(content(path))
    assert repr(found[0]) == repr(found[1])
    assert len(found[0][0][0]) > 1


def test_workers_of_esys(tmp_path, monkeypatch):
    path = esys.run(tmp_path)
    found = []
    for length in (1 << 30, 0):
        monkeypatch.setattr(text_table, "LONG", length)
        found.append(content(path))
    assert repr(found[0]) == repr(found[1])


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
    ],
)
def test_what_is_wrong_in_a_short_file_is_wrong_in_a_long_one(
    tmp_path, monkeypatch, name, old, new
):
    assert old in FILES[name]
    path = tmp_path / name
    path.write_text(FILES[name].replace(old, new, 1))
    said = []
    for length in (1 << 30, 0):
        monkeypatch.setattr(text_table, "LONG", length)
        try:
            said.append(repr(content(path)))
        except scanfab.ScanfabError as error:
            said.append(str(error))
    assert said[0] == said[1]
