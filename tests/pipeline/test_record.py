"""The manifest: what a result was made of, as JSON."""

from __future__ import annotations

import hashlib
import json
import platform
from importlib.metadata import version
from pathlib import Path

import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.pipeline.record import asked_for, manifest
from scanfab.pipeline.settings import Settings
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


def test_inputs_have_their_size_and_hash(series):
    asked = asked_for([str(series)], {}, Settings())
    inputs = manifest(asked, [scanfab.read_series(series)])["inputs"]
    assert [Path(one["path"]).name for one in inputs] == [
        "dump_0.txt", "dump_1.txt", "pairs_0.txt", "pairs_1.txt",
    ]  # fmt: skip
    for one in inputs:
        data = Path(one["path"]).read_bytes()
        assert one["size"] == len(data)
        assert one["sha256"] == hashlib.sha256(data).hexdigest()


def test_versions_are_those_that_run(series):
    asked = asked_for([str(series)], {}, Settings())
    versions = manifest(asked, [])["versions"]
    assert versions["scanfab"] == version("scanfab")
    assert versions["numba"] == version("numba")
    assert versions["python"] == platform.python_version()


def test_all_settings_but_the_workers_are_named():
    asked = asked_for(["dumps"], {"radius": 0.1}, Settings(seed=7, workers=3, rv=0.6))
    assert (asked["seed"], asked["rv"], asked["radius"]) == (7, 0.6, 0.1)
    assert asked["sources"] == ["dumps"]
    assert set(Settings.__dataclass_fields__) - set(asked) == {"workers"}
    assert json.loads(json.dumps(asked)) == asked or "frames" in asked


def test_a_result_file_has_its_manifest_beside_it(series, tmp_path):
    output = tmp_path / "table.csv"
    assert run(["compute", str(series), *FAST, "--seed", "5", "-o", str(output)]) == 0
    found = json.loads(Path(f"{output}.manifest.json").read_text())
    names = ["settings", "seed", "versions", "inputs", "warnings", "notes", "frames"]
    assert list(found) == names
    assert found["frames"] == {str(series): 2}
    assert found["seed"] == found["settings"]["seed"] == 5
    assert len(found["inputs"]) == 4


def test_a_manifest_may_be_asked_for_without_a_result_file(series, tmp_path, capsys):
    path = tmp_path / "what.json"
    assert run(["compute", str(series), *FAST, "--manifest", str(path)]) == 0
    assert capsys.readouterr().out.startswith("source,")
    assert json.loads(path.read_text())["seed"] == 0


def test_a_failure_leaves_no_manifest(series, tmp_path, capsys):
    write(series / "dump_1.txt", "ITEM: TIMESTEP\n1\n")
    output = tmp_path / "table.csv"
    assert run(["compute", str(series), *FAST, "-o", str(output)]) == 1
    assert not Path(f"{output}.manifest.json").exists()
