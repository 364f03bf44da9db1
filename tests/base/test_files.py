"""A file is whole or untouched."""

import os

import pytest

from scanfab.base.files import check_folder, whole_file


def test_what_is_written_takes_the_place_of_the_file(tmp_path):
    path = tmp_path / f"{'a' * 250}.txt"  # a name as long as the system lets it be
    (tmp_path / "a.part.txt").write_text("the user's")
    path.write_text("old")
    # as of two processes
    with whole_file(path) as one, whole_file(path) as other:
        one.write_text("one")
        other.write_text("other")
        assert path.read_text() == "old"
    assert path.read_text() == "one"
    assert (tmp_path / "a.part.txt").read_text() == "the user's"
    assert len(list(tmp_path.iterdir())) == 2


def write_half(path, error):
    with whole_file(path) as part:
        if error is not None:  # else nothing is written at all
            part.write_text("half")
            raise error


@pytest.mark.parametrize("error", [KeyError(), OSError(28, "No space left on device"), None])
def test_after_an_error_the_file_is_the_old_one(tmp_path, error):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises((KeyError, OSError)) as caught:
        write_half(path, error)
    assert getattr(caught.value, "filename", str(path)) == str(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
def test_a_pipe_is_written_to_as_it_is(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    check_folder(path)
    # open for both, so that neither end waits
    reader = os.open(path, os.O_RDWR)
    with whole_file(path) as part:
        part.write_text("all")
    assert os.read(reader, 10) == b"all"
    os.close(reader)
    assert list(tmp_path.iterdir()) == [path]
