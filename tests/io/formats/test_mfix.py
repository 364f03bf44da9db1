"""MFiX: rows alone and with a header; radius in one, diameter in the other."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from tests.helpers.dumps import write
from tests.helpers.made.mfix import version_2


@pytest.mark.parametrize(
    ("diameter", "size", "radius"), [("F  0.17D-2", "", 0.00085), ("T  0.0017", "0.1 ", 0.05)]
)
@pytest.mark.parametrize("behind", ["", " 300 0.5"])
def test_the_diameter_of_the_header_or_the_rows(tmp_path, diameter, size, radius, behind):
    text = version_2(diameter, size, behind=behind)
    packing = scanfab.read(write(tmp_path / "a.dat", text))
    np.testing.assert_array_equal(packing.radius, radius)
    np.testing.assert_array_equal(packing.position, [[0.05, 0.25, 1], [0.15, 0.25, 1]])
    np.testing.assert_array_equal(packing.columns["density"], 2650)
    assert packing.columns["w"].tolist() == [9, 9]


def test_a_plane(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.dat", version_2("T 0", "0.1 ", 2)))
    np.testing.assert_array_equal(packing.position, [[0.05, 0.25, 0], [0.15, 0.25, 0]])
    np.testing.assert_array_equal(packing.radius, 0.05)
    assert "w" not in packing.columns


def test_columns_without_names(tmp_path):
    path = write(tmp_path / "a.dat", version_2().replace("Velocity:        T", "Velocity: F"))
    assert list(scanfab.read(path).columns)[-3:] == ["5", "6", "7"]


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
