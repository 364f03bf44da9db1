"""Our own readers and writers pass the kit that others are given."""

import pytest

from scanfab.io.reader import reader_named
from scanfab.io.writer import installed_writers, writer_named
from scanfab.testing import check_reader, check_writer
from tests.helpers.dumps import write
from tests.helpers.sound_files import made

# of each reader: grains that no cut may make fewer, as the file counts them; other grains; contacts
FILES = {
    "edem": ("", "grains.csv", "pairs.csv"),
    "esys": ("snap_t=30_0.txt", "", ""),
    "gsd": ("a.gsd", "", ""),
    "kratos": ("a.mdpa a.hdf5", "", ""),
    "lammps": ("general.lammpstrj grains.data new_one.bin a.nc", "a.yaml", ""),
    "lf-dem": ("", "par.dat", "int.dat"),
    "liggghts": ("one.txt plain.data hybrid.data", "", "pairs.txt"),
    "mercurydpm": ("run.restart flat.data", "run.data", "run.fstat"),
    "mfix": ("a.dat", "particle_input_f_1.dat", ""),
    "musen": ("", "a.txt", ""),
    "npz": ("npz0.npz npz2.npz npz6.npz", "", ""),
    "on-dem": ("vtkhdf2.vtkhdf first.vtkhdf", "", ""),
    "pfc": ("", "grains.csv", "pairs.csv"),
    "table": ("b.npz b.parquet", "named.csv", "pairs.csv"),
    "vtk": ("0_cloud.vtk 0_cloud.vtp 1_grid.vtu", "", "0_lines.vtp"),
    "xyz": ("xyz0.xyz xyz2.xyz xyz6.xyz", "", ""),
    "yade": ("spheres.vtk save.xml", "attrs.txt pack.txt", "lines.vtk"),
}


@pytest.fixture(autouse=True)
def few_damages(monkeypatch):
    """Each reader gets files of any bytes elsewhere, too."""
    monkeypatch.setattr("scanfab.testing.CUTS", 12)
    monkeypatch.setattr("scanfab.testing.DAMAGES", 20)


@pytest.mark.parametrize("name", installed_writers())
def test_what_is_written_is_read_back_to_the_last_bit(tmp_path, name):
    check_writer(writer_named(name), tmp_path)


@pytest.mark.parametrize("name", FILES)
def test_readers_pass(tmp_path, name):
    reader, paths = reader_named(name), {path.name: path for path in made(name, tmp_path)}
    counted, others, contacts = ([paths[one] for one in names.split()] for names in FILES[name])
    pairs = [(one, [*counted, *others][0]) for one in contacts]
    for file in (*counted, *others):
        # damaged files lie beside those that they name
        check_reader(reader, [file], tmp_path, contacts=pairs, counts=file in counted)
        pairs = []


def test_a_reader_that_reads_a_part_of_a_file_as_fewer_grains_fails(tmp_path):
    """Tables do not say how many rows they have."""
    file = write(tmp_path / "a.csv", "x,y,z,radius\n" + 9 * "0,0,0,1\n")
    with pytest.raises(AssertionError, match="a part of a file must be an error"):
        check_reader(reader_named("table"), [file], tmp_path / "damaged", counts=True)
