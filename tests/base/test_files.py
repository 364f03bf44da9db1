"""A file is whole or untouched."""

import os

import pytest

from scanfab import SettingsError
from scanfab.base.files import check_folder, whole_file


def test_what_is_written_takes_the_place_of_the_file(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with whole_file(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def write_half(path):
    with whole_file(path) as part:
        part.write_text("half")
        raise KeyError


def test_after_an_error_the_file_is_the_old_one(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyError):
        write_half(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_was_not_written_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError) as caught, whole_file(tmp_path / "a.txt"):
        pass
    assert caught.value.filename == str(tmp_path / "a.txt")


def test_an_error_without_a_name_is_given_that_of_the_file(tmp_path):
    with pytest.raises(OSError, match="No space") as caught, whole_file(tmp_path / "a.txt"):
        raise OSError(28, "No space left on device")
    assert caught.value.filename == str(tmp_path / "a.txt")


def test_two_processes_and_the_user_have_files_of_their_own(tmp_path):
    path = tmp_path / "a.txt"
    (tmp_path / "a.part.txt").write_text("the user's")
    with whole_file(path) as one, whole_file(path) as other:
        assert one != other
        one.write_text("one")
        other.write_text("other")
    assert path.read_text() == "one"
    assert (tmp_path / "a.part.txt").read_text() == "the user's"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_name_may_be_as_long_as_the_system_lets_it(tmp_path):
    path = tmp_path / f"{'a' * 250}.txt"
    with whole_file(path) as part:
        part.write_text("new")
    assert path.read_text() == "new"


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(SettingsError, match=r"there is no folder .*nowhere to write to"):
        check_folder(tmp_path / "nowhere" / "a.txt")


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
