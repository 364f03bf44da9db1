"""GSD: diameters, boxes with tilt factors, and what was never written."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.io import fence, registry
from tests.helpers.made.gsd import CENTRES, frame, gsd_file


def test_frames_have_what_they_or_the_first_one_say(tmp_path):
    series = scanfab.read_series(gsd_file(tmp_path / "a.gsd", frame(7), frame(20, count=2)))
    assert [one.step for one in series] == [7, 20]
    packing, second = (one.read() for one in series)
    np.testing.assert_array_equal(packing.radius, [0.5, 0.5, 0.25])
    np.testing.assert_array_equal(second.radius, [0.5, 0.5])
    # tilt factors are multiples of the second and third edge; the box lies about the origin
    np.testing.assert_array_equal(packing.cell.vectors, [[4, 0, 0], [1.5, 3, 0], [0.5, -1, 2]])
    np.testing.assert_array_equal(packing.cell.center, [0, 0, 0])
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_array_equal(packing.position, packing.cell.wrap(CENTRES))
    assert packing.columns["body"].tolist() == [-1, 4, 4]


def test_the_default_diameter_is_no_diameter(tmp_path):
    path = gsd_file(tmp_path / "a.gsd", frame(0, diameter=None))
    with pytest.raises(ReadError, match="no radius: expected a column radius"):
        scanfab.read(path)
    np.testing.assert_array_equal(scanfab.read(path, radius=0.2).radius, 0.2)


def test_a_plane_is_not_periodic_across(tmp_path):
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
    for format in (None, "gsd"):
        with pytest.raises(scanfab.ScanfabError, match=r'pip install "scanfab\[gsd\]"'):
            scanfab.read(path, format=format)
