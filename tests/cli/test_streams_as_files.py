"""Pipes, devices and sockets where a file is expected: a message, and nobody waits for ever."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes"),
    # of the alarm, where the code waits
    pytest.mark.filterwarnings("error"),
]
FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin"]
PIPE = "pipe: is a pipe, expected a file: what a program writes is read from standard input"


@pytest.fixture(autouse=True)
def impatient():
    """A test that waits fails."""
    import signal

    def give_up(*_):
        raise TimeoutError("it waits")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    return path


@pytest.fixture
def dump(tmp_path):
    return write(tmp_path / "dump.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))


@pytest.mark.parametrize("command", ["compute", "inspect", "calibrate", "view"])
def test_a_pipe_is_no_source(pipe, capsys, command):
    assert run([command, str(pipe)]) == 1
    assert PIPE in capsys.readouterr().err


def test_nor_is_a_device_or_a_socket(capsys, tmp_path, monkeypatch):
    assert run(["compute", "/dev/zero"]) == 1
    assert "error: /dev/zero: is a device, expected a file" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
        assert run(["compute", "socket"]) == 1
    assert "error: socket: is a socket, expected a file" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["pipe", "pip*"])
def test_a_pipe_is_no_list_of_contacts(dump, pipe, capsys, name):
    assert run(["compute", str(dump), "--contacts", str(pipe.with_name(name))]) == 1
    assert PIPE in capsys.readouterr().err


def test_a_pipe_is_no_list_of_strains(dump, pipe, capsys):
    assert run(["compute", str(dump), "--strain", str(pipe)]) == 2
    assert "or a CSV file that exists" in capsys.readouterr().err


def test_pipes_and_folders_in_a_folder_are_passed_over(dump, pipe, capsys):
    (pipe.parent / "folder").mkdir()
    os.symlink(pipe, pipe.parent / "linked.txt")
    assert run(["inspect", str(pipe.parent)]) == 0
    assert "frame 0" in capsys.readouterr().out


def test_a_linked_dump_is_a_file(dump, tmp_path, capsys):
    os.symlink(dump, tmp_path / "linked.txt")
    assert run(["inspect", str(tmp_path / "linked.txt")]) == 0
    assert "frame 0" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["compare"], ["report", "-o", "report.html"]])
def test_a_pipe_is_no_table(pipe, capsys, words):
    assert run([*words, str(pipe)]) == 1
    assert "pipe: is a pipe, expected a table: what a program writes" in capsys.readouterr().err
    assert run([*words, "/dev/zero"]) == 1
    assert "/dev/zero: is a device, expected a table" in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_what_a_shell_pipes_in_is_compared_but_no_source(dump, tmp_path):
    assert run(["compute", str(dump), *FAST, "-o", str(tmp_path / "table.csv")]) == 0

    def bash(line: str) -> subprocess.CompletedProcess[str]:
        words = ["bash", "-c", line, "bash", *PROGRAM]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)

    compared = bash('"$@" compare <(cat table.csv)')
    assert compared.returncode == 0, compared.stderr
    assert bash('cat table.csv | "$@" compare /dev/stdin').stdout == compared.stdout
    refused = bash('"$@" compute <(cat dump.txt)')
    assert refused.returncode == 1
    assert "is a pipe, expected a file" in refused.stderr
    assert "by - in place of its name and --format NAME" in refused.stderr


def test_the_library_says_the_same(pipe):
    import scanfab

    with pytest.raises(scanfab.ReadError, match="is a pipe, expected a file"):
        scanfab.read(Path(pipe))
