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
def call(tmp_path, monkeypatch):
    """Runs a command to its end in a folder, with the program on its path and more variables."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")

    def call(command: str, **more: str) -> str:
        done = subprocess.run(
            ["bash", "-c", command], env={**os.environ, **more}, text=True, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout
        return done.stdout

    return call


def whole(*sources: str) -> bytes:
    """The table of some sources by one run, in this process."""
    assert run(["compute", *sources, "--tolerance", "1e-3", "-o", "whole.csv"]) == 0
    return Path("whole.csv").read_bytes()


@pytest.fixture
def folders(tmp_path):
    """The folders of two tests, with a series in each."""
    (tmp_path / "tests").mkdir()
    for name in ("dense", "loose"):
        write_series(tmp_path / "tests" / name, 2)
    return tmp_path / "tests"


@pytest.mark.usefixtures("folders")
def test_the_array_of_slurm(call):
    """A task computes the folder of its index."""
    command = script("folders=(tests").replace("--boundary type=2 ", "")
    for task in "01":
        call(command, SLURM_CPUS_PER_TASK="1", SLURM_ARRAY_TASK_ID=task)
    call(script("scanfab merge tests/"))
    assert Path("fabric.csv").read_bytes() == whole("tests/dense", "tests/loose")


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_the_makefile(call, folders):
    """Run to its end; and again when there is another dump."""
    Path("Makefile").write_text(script("FOLDERS"), encoding="utf-8")
    call("make -j 2")
    assert Path("fabric.csv").read_bytes() == whole("tests/dense/", "tests/loose/")
    assert "up to date" in call("make")
    # another dump is added to its table, and that to the one of all
    source = folders / "loose"
    text = (source / "dump_100.txt").read_text().replace("TIMESTEP\n100\n", "TIMESTEP\n200\n")
    (source / "dump_200.txt").write_text(text)
    assert "dense/" not in call("make")
    assert Path("fabric.csv").read_bytes() == whole("tests/dense/", "tests/loose/")
