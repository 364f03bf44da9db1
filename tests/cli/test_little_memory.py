"""Little memory: one message, exit code 1, no traceback."""

import subprocess
import sys
from functools import partial
from unittest.mock import Mock

import pytest

from scanfab.base import files
from scanfab.cli import group, main
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM

resource = pytest.importorskip("resource", reason="limits of a process are POSIX")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the size is read from /proc")
@pytest.mark.parametrize(("command", "megabytes"), [("compute", 1200), ("inspect", 400)])
def test_a_limit_that_nothing_can_be_done_with_is_told_at_once(tmp_path, command, megabytes):
    words = [*PROGRAM, command, str(write(tmp_path / "dump", dump_text(cubic_rows())))]
    limit = partial(resource.setrlimit, resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))
    answer = subprocess.run(words, capture_output=True, text=True, check=False, preexec_fn=limit)
    assert answer.returncode == 1, answer.stderr
    assert answer.stderr.startswith("scanfab: error: not enough memory: the limit (ulimit -v) ")
    assert len(answer.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("error", "left"),
    [
        (MemoryError("Allocation failed (probably too large)."), None),
        (RuntimeError("can't start new thread"), None),
        (ImportError("libvtkCommonCore.so: failed to map segment from shared object"), None),
        (NameError("name 'PyLazyFrame' is not defined"), 1_000_000),
    ],
)
def test_what_fails_for_lack_of_memory_is_one_message(monkeypatch, capsys, error, left):
    monkeypatch.setattr(group.cli, "main", Mock(side_effect=error))
    if left is not None:
        with pytest.raises(NameError):  # a mistake of ours is not hidden
            main.run(["compute"])
        monkeypatch.setattr(files, "address_space", lambda: left)
    assert main.run(["compute"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("scanfab: error: not enough memory (")
    assert "fewer --workers need less" in told


def test_what_is_free_is_the_least_of_all_limits(monkeypatch, tmp_path):
    assert files.free_memory() > 0
    monkeypatch.setattr(files, "address_space", lambda: 1000)
    assert files.free_memory() == 1000
    container = tmp_path / "memory.max"
    monkeypatch.setattr(files, "CONTAINER", container)
    for text, free in (("900\n", 900), ("max\n", 1000)):
        container.write_text(text)
        assert files.free_memory() == free
    assert group.LEAST_SPACE > main.LITTLE
