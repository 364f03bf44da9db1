"""Whatever bytes a file holds: an answer or an error of the package, and nothing printed."""

from random import Random

import pytest

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
# others are left to campaigns: a crash would end all tests
TRIES = 10


@pytest.mark.parametrize("format", READERS)
def test_any_file_gives_an_answer_or_an_error(tmp_path, capfd, format):
    """Sound files, with damages, and any bytes behind the first bytes of a file of some format."""
    files, (_, companion) = seeds(format, tmp_path), companion_grains(format)
    for name, content in files:
        (tmp_path / name).write_bytes(content)
        read_everything(tmp_path / name, format, ReadOptions())
    # kernels that are compiled here, once, say so; the tests want no other word
    capfd.readouterr()
    random, heads = Random(format), [*HEADS, *(content[:60] for _, content in files)]
    for number in range(TRIES):
        (folder := tmp_path / f"{number}").mkdir()
        name, content = random.choice(files)
        content = mutate(content, random)
        if number % 2:
            content = random.choice(heads) + random.randbytes(random.randrange(300))
        path, other = folder / name, folder / random.choice([f"again_{name}", *NAMES])
        for file in (path, other):
            file.write_bytes(content)
        read_everything(other, format, random.choice(OPTIONS))
        # and as a source of grains or contacts
        for source, options in (
            (path, {}),
            (path, {"format": format, "radius": 0.1}),
            (companion.files[1], {"contacts": path}),
        ):
            with only_scanfabs_warnings():
                try:
                    found = [frame.read() for frame in scanfab.read_series(source, **options)]
                except ScanfabError as error:
                    found = [error]
            assert all(map(str, found))
    assert capfd.readouterr() == ("", "")
