"""LAMMPS' dumps that are no usual text: YAML, NetCDF, and text of old versions."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.io import fence
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.dumps import ROWS, write
from tests.helpers.made.lammps import netcdf, yaml_text


def test_netcdf(tmp_path):
    series = scanfab.read_series(netcdf(tmp_path / "a.nc", written=2))
    assert [(frame.step, frame.snapshot.time) for frame in series] == [(0, 0.0), (100, 50.0)]
    first, second = (frame.read() for frame in series)
    np.testing.assert_array_equal(first.position, first.cell.wrap(np.array(ROWS)[:, 2:5]))
    np.testing.assert_array_equal(first.radius, 0.1)
    # one atom was lost: its place holds what was never written
    assert second.id.tolist() == [1, 2]
    # edges a, b and their angle; an edge of length 0 does not repeat
    assert first.cell.periodic == (True, True, False)
    np.testing.assert_allclose(first.cell.vectors[:2], [[1, 0, 0], [1, 3**0.5, 0]], atol=1e-15)
    assert first.cell.origin.tolist() == [0, -1, 0]


def test_netcdf_of_scaled_coordinates(tmp_path):
    path = netcdf(tmp_path / "a.nc", name="scaled_coordinates", lengths=(2, 2, 4))
    cell = scanfab.read_series(path)[0].read().cell
    found = scanfab.read_series(path)[0].read().position
    expected = cell.wrap(cell.origin + np.array(ROWS)[:, 2:5] @ cell.vectors)
    np.testing.assert_allclose(found, expected)


def test_netcdf_without_a_cell_has_none(tmp_path):
    assert scanfab.read_series(netcdf(tmp_path / "a.nc", lengths=(0, 0, 0)))[0].read().cell is None


def test_netcdf_with_a_coordinate_that_was_not_dumped(tmp_path):
    with pytest.raises(ReadError, match="coordinates was not written for all atoms"):
        scanfab.read_series(netcdf(tmp_path / "a.nc", axes=2))[0].read()


def test_netcdf_without_the_package(tmp_path, monkeypatch):
    path = netcdf(tmp_path / "a.nc")
    monkeypatch.setattr(fence, "find_spec", lambda name: None)
    with pytest.raises(ReadError, match=r'pip install "scanfab\[netcdf\]"'):
        scanfab.read(path)


def test_the_kit(tmp_path):
    files = [write(tmp_path / "a.yaml", yaml_text()), netcdf(tmp_path / "a.nc")]
    check_reader(reader_named("lammps"), files, tmp_path / "damaged", counts=True)
