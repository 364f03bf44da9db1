"""The fence: what a library does to its own process ends nothing but that."""

from __future__ import annotations

import json
import os
import signal
import threading

import h5py
import numpy as np
import pytest

from scanfab.base.errors import ReadError
from scanfab.io.parse import fence
from scanfab.io.parse.fence import fenced


@pytest.fixture
def path(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(5.0)
    return tmp_path / "a.h5"


def read(path):
    arrays, _ = fenced("hdf", path, path, with_data=True)
    return arrays["x"].tolist()


def another(path):
    """The same file under another name."""
    return path.rename(path.with_name("b.h5"))


def test_arrays_come_through(path):
    assert read(path) == [0, 1, 2, 3, 4]


def test_a_process_that_died_is_told_and_replaced(path):
    read(path)
    fence._running[0].process.send_signal(signal.SIGKILL)
    with pytest.raises(ReadError, match=r"a\.h5: cannot be read: its library crashed"):
        read(path)
    assert read(another(path)) == [0, 1, 2, 3, 4]


def test_a_process_that_hangs_is_told_and_replaced(path, monkeypatch):
    read(path)
    fence._running[0].process.send_signal(signal.SIGSTOP)
    monkeypatch.setattr(fence, "SECONDS", 0.5)
    with pytest.raises(ReadError, match="took too long"):
        read(path)
    monkeypatch.undo()
    assert read(another(path)) == [0, 1, 2, 3, 4]


def test_what_was_not_survived_is_not_tried_again_at_once(path):
    read(path)
    process = fence._running[0].process
    process.send_signal(signal.SIGKILL)
    process.wait()
    for _ in range(3):
        with pytest.raises(ReadError, match=r"a\.h5: cannot be read: its library crashed"):
            read(path)
        assert not fence._running  # no process was asked
    os.utime(path, (0, 0))  # it was written anew
    assert read(path) == [0, 1, 2, 3, 4]


def test_after_a_while_it_is_tried_again(path, monkeypatch):
    read(path)
    fence._running[0].process.send_signal(signal.SIGKILL)
    with pytest.raises(ReadError, match="crashed"):
        read(path)
    monkeypatch.setattr(fence, "SECONDS_REFUSED", 0.0)
    assert read(path) == [0, 1, 2, 3, 4]
    assert not fence._deadly


@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="needs SIGALRM")
def test_a_process_that_hangs_ends_also_when_nobody_is_left_to_end_it(tmp_path):
    os.mkfifo(tmp_path / "a.h5")  # opening it waits for a writer
    process = fence._Process().process
    request = {"reader": "hdf", "path": str(tmp_path / "a.h5"), "with_data": True, "seconds": 0.1}
    process.stdin.write(json.dumps({**request, "most": 1 << 20, "own": fence.OWN}).encode() + b"\n")
    process.stdin.flush()
    assert process.wait(timeout=60) == -signal.SIGALRM
    process.stdin.close()
    process.stdout.close()


def test_threads_wait_for_each_other(path):
    found = []
    threads = [threading.Thread(target=lambda: found.append(read(path))) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert found == [[0, 1, 2, 3, 4]] * 8


def test_what_is_too_large_is_refused(path, monkeypatch):
    monkeypatch.setattr(fence, "MOST_UNPACKED", 0)
    monkeypatch.setattr(fence, "SMALL", 8)
    with pytest.raises(ReadError, match="fill more than 8 bytes"):
        read(path)


def test_no_file_of_the_working_folder_is_run(path, tmp_path, monkeypatch):
    (tmp_path / "h5py.py").write_text(f"open({str(tmp_path / 'was run')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    fence._end()
    assert read(path) == [0, 1, 2, 3, 4]
    assert not (tmp_path / "was run").exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_has_one_of_its_own(path):
    read(path)
    child = os.fork()
    if child == 0:
        os._exit(0 if read(path) == [0, 1, 2, 3, 4] else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert read(path) == [0, 1, 2, 3, 4]
