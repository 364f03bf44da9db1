"""Readers found through entry points: the built-in ones, foreign plugins, and names of none."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import UnknownFormatError
from scanfab.io.reader import GrainTable, JoinedContacts, Snapshot, installed_readers, reader_for
from scanfab.packing.contacts import ContactList
from tests.helpers.dumps import dump_text, write
from tests.helpers.plugins import offer
from tests.helpers.truth import FLOOR


class NumbersReader:
    """A foreign plugin: a first line that names the kind, then numbers."""

    name = "numbers"
    description = "numbers in rows"
    extensions = (".numbers",)

    def recognises(self, path):
        return path.read_bytes().startswith(b"numbers of ")

    def kind(self, path):
        return path.read_text().split()[2]

    def snapshots(self, path):
        return [Snapshot(path)]

    def read_grains(self, snapshot, options):
        values = np.loadtxt(snapshot.path, skiprows=1, ndmin=2)
        return GrainTable(values[:, :3], values[:, 3], None, {}, None)

    def read_contacts(self, snapshot, options, grains):
        pairs = np.loadtxt(snapshot.path, skiprows=1, ndmin=2).astype(int)
        return JoinedContacts(ContactList(pairs), np.zeros(len(grains.radius), int))


@pytest.mark.parametrize("format", [None, "numbers"])
def test_a_foreign_plugin_reads_a_series_like_the_built_in_ones(tmp_path, monkeypatch, format):
    offer(monkeypatch, "scanfab.readers", "numbers", lambda: NumbersReader)
    installed_readers.cache_clear()
    for step in (9, 10):
        write(tmp_path / f"g_{step}.dat", f"numbers of grains\n0 0 0 1\n1.9 0 0 1\n0 0 {step} 1\n")
        write(tmp_path / f"c_{step}.dat", "numbers of contacts\n0 1\n")
    try:
        frames = [frame.read() for frame in scanfab.read_series(tmp_path, format=format)]
    finally:
        installed_readers.cache_clear()
    assert [(frame.step, len(frame)) for frame in frames] == [(9, 3), (10, 3)]
    np.testing.assert_array_equal(frames[1].contacts.pairs, [[0, 1]])


def test_a_name_that_does_not_exist_is_an_error_that_lists_those_that_do():
    assert installed_readers()["yade"].package == "scanfab"
    with pytest.raises(UnknownFormatError, match=r"called 'rocky'.* liggghts, .*, vtk, xyz, yade"):
        scanfab.read(FLOOR / "tutorial.txt", format="rocky")


def test_the_name_of_a_file_does_not_matter(tmp_path):
    for name in ("log.txt", "deck.vtk", "notes.dump", "x.vtu", "no_ending_at_all"):
        assert reader_for(write(tmp_path / name, "hello\n")) is None
        assert reader_for(write(tmp_path / name, dump_text())).name == "liggghts"
