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
    ("compute pipe", 1, "from standard input, give - in place of its name, and --format NAME"),
    ("compute dump.txt --contacts pip*", 1, "is a pipe, expected a file"),
    ("compute dump.txt --strain pipe", 2, "or a CSV file that exists"),
    ("compute /dev/zero", 1, "error: /dev/zero: is a device, expected a file"),
    ("compute socket", 1, "error: socket: is a socket, expected a file"),
    ("compare pipe", 1, "pipe: is a pipe, expected a table: to read what a program writes"),
]


@pytest.mark.parametrize(("words", "code", "message"), NO_FILES)
def test_what_is_no_file_is_refused(folder, ask, words, code, message):
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
        assert message in ask(*words.split(), code=code).told


def test_pipes_in_a_folder_are_passed_over_and_a_link_is_what_it_leads_to(folder, ask):
    assert "frame         0" in ask("inspect", "linked_dump").out
    os.remove("linked_dump")
    assert "frame         0" in ask("inspect", ".").out


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize("line", ['"$@" <(cat t.csv)', 'cat t.csv | "$@" /dev/stdin'])
def test_what_a_shell_pipes_in_is_compared(folder, ask, line):
    ask("compute", "dump.txt", *FAST, "-o", "t.csv")
    words = ["bash", "-c", line, "bash", *PROGRAM, "compare"]
    assert subprocess.check_output(words, text=True) == ask("compare", "t.csv").out
