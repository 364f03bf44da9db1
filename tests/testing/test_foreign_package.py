"""A package of someone else's, installed: its formats work like built-in ones."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "packages" / "scanfab-mycode"
KIT = """
import sys
from pathlib import Path
from scanfab.io.reader import reader_named
from scanfab.io.writer import writer_named
from scanfab.testing import check_reader, check_writer

folder = Path(sys.argv[1])
check_reader(reader_named("mycode"), [folder / "x.mycode"], folder / "damaged", counts=True)
(folder / "written").mkdir()
check_writer(writer_named("mycode"), folder / "written")
print("all is well")
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The environment of a process that has the package."""
    target = tmp_path_factory.mktemp("site")
    command = "-m pip install --quiet --no-index --no-deps --no-build-isolation --target"
    done = subprocess.run(
        [sys.executable, *command.split(), target, PACKAGE], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(target), *sys.path])}


def run(environment, *words):
    done = subprocess.run(
        [sys.executable, *map(str, words)], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def scanfab(environment, *words):
    start = "import sys; from scanfab.cli.main import main; main(sys.argv[1:])"
    return run(environment, "-c", start, *words)


def test_it_is_listed_with_its_package(installed):
    lines = [line.split()[:4] for line in scanfab(installed, "formats").splitlines()]
    assert ["reader", "mycode", ".mycode", "scanfab-mycode"] in lines
    assert ["writer", "mycode", ".mycode", "scanfab-mycode"] in lines


def test_it_is_read_written_and_passes_the_kit(installed, tmp_path):
    (tmp_path / "x.mycode").write_text("MYCODE 2\n4 0 0 0 1\n9 1.9 0 0 1\n")
    scanfab(installed, "convert", tmp_path / "x.mycode", tmp_path / "x.vtp")
    scanfab(installed, "convert", tmp_path / "x.vtp", tmp_path / "y.mycode")
    assert (tmp_path / "y.mycode").read_text().split()[2] == "4"
    assert '"grains": 2' in scanfab(installed, "inspect", "--json", tmp_path / "y.mycode")
    assert run(installed, "-c", KIT, tmp_path) == "all is well\n"
