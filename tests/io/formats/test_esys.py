"""ESyS-Particle: a header, the files of its workers, and which column is what."""

from __future__ import annotations

import warnings
from contextlib import suppress
from random import Random

import numpy as np
import pytest

import scanfab
from scanfab.io.registry import reader_named
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


@pytest.mark.parametrize("source", ["", "snap*", "snap_t=*_0.txt"])
def test_snapshots_are_a_series_of_their_headers(tmp_path, source):
    for step in (200, 30, 1000):
        path = run(tmp_path, step)
    series = scanfab.read_series(str(tmp_path / source))
    assert [frame.step for frame in series] == [30, 200, 1000]
    assert [len(frame.read()) for frame in series] == [3, 3, 3]
    names = [one.name for one in reader_named("esys").beside(path)]
    assert names == ["snap_t=1000_1.txt", "snap_t=1000_2.txt"]


def test_damaged_files_of_workers_give_grains_or_an_error(tmp_path):
    header = run(tmp_path)
    worker = tmp_path / "snap_t=30_1.txt"
    sound, random = worker.read_bytes(), Random(0)
    for _ in range(300):
        worker.write_bytes(mutate(sound, random))
        with suppress(scanfab.ScanfabError), warnings.catch_warnings():
            warnings.simplefilter("ignore", scanfab.ScanfabWarning)
            scanfab.read(header)
