"""Where compiled kernels are kept, what users are told, and runs that can keep nothing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from scanfab.base import jit, kernel_cache
from scanfab.base.files import make_private
from tests.conftest import ROOT
from tests.helpers.dumps import cubic_rows, dump_text, write

# the contacts need a kernel, and only a small one
PROGRAM = "import sys; from scanfab.cli.main import main; main(['inspect', *sys.argv[1:]])"
SAID = "scanfab: compiling what no earlier run has needed"
NOWHERE = "/proc/none"
# prints what a small kernel gives for a type of arguments, and how often it was compiled
SMALL = """
import sys
from scanfab.base.jit import kernel

@kernel
def twice(x):
    return 2 * x

print("ready", flush=True)
input()
print(twice(eval(sys.argv[1])), sum(twice.stats.cache_misses.values()))
"""
only_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs XDG_CACHE_HOME and /proc")
only_posix = pytest.mark.skipif(os.name != "posix", reason="needs permissions")


@pytest.fixture
def dump(tmp_path):
    return write(tmp_path / "grains.dump", dump_text(cubic_rows(), box=((0, 4),) * 3))


def words_of(dump, cache_home, *, package=ROOT, **environment):
    """What a process that needs a kernel says on standard error; it must end well."""
    inherited = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    variables = {"PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(dump)],
        env={**inherited, **variables, "XDG_CACHE_HOME": str(cache_home), **environment},
        cwd=package,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def kept_in(folder):
    return sorted(Path(folder).rglob("*.nbc"))


@only_linux
def test_only_the_first_run_compiles_also_where_the_package_cannot_be_written_to(dump, tmp_path):
    ignored = shutil.ignore_patterns("__pycache__")
    package = tmp_path / "package"
    shutil.copytree(ROOT / "scanfab", package / "scanfab", ignore=ignored)
    # not even root makes a folder where a file is
    (package / "scanfab" / "packing" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    first = words_of(dump, home, package=package)
    assert first.count(SAID) == 1
    assert "; it is kept for later runs" in first
    assert len(kept_in(home)) >= 2
    assert SAID not in words_of(dump, home, package=package)
    assert kept_in(package) == []
    # another kernel means another folder: one that is called by others is compiled into them
    with open(package / "scanfab" / "packing" / "kernels.py", "a") as file:
        file.write("\n# changed\n")
    assert SAID in words_of(dump, home, package=package)


@only_linux
@pytest.mark.parametrize("given", [{}, {"NUMBA_CACHE_DIR": NOWHERE}])
def test_without_a_home_it_compiles_for_itself(dump, given):
    assert "; it cannot be kept: /proc/none" in words_of(dump, NOWHERE, HOME=NOWHERE, **given)


def test_numbas_own_variable_counts_for_kernels_alone(dump, tmp_path):
    home = tmp_path / "cache"
    words_of(dump, tmp_path / "unused", NUMBA_CACHE_DIR=str(home))
    assert kept_in(home)
    assert not (tmp_path / "unused").exists()
    # functions of other packages are kept where they were
    assert os.environ.get("NUMBA_CACHE_DIR", "") == numba.config.CACHE_DIR


@only_linux
def test_processes_that_start_cold_at_once_all_succeed(tmp_path):
    """They compile several forms of one kernel, and Numba may give these one and the same file."""
    (tmp_path / "small.py").write_text(SMALL, encoding="utf-8")
    variables = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    for cold in (True, False):
        values = ["21", "21.0", "True", "21j"] * 2 if cold else ["21", "21.0"] * 2
        processes = [
            subprocess.Popen(
                [sys.executable, "small.py", value],
                cwd=tmp_path, env=variables, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            )
            for value in values
        ]  # fmt: skip
        # each says that it is there, and waits to be answered
        assert [process.stdout.readline() for process in processes] == [b"ready\n"] * len(values)
        for process in processes:
            process.stdin.write(b"go\n")
            process.stdin.flush()
        found = [process.communicate(timeout=60)[0].split()[0].decode() for process in processes]
        assert found == [str(2 * eval(value)) for value in values]


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The folder of kernels, which is new."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    kernel_cache.kernel_folder.cache_clear()
    yield kernel_cache.kernel_folder()[0]
    kernel_cache.kernel_folder.cache_clear()


def twice(x):
    return 2 * x


def compiled_anew() -> bool:
    """Whether a new process would compile a kernel rather than find it."""
    function = jit.kernel(twice)
    assert function(21) == 42
    return bool(function.stats.cache_misses)


@pytest.mark.parametrize("damage", ["cut", "garbage", "one bit", "a folder"])
@pytest.mark.parametrize("which", ["*.nbc", "*.nbi"])
def test_what_is_damaged_is_compiled_again_and_replaced(kept, which, damage):
    assert compiled_anew()
    assert not compiled_anew()
    (file,) = kept.rglob(which)
    content = file.read_bytes()
    place = len(content) // 2
    file.unlink()
    if damage == "a folder":  # it cannot be replaced, which is no reason to stop
        file.mkdir()
        assert compiled_anew()
        return
    # one bit: of a large file, in the middle of the machine's code
    flipped = content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]
    wrong = {"cut": content[:place], "garbage": b"garbage" * 1000, "one bit": flipped}
    file.write_bytes(wrong[damage])
    assert compiled_anew()
    assert not compiled_anew()


def test_a_file_with_another_form_is_not_taken(kept):
    """Two processes that save at the same time can leave such an index."""
    function = jit.kernel(twice)
    assert (function(21), function(1.5)) == (42, 3.0)
    one, other = kept_in(kept)
    one.write_bytes(other.read_bytes())
    function = jit.kernel(twice)
    assert (function(21), function(1.5)) == (42, 3.0)
    assert not compiled_anew()


def test_a_full_disk_is_no_reason_to_stop(kept, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        assert compiled_anew()
    assert [path for path in kept.rglob("*") if path.is_file()] == []


@only_posix
@pytest.mark.parametrize("which", ["the given folder", "the folder of this version", "a stranger"])
def test_a_folder_that_others_can_write_to_is_neither_read_nor_written(kept, monkeypatch, which):
    assert compiled_anew()
    kernel_cache.kernel_folder.cache_clear()
    if which == "a stranger":
        if os.getuid() == 0:
            os.chown(kept, 1, -1)  # root's own folders are the system's
        monkeypatch.setattr(os, "getuid", lambda: 2)
    else:
        (kept if which == "the folder of this version" else kept.parent).chmod(0o777)
    found, problem = kernel_cache.kernel_folder()
    assert found is None
    assert "is not yours, or others can write to it" in problem
    assert compiled_anew()
    assert compiled_anew()


@only_posix
def test_folders_are_for_the_user_alone_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        make_private(tmp_path / "one" / "two")
    finally:
        os.umask(before)
    assert {(tmp_path / one).stat().st_mode & 0o777 for one in ("one", "one/two")} == {0o700}


def test_no_kernel_is_left_out_of_the_name_of_the_folder():
    """Else a kernel that has changed would be served as it was."""
    compiled_files = {
        path
        for path in (ROOT / "scanfab").rglob("*.py")
        if "@kernel" in path.read_text() or "@inner" in path.read_text()
    }
    assert len(compiled_files) >= 11
    assert compiled_files <= set(kernel_cache.kernel_files())


def test_commands_of_one_process_tell_only_the_latest_words(kept):
    told = []
    kernel_cache.when_compiling(lambda: told.append("one"))
    kernel_cache.when_compiling(lambda: told.append("two"))
    assert compiled_anew()
    assert jit.kernel(twice)(1.5) == 3.0
    assert told == ["two"]
