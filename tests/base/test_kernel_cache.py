"""Where compiled kernels are kept, what users are told, and runs that can keep nothing."""

from __future__ import annotations

import gc
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import scanfab.scan.kernels.sweep
from scanfab.base import ending, kept_files
from scanfab.base import jit as compiled
from scanfab.base import kernel_cache as cache
from scanfab.base import kernel_folder as folder
from tests.helpers.dumps import cubic_rows, dump_text, write

ROOT = Path(__file__).parents[2]
# the contacts need a kernel, and only a small one
PROGRAM = [
    sys.executable,
    "-c",
    "import sys; from scanfab.cli.main import main; main(['inspect', *sys.argv[1:]])",
]
SAID = "scanfab: compiling what no earlier run has needed"
NOWHERE = "/proc/none"
# prints what a small kernel gives, and how often it was compiled; others write while it does
SMALL = """
import os, time
from scanfab.base.jit import kernel

replace = os.replace
os.replace = lambda *paths: (time.sleep(0.5), replace(*paths))

def twice(x):
    return 2 * x

compiled = kernel(twice)
print("ready", flush=True)
input()
print(compiled(21), sum(compiled.stats.cache_misses.values()))
"""


@pytest.fixture
def dump(tmp_path):
    return write(tmp_path / "grains.dump", dump_text(cubic_rows(), box=((0, 4),) * 3))


