"""A package of someone else's, installed: its formats work like built-in ones."""

import os
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "packages" / "scanfab-mycode"
USE = """
from pathlib import Path
from scanfab.cli.main import run
from scanfab.io.reader import reader_named
from scanfab.io.writer import writer_named
from scanfab.testing import check_reader, check_writer

Path("x.mycode").write_text("MYCODE 2\\n4 0 0 0 1\\n9 1.9 0 0 1\\n")
assert run(["formats"]) == 0
assert run(["convert", "x.mycode", "x.vtp"]) == 0
assert run(["convert", "x.vtp", "y.mycode"]) == 0
assert Path("y.mycode").read_text().split()[2] == "4"
assert run(["inspect", "--json", "y.mycode"]) == 0
check_reader(reader_named("mycode"), [Path("x.mycode")], Path("damaged"), counts=True)
Path("written").mkdir()
check_writer(writer_named("mycode"), Path("written"))
"""


def ended(*words: object, **options: object) -> str:
    """What a process of this Python prints, which must end well."""
    words = (sys.executable, *map(str, words))
    done = subprocess.run(words, capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_is_listed_read_written_and_passes_the_kit(tmp_path):
    command = "-m pip install --quiet --no-index --no-deps --no-build-isolation --target"
    ended(*command.split(), tmp_path / "site", PACKAGE)
    paths = os.pathsep.join([str(tmp_path / "site"), *sys.path])
    said = ended("-c", USE, cwd=tmp_path, env={**os.environ, "PYTHONPATH": paths})
    lines = [line.split()[:4] for line in said.splitlines()]
    assert ["reader", "mycode", ".mycode", "scanfab-mycode"] in lines
    assert ["writer", "mycode", ".mycode", "scanfab-mycode"] in lines
    assert '"grains": 2' in said
