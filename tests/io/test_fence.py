"""The worker process: whatever a library does to it, we go on."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

import numpy as np
import pytest

from scanfab.base.errors import ReadError
from scanfab.io import fence
from scanfab.io.fence import fenced


# what libraries do with a file; called in the worker
def read(path):
    print("chatter")
    return np.fromfile(path, "u1")


def crash(path):
    os.kill(os.getpid(), signal.SIGKILL)


def hang(path):
    time.sleep(600)


def leave(path):
    sys.exit("cannot read it")


def fill(path, count):
    return len(bytearray(count))


@pytest.fixture
def path(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"12345")
    return tmp_path / "a.bin"


def assert_read(path):
    assert fenced(read, path).tolist() == [49, 50, 51, 52, 53]


def assert_ended(function, path):
    with pytest.raises(ReadError, match=r"a\.bin: cannot be read: its library crashed, or took"):
        fenced(function, path)


def test_answers_and_errors_come_through(path):
    assert_read(path)
    with pytest.raises(ReadError, match=r"a\.bin: cannot be read: cannot read it"):
        fenced(leave, path)
    assert_read(path)


@pytest.mark.parametrize("function", [crash, hang])
def test_a_file_that_ends_the_worker_is_an_error_and_the_next_is_read(path, monkeypatch, function):
    monkeypatch.setattr(fence, "SECONDS", 0.5)
    assert_ended(function, path)
    monkeypatch.undo()
    assert_read(path)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not limit memory")
def test_memory_is_limited(path):
    assert fenced(fill, path, 1 << 20) == 1 << 20
    with pytest.raises(ReadError, match="MemoryError"):
        fenced(fill, path, 1 << 30)


def keep_memory(path, size):
    kept.append(np.ones(size // 8))
    return len(kept)


kept = []


def test_memory_that_earlier_files_left_does_not_count(path):
    counts = [fenced(keep_memory, path, int(0.4 * fence.MEMORY)) for _ in range(4)]
    assert np.diff(counts).tolist() == [1, 1, 1]


def test_threads_wait_for_each_other(path):
    found = []
    threads = [threading.Thread(target=lambda: found.append(fenced(read, path))) for _ in range(8)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(found) == 8


def test_no_file_of_the_working_folder_is_run(path, tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text(f"open({str(tmp_path / 'was run')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ReadError):
        fenced(crash, path)
    assert_read(path)
    assert not (tmp_path / "was run").exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_has_a_worker_of_its_own(path):
    assert_read(path)
    child = os.fork()
    if child == 0:
        os._exit(0 if len(fenced(read, path)) == 5 else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert_read(path)
