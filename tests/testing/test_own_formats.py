"""Our own readers and writers pass the kit that others are given."""

from __future__ import annotations

import warnings

import pytest

import scanfab
from scanfab.io.reader import reader_named
from scanfab.io.writer import installed_writers, writer_named
from scanfab.testing import check_reader, check_writer, made_up_packings
from tests.helpers.dumps import dump_text, pairs_text, write, yade_lines, yade_spheres
from tests.helpers.sound_files import seeds
from tests.helpers.truth import FLOOR

WRITERS = list(installed_writers())
# which reader reads what a writer writes, and whether its format counts its grains
READERS = {
    "lammps": ("lammps", True),
    "lammps-data": ("lammps", True),
    "npz": ("npz", True),
    "vtp": ("vtk", True),
    "xyz": ("xyz", True),
}
SMALL = ("plain", "everything", "no grains")


@pytest.fixture(autouse=True)
def few_damages(monkeypatch):
    """Each reader gets files of any bytes elsewhere, too."""
    monkeypatch.setattr("scanfab.testing.readers.CUTS", 15)
    monkeypatch.setattr("scanfab.testing.readers.DAMAGES", 40)


@pytest.mark.parametrize("name", WRITERS)
def test_what_is_written_is_read_back_to_the_last_bit(tmp_path, name):
    check_writer(writer_named(name), tmp_path)


@pytest.mark.parametrize("name", READERS)
def test_readers_of_what_is_written_pass(tmp_path, name):
    reader, counts = READERS[name]
    writer = writer_named(name)
    files = []
    for place, packing in enumerate(made_up_packings()[one] for one in SMALL):
        files.append(tmp_path / f"file{place}{writer.extensions[0]}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", scanfab.ScanfabNote)
            scanfab.convert(packing, files[-1], to=name)
    check_reader(reader_named(reader), files, tmp_path / "damaged", counts=counts)


@pytest.mark.parametrize("name", ["liggghts", "lammps", "yade"])
def test_readers_of_dumps_pass(tmp_path, name):
    reader = reader_named(name)
    made = [tmp_path / name for name, _ in seeds(name, tmp_path)]
    grains = [
        path
        for path in made
        if path.is_file() and reader.recognises(path) and reader.kind(path) == "grains"
    ]
    pair = write(tmp_path / "p.local", pairs_text()), write(tmp_path / "g.dump", dump_text())
    if name == "yade":
        places = [[0, 0, 0], [1.9, 0, 0]]
        spheres = yade_spheres(tmp_path / "g-spheres-0.vtk", places, [1, 1])
        pair = yade_lines(tmp_path / "g-intrs-0.vtk", [places]), spheres
    # behind these, some need options
    check_reader(reader, grains[:3], tmp_path / "damaged", contacts=[pair])


def test_vtk_files_of_any_program_pass(tmp_path):
    files = [FLOOR / f"grains_30000{ending}" for ending in (".vtp", ".vtu")]
    check_reader(reader_named("vtk"), files, tmp_path / "damaged")


def test_a_reader_that_reads_a_part_of_a_file_as_fewer_grains_fails(tmp_path):
    """Tables do not say how many rows they have."""
    file = write(tmp_path / "a.csv", "x,y,z,radius\n" + 9 * "0,0,0,1\n")
    with pytest.raises(AssertionError, match="a part of a file must be an error"):
        check_reader(reader_named("table"), [file], tmp_path / "damaged", counts=True)
