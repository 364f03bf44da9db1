"""MFiX: rows alone and with a header; radius in one, diameter in the other."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.dumps import write
from tests.helpers.made.mfix import version_2


@pytest.mark.parametrize("behind", ["", " 300 0.5"])
def test_the_diameter_of_the_header(tmp_path, behind):
    packing = scanfab.read(write(tmp_path / "a.dat", version_2(behind=behind)))
    np.testing.assert_array_equal(packing.radius, 0.00085)
    np.testing.assert_array_equal(packing.position, [[0.05, 0.25, 1], [0.15, 0.25, 1]])
    np.testing.assert_array_equal(packing.columns["density"], 2650)
    assert packing.columns["w"].tolist() == [9, 9]


def test_diameters_in_the_rows(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.dat", version_2("T  0.0017", "0.1 ")))
    np.testing.assert_array_equal(packing.radius, 0.05)
    np.testing.assert_array_equal(packing.columns["density"], 2650)


def test_a_plane(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.dat", version_2("T 0", "0.1 ", 2)))
    np.testing.assert_array_equal(packing.position, [[0.05, 0.25, 0], [0.15, 0.25, 0]])
    np.testing.assert_array_equal(packing.radius, 0.05)
    assert "w" not in packing.columns


@pytest.mark.parametrize(
    ("row", "place"),
    [
        ("0.1D0 0.2 0.5250D-01 2650 7 8", [0.1, 0.2, 0]),
        ("0.1 0.2 3 0.0525 2650 7 8 9", [0.1, 0.2, 3]),
    ],
)
def test_rows_alone_have_radii(tmp_path, row, place):
    packing = scanfab.read(write(tmp_path / "particle_input.dat", f"{row}\n"))
    np.testing.assert_array_equal(packing.radius, 0.0525)
    np.testing.assert_array_equal(packing.position, [place])
    # rows of numbers by another name may be anything
    with pytest.raises(scanfab.ScanfabError):
        scanfab.read(write(tmp_path / "other.dat", f"{row}\n"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Version 2.0", "Version 3.0", "expected version 2.0, found 3.0"),
        ("Particles:    2", "Particles:    3", "the header counts 3 particles, found 2"),
        ("Diameter:        F  0.0017", "Diameter:        F  none", "expected T, or F and a number"),
        ("Density: ", "Weight: ", "found none of Density"),
        ("Velocity:        T", "Velocity:        F", None),
    ],
)
def test_what_is_wrong(tmp_path, old, new, message):
    text = version_2()
    assert old in text
    path = write(tmp_path / "a.dat", text.replace(old, new))
    if message is None:
        assert list(scanfab.read(path).columns)[-3:] == ["5", "6", "7"]
        return
    with pytest.raises(ReadError, match=message):
        scanfab.read(path)


def test_the_kit(tmp_path):
    reader = reader_named("mfix")
    check_reader(
        reader, [write(tmp_path / "a.dat", version_2())], tmp_path / "damaged", counts=True
    )
    alone = write(tmp_path / "particle_input.dat", "0.1 0.2 0.05 2650 7 8\n")
    check_reader(reader, [alone], tmp_path / "more")
