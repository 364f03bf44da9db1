"""The scripts of docs/cluster.md work as they stand."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.interruptions import write_series

PAGE = (Path(__file__).parents[1] / "docs" / "cluster.md").read_text(encoding="utf-8")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="scripts for bash")


def script(words: str) -> str:
    """The one block of the page that holds some words."""
    blocks = re.findall(r"```(?:bash|make)\n(.*?)```", PAGE, re.DOTALL)
    (found,) = [block for block in blocks if words in block]
    return str(found)


@pytest.fixture
def call(tmp_path):
    """Runs a command in a folder with the program on its path."""
    program = tmp_path / "bin" / "scanfab"
    program.parent.mkdir()
    program.write_text(
        f"#!{sys.executable}\nfrom scanfab.cli.main import main\nmain()\n", encoding="utf-8"
    )
    program.chmod(0o755)
    root = str(Path(__file__).parents[1])
    usual = {"PATH": f"{program.parent}:{os.environ['PATH']}", "PYTHONPATH": root}

    def call(*command: str, **variables: str) -> str:
        words = {**os.environ, **usual, **variables}
        done = subprocess.run(
            command, cwd=tmp_path, env=words, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    return call


def whole(call, folder: Path, *sources: str) -> bytes:
    call("scanfab", "compute", *sources, "--tolerance", "1e-3", "-o", "whole.csv")
    return (folder / "whole.csv").read_bytes()


def test_the_array_of_slurm(call, tmp_path):
    write_series(tmp_path / "dumps", 3)
    for task in range(4):
        variables = {
            "SLURM_ARRAY_TASK_ID": str(task),
            "SLURM_ARRAY_TASK_COUNT": "4",
            "SLURM_CPUS_PER_TASK": "1",
        }
        call("bash", "-c", script("#SBATCH --array"), **variables)
    call("bash", "-c", script("scanfab merge parts/"))
    assert (tmp_path / "fabric.csv").read_bytes() == whole(call, tmp_path, "dumps/")


def test_the_array_of_pbs(call, tmp_path):
    write_series(tmp_path / "dumps", 2)
    text = script("#PBS -J").replace("JOBS=8", "JOBS=2")
    for task in range(2):
        call("bash", "-c", text, PBS_ARRAY_INDEX=str(task), PBS_O_WORKDIR=str(tmp_path))
    call("bash", "-c", script("scanfab merge parts/"))
    assert (tmp_path / "fabric.csv").read_bytes() == whole(call, tmp_path, "dumps/")


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_the_makefile(call, tmp_path):
    (tmp_path / "tests").mkdir()
    for name in ("dense", "loose"):
        write_series(tmp_path / "tests" / name, 2)
    (tmp_path / "Makefile").write_text(script("FOLDERS"), encoding="utf-8")
    call("make", "-j", "2")
    assert (tmp_path / "fabric.csv").read_bytes() == whole(
        call, tmp_path, "tests/dense/", "tests/loose/"
    )
    assert "up to date" in call("make")
    # another dump is added to its table, and that to the one of all
    source = tmp_path / "tests" / "loose"
    text = (source / "dump_100.txt").read_text().replace("TIMESTEP\n100\n", "TIMESTEP\n200\n")
    (source / "dump_200.txt").write_text(text)
    assert "dense/" not in call("make")
    assert (tmp_path / "fabric.csv").read_bytes() == whole(
        call, tmp_path, "tests/dense/", "tests/loose/"
    )
