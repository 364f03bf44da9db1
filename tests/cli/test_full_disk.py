"""A full disk, or little memory: one message, exit code 1, no traceback, and nothing is lost."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pytest

import scanfab
from scanfab.base import files
from scanfab.cli import group, main
from scanfab.cli.main import run
from scanfab.io.writer import installed_writers
from scanfab.testing import made_up_packings
from tests.helpers.interruptions import FAST, PROGRAM

resource = pytest.importorskip("resource", reason="limits of a process are POSIX")


@pytest.fixture
def compute(series, tmp_path, monkeypatch):
    """The exit code of a run in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: run(["compute", str(series), *FAST, *words])


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Files of this process cannot grow beyond so many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Python would keep the code of a module that is imported meanwhile, cut off
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "dont_write_bytecode", True)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)


TOO_LARGE = [
    (["--vtk", "view"], "view/grains_000000.vtp"),
    (["--plot", "figure.png"], "figure.png"),
    # its writer fails with an error of another kind when what it began cannot be ended
    (["--plot", "figure.pdf"], "figure.pdf"),
    (["--manifest", "manifest.json"], "manifest.json"),
]


@pytest.mark.parametrize(("words", "named"), TOO_LARGE)
def test_one_message_names_the_file(compute, capsys, tmp_path, words, named):
    with files_up_to(1_000):
        assert compute(*words) == 1
    told = capsys.readouterr().err
    assert told.splitlines()[-1] == f"scanfab: error: {named}: File too large"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_the_rows_that_fitted_are_gone_on_with(compute, capsys):
    table = Path("table.csv")
    assert compute("-o", "whole.csv") == 0
    table.write_text("precious")
    with files_up_to(15_000):
        assert compute("-o", "table.csv") == 1
    told = "the same command with --resume goes on\nscanfab: error: table.csv.part: File too large"
    assert told in capsys.readouterr().err
    assert table.read_text() == "precious"
    assert compute("-o", "table.csv", "--resume") == 0
    assert table.read_bytes() == Path("whole.csv").read_bytes()


@pytest.mark.parametrize("name", installed_writers())
def test_a_conversion_that_does_not_fit_changes_nothing(capsys, tmp_path, name):
    packing = made_up_packings()["everything"]
    source, folder = tmp_path / "source.npz", tmp_path / name
    scanfab.convert(packing, source)
    folder.mkdir()
    out = folder / f"a{installed_writers()[name].plugin.extensions[0]}"
    assert run(["convert", str(source), str(out), "--to", name]) == 0
    before = {file: file.read_bytes() for file in folder.iterdir()}
    # the largest file does not fit, be it that of the grains or a companion
    named = max(before, key=lambda file: len(before[file]))
    with files_up_to(len(before[named]) - 1):
        assert run(["convert", str(source), str(out), "--to", name]) == 1
    assert f"scanfab: error: {named}: File too large" in capsys.readouterr().err
    assert {file: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_a_full_standard_output_is_named(series):
    with open("/dev/full", "w") as full:
        words = [*PROGRAM, "inspect", str(series), "--frames", "0"]
        answer = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert answer.returncode == 1
    assert answer.stderr == "scanfab: error: standard output: No space left on device\n"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the size is read from /proc")
def test_a_limit_that_nothing_can_be_done_with_is_told_at_once(series):
    words = [*PROGRAM, "compute", str(series)]
    limit = partial(resource.setrlimit, resource.RLIMIT_AS, (400 << 20, 400 << 20))
    answer = subprocess.run(words, capture_output=True, text=True, check=False, preexec_fn=limit)
    assert answer.returncode == 1, answer.stderr
    assert answer.stderr.startswith("scanfab: error: not enough memory: the limit (ulimit -v) ")
    assert len(answer.stderr.splitlines()) == 1


LACKS = [
    (MemoryError("Allocation failed (probably too large)."), None),
    (RuntimeError("can't start new thread"), None),
    (ImportError("libvtkCommonCore.so: failed to map segment from shared object"), None),
    (NameError("name 'PyLazyFrame' is not defined"), 1_000_000),
]


@pytest.mark.parametrize(("error", "left"), LACKS)
def test_what_fails_for_lack_of_memory_is_one_message(monkeypatch, capsys, error, left):
    monkeypatch.setattr(group.cli, "main", Mock(side_effect=error))
    if left is not None:
        with pytest.raises(NameError):  # a mistake of ours is not hidden
            main.run(["compute"])
        monkeypatch.setattr(files, "address_space", lambda: left)
    assert main.run(["compute"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("scanfab: error: not enough memory (")
    assert "fewer --workers need less" in told
