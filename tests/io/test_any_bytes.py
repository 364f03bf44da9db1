"""Whatever bytes a file holds: an answer or an error of the package, and nothing printed."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import scanfab
from scanfab.base.errors import ScanfabError
from scanfab.io.reader import ReadOptions
from tests.helpers.fuzzing import (
    NAMES,
    OPTIONS,
    READERS,
    mutate,
    only_scanfabs_warnings,
    read_everything,
)
from tests.helpers.sound_files import companion_grains, seeds

HEADS = (
    b"",
    b"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\n",
    b"# vtk DataFile Version 3.0.\n\nBINARY\nDATASET POLYDATA\n",
    b'<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="1">',
    b'<VTKFile type="Collection"><Collection>',
    b"<Xdmf><Domain><Grid>",
    b"#format x_y_z_r\n",
    b"##PERIODIC:: 1 1 1\n",
    b"LAMMPS data file\n\n1 atoms\n0 1 xlo xhi\n\nAtoms # sphere\n\n",
    b"<boost_serialization><scene><px>",
    b"\x16\x00serialization::archive",
    b"\x1f\x8b",
    b"BZh9",
    b"\xfd7zXZ\x00",
    b"\x28\xb5\x2f\xfd",
    b"\x04\x22\x4d\x18",
    b"PAR1",
    b"PK\x03\x04",
    b"x,y,z,radius\n",
    b"LIGGGHTS data file\n\n1 atoms\n0 1 xlo xhi\n\nAtoms\n\n",
    b"---\ncreator: LAMMPS\ntimestep: 1\n",
    b"CDF\x05",
    b"\xdf\x65\xdf\x65\xdf\x65\xdf\x65",
    b"MercuryDPM 1.0 name a\n",
    b"1 0 0 0 0 1 1 1\n",
    b"# 0 1\n# 0 0 0 1 1 1\n# 1 1 0 0 0 0\n",
    b"# LF_DEM version 2\n# np 1\n",
    b"0 1 1 1 5 0.1 0.1 ",
    b"Version 2.0\nDimension: 3\nParticles: 1\n",
    b"Begin Nodes\n",
    b"V 3\n1\n0.5\n1\nESyS-Particle 2\nBoundingBox 0 0 0 1 1 1\n",
    b"\xff\xfe",
)
FEW = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,  # others are left to tests/fuzz: a crash would end all tests
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(scope="module", params=READERS)
def sound(request, tmp_path_factory):
    """A reader's name, and sound files for it."""
    folder = tmp_path_factory.mktemp("seeds")
    files = seeds(request.param, folder)
    for name, content in files:
        (folder / name).write_bytes(content)
        # kernels that are compiled here, once, say so; the tests want no other word
        read_everything(folder / name, request.param, ReadOptions())
    return request.param, files


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """A function that writes a file, each in a folder of its own."""

    def write(name: str, data: bytes):
        path = tmp_path_factory.mktemp("any") / name
        path.write_bytes(data)
        return path

    return write


@FEW
@given(data=st.data(), random=st.randoms(use_true_random=True))
def test_damaged_files_give_an_answer_or_an_error(sound, fresh, capfd, data, random):
    format, files = sound
    name, content = data.draw(st.sampled_from(files))
    options = data.draw(st.sampled_from(OPTIONS))
    ending = data.draw(st.sampled_from([name, *NAMES]))
    read_everything(fresh(ending, mutate(content, random)), format, options)
    assert capfd.readouterr() == ("", "")


@FEW
@given(
    head=st.sampled_from(HEADS),
    content=st.binary(max_size=300),
    name=st.sampled_from(NAMES),
    format=st.sampled_from(READERS),
)
def test_any_bytes_give_an_answer_or_an_error(fresh, capfd, head, content, name, format):
    read_everything(fresh(name, head + content), format, ReadOptions())
    assert capfd.readouterr() == ("", "")


@FEW
@given(data=st.data(), random=st.randoms(use_true_random=True))
def test_damaged_files_in_a_series_give_a_packing_or_an_error(sound, fresh, capfd, data, random):
    format, files = sound
    name, content = data.draw(st.sampled_from(files))
    path = fresh(name, mutate(content, random))
    _, companion = companion_grains(format)
    with only_scanfabs_warnings():
        for source, options in (
            (path, {}),
            (path, {"format": format, "radius": 0.1}),
            (companion.files[1], {"contacts": path}),
        ):
            try:
                packings = [frame.read() for frame in scanfab.read_series(source, **options)]
            except ScanfabError as error:
                answers = [str(error)]
            else:
                answers = [repr(packing) for packing in packings]
            assert all(answers)
    assert capfd.readouterr() == ("", "")
