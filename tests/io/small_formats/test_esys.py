"""ESyS-Particle: a header, the files of its workers, and which column is what."""

from __future__ import annotations

from contextlib import suppress
from random import Random

import numpy as np
import pytest

import scanfab
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.fuzzing import mutate
from tests.helpers.made.esys import TURNS, run


@pytest.mark.parametrize("behind", ["", TURNS, " 1", " 1 0.1" + TURNS + " 1"])
def test_particles_of_all_workers(tmp_path, behind):
    packing = scanfab.read(run(tmp_path, behind=behind))
    assert packing.id.tolist() == [4, 5, 1]
    np.testing.assert_array_equal(packing.position, [[1, 1, 2], [1.5, 1, 2], [3.75, 1, 2]])
    np.testing.assert_array_equal(packing.radius, 0.25)
    assert packing.columns["tag"].tolist() == [77] * 3
    assert (packing.step, packing.time) == (30, 15.0)
    assert packing.cell.periodic == (True, False, False)
    assert packing.cell.origin.tolist() == [0, -1, 0]
    assert packing.cell.vectors.diagonal().tolist() == [4, 6, 6]
    # bonds are no contacts
    assert packing.contacts is None


def test_headers_are_a_series(tmp_path):
    for step in (200, 30):
        run(tmp_path, step)
    series = scanfab.read_series(str(tmp_path / "snap_t=*_0.txt"))
    assert [frame.step for frame in series] == [30, 200]
    assert [len(frame.read()) for frame in series] == [3, 3]


@pytest.mark.parametrize("source", ["", "snap*"])
def test_a_folder_of_snapshots_is_their_headers(tmp_path, source):
    for step in (200, 30, 1000):
        run(tmp_path, step)
    series = scanfab.read_series(str(tmp_path / source))
    assert [frame.step for frame in series] == [30, 200, 1000]
    assert [len(frame.read()) for frame in series] == [3, 3, 3]


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("0", "V 3", "V 9", "expected version 2 or 3, found 9"),
        ("0", "_2.txt", "_1.txt", "expected the names of its workers' files"),
        ("0", "_2.txt", "_7.txt", "there is no such file"),
        ("1", "2\n1 1", "9\n1 1", "expected 9 particles|number of columns|expected a number"),
        ("1", "0.25 4 77", "0.25 4", "number of columns changed"),
        ("1", "0.25 4 77", "0.25 1 77", "the id 1 occurs twice"),
        ("2", "1\n3.75", "x\n3.75", "expected the number of particles"),
    ],
)
def test_what_is_wrong(tmp_path, name, old, new, message):
    path = run(tmp_path)
    file = tmp_path / f"snap_t=30_{name}.txt"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read(path)


def test_the_files_of_the_workers_are_inputs(tmp_path):
    path = run(tmp_path)
    names = [one.name for one in reader_named("esys").beside(path)]
    assert names == ["snap_t=30_1.txt", "snap_t=30_2.txt"]


def test_the_kit(tmp_path):
    path = run(tmp_path, prefix="")
    (tmp_path / "damaged").mkdir()
    for name in ("snap_t=30_1.txt", "snap_t=30_2.txt"):
        (tmp_path / "damaged" / name).write_bytes((tmp_path / name).read_bytes())
    check_reader(reader_named("esys"), [path], tmp_path / "damaged")


def test_damaged_files_of_workers_give_grains_or_an_error(tmp_path):
    header = run(tmp_path)
    worker = tmp_path / "snap_t=30_1.txt"
    sound, random = worker.read_bytes(), Random(0)
    for _ in range(500):
        worker.write_bytes(mutate(sound, random))
        with suppress(scanfab.ScanfabError):
            scanfab.read(header)
