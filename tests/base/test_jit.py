"""Where compiled kernels are kept, what users are told, and runs that can keep nothing."""

import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest

from scanfab.base import jit
from scanfab.cli.console import announce
from tests.conftest import ROOT
from tests.helpers.dumps import cubic_rows, dump_text, write

# the contacts need a kernel, and only a small one
PROGRAM = "import sys; from scanfab.cli.main import main; main(['inspect', *sys.argv[1:]])"
SAID = "scanfab: compiling for first use"
only_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs XDG_CACHE_HOME and /proc")
only_posix = pytest.mark.skipif(os.name != "posix", reason="needs permissions")


def words_of(dump, cache_home):
    """What a process that needs a kernel says on standard error; it must end well."""
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    variables.pop("NUMBA_CACHE_DIR", None)
    variables["XDG_CACHE_HOME"] = str(cache_home)
    command = [sys.executable, "-c", PROGRAM, str(dump)]
    done = subprocess.run(
        command, env=variables, cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def kept_in(folder):
    return sorted(Path(folder).rglob("*.nbc"))


@only_linux
def test_only_the_first_run_compiles(tmp_path):
    dump = write(tmp_path / "grains.dump", dump_text(cubic_rows(), box=((0, 4),) * 3))
    first = words_of(dump, tmp_path / "cache")
    assert first.count(SAID) == 1
    assert "; later runs start at once" in first
    assert len(kept_in(tmp_path / "cache")) >= 2
    assert SAID not in words_of(dump, tmp_path / "cache")
    # nothing is kept beside the package, where users often may not write
    assert kept_in(ROOT / "scanfab") == []


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The folder of kernels, which is new."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    jit.kernel_folder.cache_clear()
    yield jit.kernel_folder()[0]
    jit.kernel_folder.cache_clear()


def twice(x):
    return 2 * x


def compiled_anew() -> bool:
    """Whether a new process would compile a kernel rather than find it."""
    function = jit.kernel(twice)
    assert (function(21), function(1.5)) == (42, 3.0)
    return bool(function.stats.cache_misses)


@only_linux
@pytest.mark.usefixtures("kept")
def test_without_a_home_it_compiles_for_itself(monkeypatch, capsys):
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, "/proc/none")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    jit.kernel_folder.cache_clear()
    announce()
    assert compiled_anew()
    assert compiled_anew()
    assert "; it cannot be kept: /proc/none" in capsys.readouterr().err


def test_what_was_compiled_of_other_sources_is_not_taken(kept, tmp_path, monkeypatch):
    assert compiled_anew()
    assert not compiled_anew()
    source = write(tmp_path / "kernels.py", "# changed\n")
    monkeypatch.setattr(jit, "kernel_files", lambda: [source])
    jit.kernel_folder.cache_clear()
    assert compiled_anew()


@pytest.mark.parametrize("damage", ["cut", "empty", "garbage", "one bit", "another form"])
def test_what_is_damaged_is_compiled_again_and_replaced(kept, damage):
    assert compiled_anew()
    assert not compiled_anew()
    file, other = kept_in(kept)
    content = file.read_bytes()
    damaged = {
        "cut": content[: len(content) // 2],
        "empty": b"",
        "garbage": b"garbage" * 1000,
        "one bit": content[:-1] + bytes([content[-1] ^ 1]),
        "another form": other.read_bytes(),
    }
    file.write_bytes(damaged[damage])
    assert compiled_anew()
    assert not compiled_anew()


def test_a_full_disk_is_no_reason_to_stop(kept, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", Mock(side_effect=OSError(28, "No space left on device")))
        assert compiled_anew()
    assert list(kept.iterdir()) == []
    # nor is a folder where the file should be
    assert compiled_anew()
    file = kept_in(kept)[0]
    file.unlink()
    file.mkdir()
    assert compiled_anew()


@only_posix
@pytest.mark.parametrize("which", ["open to all", "a stranger's"])
def test_a_folder_that_others_can_write_to_is_neither_read_nor_written(kept, monkeypatch, which):
    assert kept.stat().st_mode & 0o777 == 0o700
    assert compiled_anew()
    jit.kernel_folder.cache_clear()
    if which == "open to all":
        kept.chmod(0o777)
    else:
        if os.getuid() == 0:
            os.chown(kept, 1, -1)  # root's own folders are the system's
        monkeypatch.setattr(os, "getuid", lambda: 2)
    found, problem = jit.kernel_folder()
    assert found is None
    assert "is not yours, or others can write to it" in problem
    assert compiled_anew()
    assert compiled_anew()


@only_linux
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root may write all")
def test_a_folder_that_is_read_only_is_read(kept):
    assert compiled_anew()
    kept.chmod(0o500)
    assert not compiled_anew()
    assert jit.kernel(twice)(1j) == 2j
    assert len(kept_in(kept)) == 2
    kept.chmod(0o700)


def test_no_kernel_is_left_out_of_the_name_of_the_folder():
    """Else a kernel that has changed would be served as it was."""
    texts = {path: path.read_text() for path in (ROOT / "scanfab").rglob("*.py")}
    compiled = {path for path, text in texts.items() if "@kernel" in text or "@inner" in text}
    assert {path.name for path in compiled} >= {"search.py", "axes.py"}
    assert compiled <= set(jit.kernel_files())


def test_commands_of_one_process_tell_only_the_latest_words_and_once(kept):
    told = []
    jit.when_compiling(lambda: told.append("one"))
    jit.when_compiling(lambda: told.append("two"))
    assert compiled_anew()
    assert told == ["two"]
