"""Files that cannot be written to their end: a message that names the file, and nothing is lost."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.io.writer import installed_writers
from scanfab.testing import made_up_packings
from tests.helpers.interruptions import PROGRAM

resource = pytest.importorskip("resource", reason="limits of a process are POSIX")
FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac"]


@pytest.fixture
def compute(series, tmp_path, monkeypatch):
    """The exit code of a run in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: run(["compute", str(series), *FAST, *words])


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Files of this process cannot grow beyond so many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--vtk", "view"], "view/grains_000000.vtp"),
        (["--plot", "figure.png"], "figure.png"),
        # its writer fails with an error of another kind when what it began cannot be ended
        (["--plot", "figure.pdf"], "figure.pdf"),
        (["--manifest", "manifest.json"], "manifest.json"),
    ],
)
def test_one_message_names_the_file(compute, capsys, tmp_path, words, named):
    with files_up_to(1_000):
        assert compute(*words) == 1
    told = capsys.readouterr().err
    assert told.splitlines()[-1] == f"scanfab: error: {named}: File too large"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("name", ["table.csv", "table.json", "table.parquet"])
def test_the_rows_that_fitted_are_gone_on_with(compute, capsys, tmp_path, name):
    assert compute("-o", name) == 0
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_text("precious")
    with files_up_to(15_000):
        assert compute("-o", name) == 1
    assert f"error: {name}.part: File too large" in capsys.readouterr().err
    assert (tmp_path / name).read_text() == "precious"
    assert compute("-o", name, "--resume") == 0
    assert (tmp_path / name).read_bytes() == whole


@pytest.mark.parametrize("name", installed_writers())
def test_a_conversion_that_does_not_fit_changes_nothing(capsys, tmp_path, name):
    packing = made_up_packings()["everything"]
    source, files = tmp_path / "source.npz", tmp_path / name
    scanfab.convert(packing, source)
    files.mkdir()
    out = files / f"a{installed_writers()[name].plugin.extensions[0]}"
    assert run(["convert", str(source), str(out), "--to", name]) == 0
    sizes = {file: file.stat().st_size for file in files.iterdir()}
    before = {file: file.read_bytes() for file in files.iterdir()}
    capsys.readouterr()
    # the largest file does not fit, be it that of the grains or a companion
    with files_up_to(max(sizes.values()) - 1):
        assert run(["convert", str(source), str(out), "--to", name]) == 1
    named = max(sizes, key=sizes.get)
    assert f"scanfab: error: {named}: File too large" in capsys.readouterr().err
    assert {file: file.read_bytes() for file in files.iterdir()} == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_a_full_standard_output_is_named(series):
    with open("/dev/full", "w") as full:
        words = [*PROGRAM, "inspect", str(series), "--frames", "0"]
        answer = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert answer.returncode == 1
    assert answer.stderr == "scanfab: error: standard output: No space left on device\n"