def start(dump, cache_home, *, package=ROOT, **environment):
    """A process that needs a kernel."""
    inherited = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    temporary = dump.parent / "temporary"
    temporary.mkdir(exist_ok=True)
    return subprocess.Popen(
        [*PROGRAM, str(dump)],
        env={
            **inherited,
            "PYTHONPATH": str(package),
            "PYTHONDONTWRITEBYTECODE": "1",
            "TMPDIR": str(temporary),
            "XDG_CACHE_HOME": str(cache_home),
            **environment,
        },
        cwd=package,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def words_of(process):
    """What a process says on standard error; it must end well."""
    _, words = process.communicate(timeout=300)
    assert process.returncode == 0, words
    assert "Traceback" not in words
    return words


def kept_in(folder):
    return sorted(path.name for path in Path(folder).rglob("*.kernel"))


only_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs XDG_CACHE_HOME and /proc")


@only_linux
def test_the_first_run_says_that_it_compiles_and_the_second_need_not(dump, tmp_path):
    home = tmp_path / "cache"
    first = words_of(start(dump, home))
    assert first.count(SAID) == 1
    assert "; it is kept for later runs" in first
    assert len(kept_in(home)) >= 2
    assert SAID not in words_of(start(dump, home))
    assert list((tmp_path / "temporary").iterdir()) == []


def test_the_garbage_collector_waits_until_the_outermost_kernel_is_compiled():
    told = []
    compiling = cache._Compiling()
    compiling.tell = lambda: told.append(gc.isenabled())
    waits = []
    try:
        for step in (compiling.on_start, compiling.on_start, compiling.on_end, compiling.on_end):
            step(None)
            waits.append(not gc.isenabled())
    finally:
        gc.enable()
    assert waits == [True, True, True, False]
    assert len(told) == 1


def test_a_garbage_collector_that_was_off_stays_off():
    compiling = cache._Compiling()
    gc.disable()
    try:
        compiling.on_start(None)
        compiling.on_end(None)
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_commands_of_one_process_share_a_listener():
    registered = numba.core.event._registered["numba:compile"]
    told = []
    cache.when_compiling(lambda: told.append("one"))
    before = len(registered)
    cache.when_compiling(lambda: told.append("two"))
    assert len(registered) == before
    cache._listener().on_start(None)
    cache._listener().on_end(None)
    assert told == ["two"]


@only_linux
def test_eight_processes_that_start_cold_all_succeed(tmp_path):
    """They meet before they compile one kernel, and all write it to the same place."""
    (tmp_path / "small.py").write_text(SMALL, encoding="utf-8")
    words = [sys.executable, "small.py"]
    variables = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    processes = [
        subprocess.Popen(
            words, cwd=tmp_path, env=variables, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        for _ in range(8)
    ]
    # each says that it is there, and waits to be answered
    assert [process.stdout.readline() for process in processes] == [b"ready\n"] * 8
    for process in processes:
        process.stdin.write(b"go\n")
        process.stdin.flush()
    found = [process.communicate(timeout=60)[0].split() for process in processes]
    assert [process.returncode for process in processes] == [0] * 8
    assert all(value == b"42" for value, _ in found)
    assert len(kept_in(tmp_path / "cache")) == 1
    assert list((tmp_path / "cache").rglob("*.kernel")) == [
        path for path in (tmp_path / "cache").rglob("*") if path.is_file()
    ]
    later = subprocess.run(words, cwd=tmp_path, env=variables, input=b"go\n", capture_output=True)
    assert later.stdout.split() == [b"ready", b"42", b"0"]


@only_linux
def test_a_package_that_nobody_can_write_to_is_no_obstacle(dump, tmp_path):
    package = tmp_path / "package"
    shutil.copytree(
        ROOT / "scanfab", package / "scanfab", ignore=shutil.ignore_patterns("__pycache__")
    )
    # not even root makes a folder where a file is
    (package / "scanfab" / "packing" / "__pycache__").write_text("")
    home = tmp_path / "cache"
    assert SAID in words_of(start(dump, home, package=package))
    assert SAID not in words_of(start(dump, home, package=package))
    assert kept_in(package) == []


@only_linux
@pytest.mark.parametrize("given", [{}, {"NUMBA_CACHE_DIR": NOWHERE}])
def test_without_a_home_it_compiles_for_itself_and_leaves_nothing(dump, tmp_path, given):
    words = words_of(start(dump, NOWHERE, HOME=NOWHERE, **given))
    assert "; it cannot be kept: /proc/none" in words
    assert list((tmp_path / "temporary").iterdir()) == []


@only_linux
def test_a_failed_run_leaves_nothing_either(dump, tmp_path):
    process = start(write(dump, dump_text(cubic_rows()).replace("0.", "x", 20)), NOWHERE)
    process.communicate(timeout=300)
    assert process.returncode == 1
    assert list((tmp_path / "temporary").iterdir()) == []


def test_numbas_own_variable_counts(dump, tmp_path):
    home = tmp_path / "cache"
    words_of(start(dump, tmp_path / "unused", NUMBA_CACHE_DIR=str(home)))
    assert kept_in(home)
    assert not (tmp_path / "unused").exists()


def test_functions_of_others_are_kept_where_they_were():
    assert scanfab.scan.kernels.sweep
    assert os.environ.get("NUMBA_CACHE_DIR", "") == numba.config.CACHE_DIR


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The folder of kernels, which is new."""
    home = tmp_path / "kernels"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(home))
    folder.kernel_folder.cache_clear()
    yield folder.kernel_folder().path
    folder.kernel_folder.cache_clear()


def twice(x):
    return 2 * x


def compiled_anew() -> bool:
    """Whether a new process would compile a kernel rather than find it."""
    function = compiled.kernel(twice)
    assert function(21) == 42
    return bool(function.stats.cache_misses)


@pytest.mark.parametrize("damage", ["empty", "cut", "garbage", "one bit", "gone", "a folder"])
def test_what_is_damaged_is_compiled_again_and_replaced(kept, damage):
    assert compiled_anew()
    assert not compiled_anew()
    (file,) = kept.iterdir()
    content = file.read_bytes()
    file.unlink()
    if damage == "a folder":  # cannot be replaced, which is no reason to stop
        file.mkdir()
        assert compiled_anew()
        return
    wrong = {
        "empty": b"",
        "cut": content[: len(content) // 2],
        "garbage": b"garbage" * 1000,
        # in the middle of the machine's code
        "one bit": content[:3000] + bytes([content[3000] ^ 1]) + content[3001:],
    }
    if damage in wrong:
        file.write_bytes(wrong[damage])
        file.chmod(0o600)
    assert compiled_anew()
    assert not compiled_anew()
    assert len(list(kept.iterdir())) == 1


@pytest.mark.skipif(os.name != "posix", reason="needs permissions")
@pytest.mark.parametrize("which", ["the given folder", "the folder of this version"])
def test_a_folder_that_others_can_write_to_is_neither_read_nor_written(kept, which):
    assert compiled_anew()
    (file,) = kept.iterdir()
    open_to_all = kept if which == "the folder of this version" else kept.parent
    open_to_all.chmod(0o777)
    folder.kernel_folder.cache_clear()
    assert (
        f"{open_to_all} is not yours, or others can write to it" in folder.kernel_folder().problem
    )
    file.write_bytes(b"not read")
    assert compiled_anew()
    assert compiled_anew()
    assert file.read_bytes() == b"not read"


@pytest.mark.skipif(os.name != "posix", reason="needs permissions")
def test_a_file_that_others_can_write_to_is_not_read(kept):
    assert compiled_anew()
    (file,) = kept.iterdir()
    file.chmod(0o666)
    assert compiled_anew()
    assert not compiled_anew()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


@pytest.mark.skipif(os.name != "posix", reason="needs owners")
def test_what_belongs_to_another_user_is_not_trusted(tmp_path, monkeypatch):
    status = tmp_path.stat()
    assert folder.is_private(status)
    monkeypatch.setattr(os, "getuid", lambda: status.st_uid + 1)
    assert folder.is_private(status) == (status.st_uid == 0)
    stranger = os.stat_result((0o040700, 0, 0, 1, status.st_uid + 2, 0, 0, 0, 0, 0))
    assert not folder.is_private(stranger)


def test_no_folder_is_made_for_others_to_write_to(tmp_path):
    before = os.umask(0)
    try:
        folder.make_private(tmp_path / "one" / "two")
    finally:
        os.umask(before)
    assert folder.is_private((tmp_path / "one").stat())
    assert folder.is_private((tmp_path / "one" / "two").stat())


def test_another_kernel_means_another_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "__file__", str(tmp_path / "base" / "kernel_folder.py"))
    kernel = tmp_path / "scan" / "kernels" / "axes.py"
    kernel.parent.mkdir(parents=True)
    names = set()
    for text in ("a", "b", "a"):
        kernel.write_text(text)
        names.add(folder._version())
    assert len(names) == 2


def test_no_kernel_is_left_out_of_the_name_of_the_folder():
    """Else a kernel that has changed would be served as it was."""
    hashed = {path.relative_to(ROOT / "scanfab") for path in folder.kernel_files()}
    compiled_files = {
        path.relative_to(ROOT / "scanfab")
        for path in (ROOT / "scanfab").rglob("*.py")
        if "@kernel" in path.read_text() or "@inner" in path.read_text()
    }
    assert len(compiled_files) >= 11
    assert compiled_files <= hashed


def test_a_full_disk_is_seen_before_kernels_are_compiled(tmp_path, monkeypatch):
    def full(**_):
        raise OSError(28, "No space left on device")

    assert folder._has_room(tmp_path)
    monkeypatch.setattr(folder.tempfile, "TemporaryFile", full)
    assert not folder._has_room(tmp_path)


def test_a_disk_that_fills_later_is_no_reason_to_stop(kept, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(kept_files.os, "replace", full)
    assert compiled_anew()
    assert list(kept.iterdir()) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_what_is_interrupted_leaves_no_half_a_kernel(tmp_path, monkeypatch, error):
    def fail(*_):
        raise error

    monkeypatch.setattr(kept_files.os, "replace", fail)
    with pytest.raises(error):
        kept_files.write_kept(tmp_path / "one.kernel", b"code")
    assert list(tmp_path.iterdir()) == []


def test_a_process_that_ends_at_once_leaves_no_half_a_kernel(tmp_path, monkeypatch):
    left = []

    def end(*_):
        ending.finish()  # as a signal does
        left.extend(tmp_path.iterdir())

    monkeypatch.setattr(ending, "_steps", [])
    monkeypatch.setattr(kept_files.os, "replace", end)
    with pytest.raises(ValueError, match="not in list"):  # the process would be gone
        kept_files.write_kept(tmp_path / "one.kernel", b"code")
    assert left == []
