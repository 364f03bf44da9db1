"""The scripts of docs/howto/many-folders.md work as they stand."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from scanfab.cli.main import run
from tests.helpers.interruptions import write_series

PAGE = (Path(__file__).parents[1] / "docs" / "howto" / "many-folders.md").read_text("utf-8")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="scripts for bash")


def script(words: str) -> str:
    """The one block of the page that holds some words."""
    blocks = re.findall(r"```(?:bash|make|sh)\n(.*?)```", PAGE, re.DOTALL)
    (found,) = [block for block in blocks if words in block]
    return str(found)


@pytest.fixture
def call(tmp_path):
    """Runs a command to its end in a folder, with the program on its path and more variables."""
    program = tmp_path / "bin" / "scanfab"
    program.parent.mkdir()
    program.write_text(f"#!{sys.executable}\nfrom scanfab.cli.main import main\nmain()\n")
    program.chmod(0o755)
    path = f"{program.parent}:{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(Path(__file__).parents[1])}

    def call(*command: str, **more: str) -> str:
        done = subprocess.run(
            command, cwd=tmp_path, env={**environment, **more}, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout
        return done.stdout

    return call


@pytest.fixture
def whole(tmp_path, monkeypatch):
    """The table of some sources by one run, in this process."""
    monkeypatch.chdir(tmp_path)

    def whole(*sources: str) -> bytes:
        assert run(["compute", *sources, "--tolerance", "1e-3", "-o", "whole.csv"]) == 0
        return (tmp_path / "whole.csv").read_bytes()

    return whole


@pytest.fixture
def folders(tmp_path):
    """The folders of two tests, with a series in each."""
    for name in ("dense", "loose"):
        (tmp_path / "tests").mkdir(exist_ok=True)
        write_series(tmp_path / "tests" / name, 2)
    return tmp_path / "tests"


def test_the_array_of_slurm(call, whole, folders):
    """A task computes the folder of its index."""
    command = "bash", "-c", script("folders=(tests").replace("--boundary type=2 ", "")
    for task in range(2):
        call(*command, SLURM_CPUS_PER_TASK="1", SLURM_ARRAY_TASK_ID=str(task))
    call("bash", "-c", script("scanfab merge tests/"))
    table = folders.parent / "fabric.csv"
    assert table.read_bytes() == whole("tests/dense", "tests/loose")


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_the_makefile(call, whole, folders, tmp_path):
    """Run to its end; and again when there is another dump."""
    (tmp_path / "Makefile").write_text(script("FOLDERS"), encoding="utf-8")
    call("make", "-j", "2")
    assert (tmp_path / "fabric.csv").read_bytes() == whole("tests/dense/", "tests/loose/")
    assert "up to date" in call("make")
    # another dump is added to its table, and that to the one of all
    source = folders / "loose"
    text = (source / "dump_100.txt").read_text().replace("TIMESTEP\n100\n", "TIMESTEP\n200\n")
    (source / "dump_200.txt").write_text(text)
    assert "dense/" not in call("make")
    assert (tmp_path / "fabric.csv").read_bytes() == whole("tests/dense/", "tests/loose/")
