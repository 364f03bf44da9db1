"""Little memory: one message, exit code 1, no traceback."""

from __future__ import annotations

import subprocess
import sys

import pytest

from scanfab.base import files
from scanfab.cli import group, main
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM

resource = pytest.importorskip("resource", reason="limits of a process are POSIX")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the size is read from /proc")
@pytest.mark.parametrize(
    ("words", "megabytes"),
    [
        (["compute"], 400),
        (["compute", "--workers", "4"], 1200),
        (["inspect"], 400),
        (["calibrate"], 400),
        (["view", "--screenshot", "picture.png"], 1500),
    ],
)
def test_a_limit_that_nothing_can_be_done_with_is_told_at_once(tmp_path, words, megabytes):
    dump = write(tmp_path / "dump", dump_text(cubic_rows()))
    most = megabytes << 20
    answer = subprocess.run(
        [*PROGRAM, *words, str(dump)],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (most, most)),
    )
    assert answer.returncode == 1, answer.stderr
    assert answer.stderr.startswith("scanfab: error: not enough memory: the limit (ulimit -v) ")
    assert len(answer.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        MemoryError("Allocation failed (probably too large)."),
        RuntimeError("can't start new thread"),
        ImportError("libvtkCommonCore.so: failed to map segment from shared object"),
    ],
)
def test_what_fails_for_lack_of_memory_is_one_message(monkeypatch, capsys, error):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(group.cli, "main", fail)
    assert main.run(["compute"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("scanfab: error: not enough memory (")
    assert "fewer --workers need less" in told


def test_where_next_to_nothing_is_left_any_failure_is_one_of_memory(monkeypatch, capsys):
    def fail(*_, **__):
        raise NameError("name 'PyLazyFrame' is not defined")

    monkeypatch.setattr(group.cli, "main", fail)
    with pytest.raises(NameError):  # a mistake of ours is not hidden
        main.run(["compute"])
    monkeypatch.setattr(files, "address_space", lambda: 1_000_000)
    assert main.run(["compute"]) == 1
    assert "not enough memory (name 'PyLazyFrame'" in capsys.readouterr().err


def test_what_is_free_is_the_least_of_all_limits(monkeypatch, tmp_path):
    assert files.free_memory() > 0
    monkeypatch.setattr(files, "address_space", lambda: 1000)
    assert files.free_memory() == 1000
    container = tmp_path / "memory.max"
    monkeypatch.setattr(files, "CONTAINER", container)
    container.write_text("900\n")
    assert files.free_memory() == 900
    container.write_text("max\n")
    assert files.free_memory() == 1000
    assert group.LEAST_SPACE > main.LITTLE
