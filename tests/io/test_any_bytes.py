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

# how files begin that are no seeds of a reader
HEADS = (b"", b"<Xdmf><Domain><Grid>", b"\x16\x00serialization::archive", b"\x1f\x8b", b"BZh9")
HEADS += (b"\xfd7zXZ\x00", b"\x28\xb5\x2f\xfd", b"\x04\x22\x4d\x18", b"PAR1", b"PK\x03\x04")
HEADS += (b"---\ncreator: LAMMPS\ntimestep: 1\n", b"CDF\x05", b"\xff\xfe")
FEW = settings(
    max_examples=25,
    deadline=None,
    derandomize=True,  # others are left to campaigns: a crash would end all tests
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
@given(data=st.data(), random=st.randoms(use_true_random=True), more=st.binary(max_size=300))
def test_any_file_gives_an_answer_or_an_error(sound, fresh, capfd, data, random, more):
    """Sound files with damages, and any bytes behind the first bytes of a file of some format."""
    format, files = sound
    name, content = data.draw(st.sampled_from(files))
    heads = [*HEADS, *(seed[:60] for _, seed in files)]
    is_damaged = data.draw(st.booleans())
    content = mutate(content, random) if is_damaged else data.draw(st.sampled_from(heads)) + more
    ending, options = (data.draw(st.sampled_from(some)) for some in ([name, *NAMES], OPTIONS))
    read_everything(fresh(ending, content), format, options)
    # and as a source of grains or contacts
    path = fresh(name, content)
    _, companion = companion_grains(format)
    with only_scanfabs_warnings():
        for source, more_options in (
            (path, {}),
            (path, {"format": format, "radius": 0.1}),
            (companion.files[1], {"contacts": path}),
        ):
            try:
                packings = [frame.read() for frame in scanfab.read_series(source, **more_options)]
            except ScanfabError as error:
                answers = [str(error)]
            else:
                answers = [repr(packing) for packing in packings]
            assert all(answers)
    assert capfd.readouterr() == ("", "")
