"""MUSEN's export as text: times, objects that are no spheres or not there, the periodic domain."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.base.errors import ScanfabNote
from scanfab.io.formats import musen
from tests.helpers.dumps import write
from tests.helpers.made.musen import ROWS, export, sphere


def test_spheres_of_each_time(tmp_path):
    series = scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS)))
    assert [frame.snapshot.time for frame in series] == [0, 0.5]
    with pytest.warns(ScanfabNote, match="bonds are not read"):
        first, second = (frame.read() for frame in series)
    # one sphere comes later
    assert first.id.tolist() == [3, 1]
    assert second.id.tolist() == [3, 1, 2]
    np.testing.assert_array_equal(first.radius, 0.1)
    np.testing.assert_allclose(second.position[:, 0], [0.21, 0.385, 0.61])
    assert first.contacts is None
    assert first.cell is None


def test_a_file_is_parsed_once_for_all_its_frames(tmp_path, monkeypatch):
    read, real = [], musen.text_of
    monkeypatch.setattr(musen, "text_of", lambda snapshot: read.append(snapshot) or real(snapshot))
    path = write(tmp_path / "a.txt", export(*ROWS))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [2, 3]
    assert len(read) == 1
    # and again when it has changed
    write(path, export(*ROWS, sphere(9, 0.85)))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [3, 4]


def test_the_periodic_domain(tmp_path):
    domain = "28 1 1 0 1 -1 0 -2 1 0 2"
    cell = scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS, domain=domain)))[0].read()
    cell = cell.cell
    assert cell.periodic == (True, False, True)
    assert cell.origin.tolist() == [-1, 0, -2]
    assert cell.vectors.diagonal()[[0, 2]].tolist() == [2, 4]


def test_a_sphere_at_other_times(tmp_path):
    late = sphere(9, 0.85).replace(" 2 0.5 ", " 2 0.75 ")
    series = scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS, late)))
    assert len(series[0].read()) == 3
    with pytest.raises(ReadError, match=r"sphere 9 has no state at the time 0\.5"):
        series[1].read()


def test_a_part_of_a_file_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="the last line has no end"):
        scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS)[:-100]))[0].read()
