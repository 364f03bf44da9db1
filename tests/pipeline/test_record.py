"""The manifest: what a result was made of, as JSON."""

from __future__ import annotations

import hashlib
import json
import platform
from importlib.metadata import version
from pathlib import Path

import pytest

from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "a")


@pytest.fixture
def series(tmp_path):
    folder = tmp_path / "series"
    folder.mkdir()
    for frame in (0, 1):
        write(folder / f"dump_{frame}.txt", dump_text(cubic_rows(), step=frame))
        write(folder / f"pairs_{frame}.txt", pairs_text(step=frame))
    return folder


def test_a_result_file_has_its_manifest_beside_it(series, tmp_path, capsys):
    """Or, without a result file, where it is asked for."""
    output, path = tmp_path / "table.csv", tmp_path / "what.json"
    words = ["compute", str(series), *FAST, "--seed", "5"]
    assert run([*words, "-o", str(output)]) == 0
    assert run([*words, "--manifest", str(path)]) == 0
    assert capsys.readouterr().out == output.read_text()
    found = json.loads(Path(f"{output}.manifest.json").read_text())
    assert json.loads(path.read_text()) == found
    names = ["settings", "seed", "versions", "inputs", "warnings", "notes", "frames"]
    assert list(found) == names
    assert found["frames"] == {str(series): 2}
    assert found["seed"] == found["settings"]["seed"] == 5
    assert found["versions"]["scanfab"] == version("scanfab")
    assert found["versions"]["python"] == platform.python_version()
    inputs = ["dump_0.txt", "dump_1.txt", "pairs_0.txt", "pairs_1.txt"]
    assert [Path(one["path"]).name for one in found["inputs"]] == inputs
    for one in found["inputs"]:
        data = Path(one["path"]).read_bytes()
        assert one["size"] == len(data)
        assert one["sha256"] == hashlib.sha256(data).hexdigest()
