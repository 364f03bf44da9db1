"""GSD: diameters, boxes with tilt factors, and what was never written."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.io import fence, registry
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.made.gsd import CENTRES, frame, gsd_file


def test_grains_and_cell(tmp_path):
    packing = scanfab.read(gsd_file(tmp_path / "a.gsd", frame(7)))
    assert packing.step == 7
    np.testing.assert_array_equal(packing.radius, [0.5, 0.5, 0.25])
    # tilt factors are multiples of the second and third edge; the box lies about the origin
    np.testing.assert_array_equal(packing.cell.vectors, [[4, 0, 0], [1.5, 3, 0], [0.5, -1, 2]])
    np.testing.assert_array_equal(packing.cell.center, [0, 0, 0])
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_array_equal(packing.position, packing.cell.wrap(CENTRES))
    assert packing.columns["body"].tolist() == [-1, 4, 4]


def test_what_does_not_change_is_that_of_the_first_frame(tmp_path):
    path = gsd_file(tmp_path / "a.gsd", frame(0), frame(10), frame(20, count=2))
    series = scanfab.read_series(path)
    assert [one.step for one in series] == [0, 10, 20]
    np.testing.assert_array_equal(series[1].read().radius, [0.5, 0.5, 0.25])
    np.testing.assert_array_equal(series[2].read().radius, [0.5, 0.5])


def test_the_default_diameter_is_no_diameter(tmp_path):
    path = gsd_file(tmp_path / "a.gsd", frame(0, diameter=None))
    with pytest.raises(ReadError, match="no radius: expected a column radius"):
        scanfab.read(path)
    np.testing.assert_array_equal(scanfab.read(path, radius=0.2).radius, 0.2)


def test_a_plane_does_not_repeat_across(tmp_path):
    path = gsd_file(tmp_path / "a.gsd", frame(0, box=(4, 3, 0, 0, 0, 0), dimensions=2))
    cell = scanfab.read(path).cell
    assert cell.periodic == (True, True, False)
    np.testing.assert_array_equal(cell.vectors[:2], [[4, 0, 0], [0, 3, 0]])


def test_another_schema_is_refused(tmp_path):
    fl = pytest.importorskip("gsd.fl")
    path = tmp_path / "a.gsd"
    with fl.open(str(path), "w", application="x", schema="mine", schema_version=[1, 0]) as file:
        file.end_frame()
    with pytest.raises(ReadError, match="its schema is 'mine', expected 'hoomd'"):
        scanfab.read(path)


def test_without_the_package(tmp_path, monkeypatch):
    path = gsd_file(tmp_path / "a.gsd", frame(0))
    monkeypatch.setattr(fence, "find_spec", lambda name: None)
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    with pytest.raises(ReadError, match=r'pip install "scanfab\[gsd\]"'):
        scanfab.read(path)
    with pytest.raises(scanfab.ScanfabError, match=r'gsd needs another package: pip install "scan'):
        scanfab.read(path, format="gsd")


def test_the_kit(tmp_path):
    path = gsd_file(tmp_path / "a.gsd", frame(0), frame(10))
    check_reader(reader_named("gsd"), [path], tmp_path / "damaged")
