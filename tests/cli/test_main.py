"""The command line as a process: help, version, exit codes, streams, and signals at any moment."""

import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from scanfab.base.errors import ReadError
from scanfab.cli import group, main
from tests.helpers.interruptions import FAST, PROGRAM

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")


def test_version_is_the_package_s(ask) -> None:
    assert ask("--version").out == f"scanfab {version('scanfab')}\n"


HEAVY = "numpy numba scipy pyvista meshio rich matplotlib jinja2 polars vtkmodules PIL"
FIRST = "click numpy typing re contextlib importlib"
IMPORTS = [
    ((), "from scanfab.cli.main import run; run(['--help']); run(['--version'])", HEAVY),
    # the process hears signals before anything large is imported
    (("-S",), "import scanfab.cli.main", FIRST),
]


@pytest.mark.parametrize(("words", "code", "unwanted"), IMPORTS)
def test_what_is_not_imported_before_it_is_needed(words, code, unwanted) -> None:
    code = f"import sys; before = set(sys.modules); {code}; left = set(sys.modules) - before"
    code += f"; sys.exit(' '.join(left & set('{unwanted}'.split())) or 0)"
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    answer = subprocess.run([sys.executable, *words, "-c", code], env=env, capture_output=True)
    assert answer.returncode == 0, answer.stderr


def test_help_lists_every_command(ask) -> None:
    shown = ask("--help").out
    assert all(f"\n  {command} " in shown for command in group.COMMANDS)


def test_debug_shows_why(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="the folder holds no files"):
        main.run(["compute", str(tmp_path), "--debug"])


def test_a_closed_pipe_ends_quietly(series) -> None:
    command = [*PROGRAM, "compute", str(series), *FAST, "--variants", "a"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        process.stdout.readline()
        process.stdout.close()
        errors = process.stderr.read()
    # Python shows a warning by the line of code that raises it
    assert not re.search(r"Traceback|Broken|\.py:", errors)


DEAF = """
from scanfab.cli.signals import tell_if_ended

class Deaf:
    def __del__(self):
        os.kill(os.getpid(), signal.SENT)
        time.sleep(0.1)

def run(args):
    tell_if_ended(lambda: "after 4 of 5 frames")
    Deaf()
    try:
        os.kill(os.getpid(), signal.SENT)
        time.sleep(0.1)
    except BaseException:
        pass
    sys.exit("it went on")
"""
ENDED = [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")]


def ended(tmp_path: Path, text: str) -> subprocess.CompletedProcess[str]:
    """A process whose command line is this function ``run(args)``."""
    program = f"import os, signal, sys, time\nfrom scanfab.cli import main\n{text}"
    words = [sys.executable, "-c", f"{program}\nmain.run = run\nmain.main([])"]
    return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)


@posix
@pytest.mark.parametrize(("sent", "code", "word"), ENDED)
def test_a_signal_ends_the_process_at_once(tmp_path, sent, code, word):
    """
    Code that swallows exceptions cannot hold it back.

    The compiler's callbacks do so, Python itself where an object is deleted; some extension
    modules crash where an exception comes while they are imported.
    """
    answer = ended(tmp_path, DEAF.replace("SENT", sent))
    assert answer.returncode == code
    assert answer.stderr == f"scanfab: {word} after 4 of 5 frames\n"


PARTS = """
from pathlib import Path
from scanfab.table.columns import COLUMNS
from scanfab.table.row import Row
from scanfab.base.files import whole_file
from scanfab.pipeline.record import PartFile

def run(args):
    part = PartFile(Path("table.csv"))
    with part.alone():
        part.begin({})
        for _ in range(ROWS):
            part.add([], [Row(**dict.fromkeys(COLUMNS))])
        with whole_file(Path("figure.png")) as part:
            part.write_text("half")
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(10)
"""


@posix
@pytest.mark.parametrize(("rows", "left"), [(0, set()), (1, {"table.csv.part"})])
def test_a_part_without_rows_and_half_a_file_are_removed(tmp_path, rows, left):
    answer = ended(tmp_path, PARTS.replace("ROWS", str(rows)))
    assert answer.returncode == 143, answer.stderr
    assert {path.name for path in tmp_path.iterdir()} == left
