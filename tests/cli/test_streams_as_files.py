"""Pipes, devices and sockets where a file is expected: a message, and nobody waits for ever."""

import os
import shutil
import signal
import socket
import subprocess

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import FAST, PROGRAM

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes"),
    # of the alarm, where the code waits
    pytest.mark.filterwarnings("error"),
]


@pytest.fixture(autouse=True)
def impatient():
    """A test that waits fails."""

    def give_up(*_):
        raise TimeoutError("it waits")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A dump, a link to it, a folder and a pipe."""
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    write(tmp_path / "dump.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))
    os.mkfifo("pipe")
    os.mkdir("folder")
    os.symlink("dump.txt", "linked_dump")
    return tmp_path


NO_FILES = [
    ("compute pipe", 1, "pipe: is a pipe, expected a file: to read what a program writes from"),
    ("compute dump.txt --contacts pip*", 1, "is a pipe, expected a file"),
    ("compute dump.txt --strain pipe", 2, "or a CSV file that exists"),
    ("compute /dev/zero", 1, "error: /dev/zero: is a device, expected a file"),
    ("compute socket", 1, "error: socket: is a socket, expected a file"),
    ("compare pipe", 1, "pipe: is a pipe, expected a table: to read what a program writes"),
    ("compare /dev/zero", 1, "/dev/zero: is a device, expected a table"),
]


@pytest.mark.parametrize(("words", "code", "message"), NO_FILES)
def test_what_is_no_file_is_refused(folder, ask, words, code, message):
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
        assert message in ask(*words.split(), code=code).told


@pytest.mark.parametrize("source", [".", "linked_dump"])
def test_pipes_in_a_folder_are_passed_over_and_a_link_is_what_it_leads_to(folder, ask, source):
    if source == ".":
        os.remove("linked_dump")
    assert "frame         0" in ask("inspect", source).out


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_what_a_shell_pipes_in_is_compared_but_no_source(folder, ask):
    ask("compute", "dump.txt", *FAST, "-o", "table.csv")

    def bash(line: str) -> subprocess.CompletedProcess[str]:
        words = ["bash", "-c", line, "bash", *PROGRAM]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    compared = bash('"$@" compare <(cat table.csv)')
    assert compared.returncode == 0, compared.stderr
    assert bash('cat table.csv | "$@" compare /dev/stdin').stdout == compared.stdout
    refused = bash('"$@" compute <(cat dump.txt)')
    assert refused.returncode == 1
    assert "is a pipe, expected a file" in refused.stderr
    assert "give - in place of its name, and --format NAME" in refused.stderr
