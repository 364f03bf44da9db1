"""The worker process: whatever a library does to it, we go on."""

import os
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from scanfab.base.errors import ReadError
from scanfab.io import fence
from scanfab.io.fence import fenced

kept = []


# what libraries do with a file; called in the worker
def read(path):
    print("chatter")
    return np.fromfile(path, "u1").tolist()


def crash(path):
    os.kill(os.getpid(), signal.SIGKILL)


def hang(path):
    time.sleep(600)


def leave(path):
    sys.exit("cannot read it")


def fill(path, count):
    kept.append(np.ones(count // 8))
    return len(kept)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"12")
    return tmp_path / "a.bin"


ENDS = [(leave, "cannot read it"), (crash, "its library crashed, or took"), (hang, "its library")]


@pytest.mark.parametrize(("end", "told"), ENDS)
def test_a_file_that_ends_the_worker_is_an_error_and_the_next_is_read(path, monkeypatch, end, told):
    assert fenced(read, path) == [49, 50]
    monkeypatch.setattr(fence, "SECONDS", 0.5)
    with pytest.raises(ReadError, match=rf"a\.bin: cannot be read: {told}"):
        fenced(end, path)
    monkeypatch.undo()
    assert fenced(read, path) == [49, 50]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not limit memory")
def test_memory_is_limited_but_what_earlier_files_left_does_not_count(path, monkeypatch):
    monkeypatch.setattr(fence, "MEMORY", 150e6)
    counts = [fenced(fill, path, int(0.4 * fence.MEMORY)) for _ in range(4)]
    assert np.diff(counts).tolist() == [1, 1, 1]
    with pytest.raises(ReadError, match="Unable to allocate"):
        fenced(fill, path, 1 << 30)


def test_threads_wait_for_each_other(path):
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(fenced, [read] * 8, [path] * 8)) == [[49, 50]] * 8


def test_no_file_of_the_working_folder_is_run(path, tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text(f"open({str(tmp_path / 'was run')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ReadError):
        fenced(crash, path)
    assert fenced(read, path) == [49, 50]
    assert not (tmp_path / "was run").exists()
