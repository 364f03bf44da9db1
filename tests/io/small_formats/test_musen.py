"""MUSEN's export as text: times, objects that are no spheres or not there, the periodic domain."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.base.errors import ScanfabNote
from scanfab.io.parse.text_table import LONG
from scanfab.io.registry import reader_named
from scanfab.io.small_formats import musen
from scanfab.testing import check_reader
from tests.helpers.dumps import write
from tests.helpers.made.musen import ROWS, STATE, export, sphere


def test_spheres_of_each_time(tmp_path):
    series = scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS)))
    assert [frame.snapshot.time for frame in series] == [0, 0.5]
    first, second = (frame.read() for frame in series)
    # one sphere comes later
    assert first.id.tolist() == [3, 1]
    assert second.id.tolist() == [3, 1, 2]
    np.testing.assert_array_equal(first.radius, 0.1)
    np.testing.assert_allclose(second.position[:, 0], [0.21, 0.385, 0.61])
    assert first.contacts is None
    assert first.cell is None


@pytest.mark.parametrize("last", ["", "0 99999 1 1 5 0.25 0.4 2 0 12 7 0 0 2 0.5 12 8 0 0\n"])
def test_a_long_file(tmp_path, last):
    """Its rows are parsed together, but for one of another layout: then each by itself."""
    count = LONG // len(sphere(0, 0)) + 10
    rows = [sphere(id, 0.125 * id, radius=0.05 + id / 1e6) for id in range(count)]
    series = scanfab.read_series(write(tmp_path / "a.txt", export(*rows, last)))
    packing = series[1].read()
    assert packing.id.tolist() == [*range(count), 99999][: count + bool(last)]
    np.testing.assert_array_equal(
        packing.position[:count, 0], [0.125 * id + 0.01 for id in range(count)]
    )
    np.testing.assert_array_equal(packing.radius[:count], [0.05 + id / 1e6 for id in range(count)])
    if last:
        assert packing.position[-1].tolist() == [8, 0, 0]


def test_a_file_is_parsed_once_for_all_its_frames(tmp_path, monkeypatch):
    read, real = [], musen.text_of
    monkeypatch.setattr(musen, "text_of", lambda snapshot: read.append(snapshot) or real(snapshot))
    path = write(tmp_path / "a.txt", export(*ROWS))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [2, 3]
    assert len(read) == 1
    # and again when it has changed
    write(path, export(*ROWS, sphere(9, 0.85)))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [3, 4]


def test_bonds_are_no_contacts_and_it_is_told(tmp_path):
    with pytest.warns(ScanfabNote, match="bonds are not read"):
        packing = scanfab.read(write(tmp_path / "a.txt", export(*ROWS)))
    assert packing.contacts is None


def test_the_periodic_domain(tmp_path):
    domain = "28 1 1 0 1 -1 0 -2 1 0 2"
    cell = scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS, domain=domain)))[0].read()
    cell = cell.cell
    assert cell.periodic == (True, False, True)
    assert cell.origin.tolist() == [-1, 0, -2]
    assert cell.vectors.diagonal()[[0, 2]].tolist() == [2, 4]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0 1 1 1 5 0.1", "0 1 1 1 5 word", "expected numbers, found '1 word 0.4"),
        (" 36 9", " 99 9", "expected the number of a property, found '99'"),
        ("28 0", "28 1", "its periodic domain"),
        (STATE.format(time=0.5, x=0.375 + 0.01) + "\n", "\n", "sphere 1 has no state at the time"),
    ],
)
def test_what_is_wrong(tmp_path, old, new, message):
    text = export(*ROWS)
    assert old in text
    series = scanfab.read_series(write(tmp_path / "a.txt", text.replace(old, new)))
    with pytest.raises(ReadError, match=message):
        [frame.read() for frame in series]


def test_a_part_of_a_file_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="the last line has no end"):
        scanfab.read_series(write(tmp_path / "a.txt", export(*ROWS)[:-100]))[0].read()


def test_the_kit(tmp_path):
    path = write(tmp_path / "a.txt", export(*ROWS))
    check_reader(reader_named("musen"), [path], tmp_path / "damaged")
