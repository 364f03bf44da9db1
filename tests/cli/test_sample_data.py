"""The samples that `scanfab sample-data` copies: from a checkout, and from a wheel."""

import compileall
import os
import subprocess
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import pytest

import scanfab
from tests.helpers.truth import SAMPLE_DATA

ROOT = SAMPLE_DATA.parent
sys.path.append(str(ROOT / "docs" / "make"))
figures = import_module("figures")


def files_in(folder: Path) -> dict[str, bytes]:
    """The content of each file below a folder by its name in there."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel of this checkout."""
    for name in ("hatchling", "hatch_vcs"):
        pytest.importorskip(name, reason=f"{name} is not installed, which builds the wheel")
    folder = tmp_path_factory.mktemp("wheel")
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(words, cwd=ROOT, check=True)
    return zipfile.ZipFile(*folder.glob("*.whl"))


def test_a_wheel_holds_the_package_and_the_samples_of_the_examples(wheel: zipfile.ZipFile) -> None:
    shipped = {path.relative_to(SAMPLE_DATA).as_posix(): path for path in figures.shipped_samples()}
    assert sum(path.stat().st_size for path in shipped.values()) <= 3_000_000
    names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    samples = {name for name in names if name.startswith("scanfab/_samples/")}
    assert samples == {f"scanfab/_samples/{name}" for name in shipped}
    package = {name for name in files_in(ROOT / "scanfab") if "__pycache__" not in name}
    assert names - samples == {f"scanfab/{name}" for name in package}


def test_an_installed_wheel_copies_its_samples(wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    wheel.extractall(tmp_path / "site")
    compileall.compile_dir(tmp_path / "site" / "scanfab" / "_samples", quiet=1)  # as pip does
    run = "import scanfab; from scanfab.cli.main import main; print(scanfab.__file__); main()"
    words = [sys.executable, "-c", run, "sample-data", "sample_data"]
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    out = subprocess.check_output(words, cwd=tmp_path, text=True, env=env)
    assert out.startswith(str(tmp_path / "site"))
    shipped = {str(path.relative_to(SAMPLE_DATA)) for path in figures.shipped_samples()}
    copied, own = files_in(tmp_path / "sample_data"), files_in(SAMPLE_DATA)
    assert copied == {name: data for name, data in own.items() if name in shipped}


def test_a_checkout_copies_all_its_samples(ask, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for name in ("new", "empty"):
        answer = ask("sample-data", tmp_path / name)
        assert answer.out == ""
        assert f"try scanfab compute {tmp_path / name}/yade_triaxial --boundary" in answer.told
    assert files_in(tmp_path / "new") == files_in(tmp_path / "empty") == files_in(SAMPLE_DATA)
    assert ask("sample-data", tmp_path / "quiet", "--quiet").err == ""


def test_a_place_that_holds_something_is_refused_and_kept(ask, tmp_path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    for place in (tmp_path, tmp_path / "mine.txt"):
        told = ask("sample-data", place, code=2).told
        assert told.endswith(f"{place}: holds something already: name a new or an empty folder")
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1


def test_an_installation_without_samples_says_so(ask, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(scanfab, "__file__", str(tmp_path / "scanfab" / "__init__.py"))
    told = ask("sample-data", tmp_path / "new", code=1).told
    assert told.endswith("the samples are missing: install scanfab again")
