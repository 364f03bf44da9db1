"""The command line among other programs: pipes, streams, completion, and how fast it starts."""

from __future__ import annotations

import csv
import gzip
import io
import os
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM

ROOT = Path(__file__).parents[2]
FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin"]


@pytest.fixture
def packed(tmp_path):
    """A compressed dump of three frames."""
    texts = [dump_text(cubic_rows(squeeze=1 - 0.02 * k), step=k) for k in range(3)]
    path = tmp_path / "dump.gz"
    path.write_bytes(gzip.compress("".join(texts).encode()))
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="needs a POSIX shell")
def test_a_dump_is_computed_and_compared_in_one_pipe(packed):
    program = f"'{sys.executable}' -c 'from scanfab.cli.main import main; main()'"
    options = " ".join(FAST)
    line = (
        f"gzip -dc '{packed}' | {program} compute - --format liggghts {options} "
        f"| {program} compare - --summary"
    )
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [(row["source"], row["variant"], row["frames"]) for row in rows] == [
        ("-", variant, "3") for variant in "abcd"
    ]
    assert all(float(row["r2"]) <= 1 for row in rows)
    # words go past the pipe
    assert all(
        line.startswith(("scanfab: warning: ", "scanfab: note: "))
        for line in done.stderr.splitlines()
    )


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_get_a_completion_script(shell):
    """bash is asked for its version, which some systems have not got."""
    env = {**os.environ, "_SCANFAB_COMPLETE": f"{shell}_source"}
    done = subprocess.run(PROGRAM, env=env, capture_output=True, text=True, check=False)
    assert "_SCANFAB_COMPLETE" in done.stdout
    assert f"{shell}_complete" in done.stdout
    assert done.returncode == 0


# what is typed before the Tab key, and what the shell makes of it: a command, an option, a word
# of an option, and a word of an option that takes files as well
TYPED = {
    "scanfab sam": "sample-data",
    "scanfab compute --rattl": "--rattlers",
    "scanfab compute --rattlers rec": "recursive",
    "scanfab compute --strain cel": "cell",
}
INTERACTIVE = {"bash": ["bash", "--norc", "-i"], "zsh": ["zsh", "-f", "-i"]}


def scripted(shell: str) -> str:
    """The line of the page on the command line that makes a shell complete."""
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    (line,) = re.findall(rf"^.*_SCANFAB_COMPLETE={shell}_source scanfab(?:\).*| \| .*)$", page, re.M)
    return f"autoload -Uz compinit; compinit -u -D; {line}" if shell == "zsh" else line


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_by_the_line_of_the_page(shell: str, tmp_path: Path) -> None:
    scripts = Path(sys.executable).parent
    if shutil.which(shell) is None or not (scripts / "scanfab").exists():
        pytest.skip(f"{shell} or the command scanfab is not installed")
    path = f"{scripts}{os.pathsep}{os.environ['PATH']}"
    env = {**os.environ, "PATH": path, "TERM": "xterm", "HOME": str(tmp_path)}
    if shell == "fish":
        asked = "\n".join(f"complete -C '{typed}'" for typed in TYPED)
        words = ["fish", "--no-config", "-c", f"{scripted(shell)}\n{asked}"]
        done = subprocess.run(words, env=env, capture_output=True, text=True, check=False)
        assert [line.split("\t")[0] for line in done.stdout.splitlines()] == [*TYPED.values()]
        return
    ours, theirs = os.openpty()
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    with subprocess.Popen(INTERACTIVE[shell], env=env, start_new_session=True, **streams) as process:
        try:
            os.write(ours, f"{scripted(shell)}; echo rea''dy\n".encode())
            read_until(ours, "ready")
            for typed, completed in TYPED.items():
                os.write(ours, f"{typed}\t".encode())
                read_until(ours, completed)
                os.write(ours, b"\x15")  # Ctrl-U empties the line
        finally:
            process.kill()
            os.close(ours)
            os.close(theirs)


def read_until(terminal: int, words: str) -> None:
    """Read what a shell writes to its terminal until these words come, for some seconds at most."""
    seen, end = "", time.monotonic() + 60
    while words not in seen:
        assert select.select([terminal], [], [], end - time.monotonic())[0], (words, seen)
        seen += os.read(terminal, 4096).decode("utf-8", "replace")


def offered(words: str, current: str = "") -> set[str]:
    """What bash offers for the word that is being typed."""
    env = {
        **os.environ,
        "_SCANFAB_COMPLETE": "bash_complete",
        "COMP_WORDS": f"{words} {current}",
        "COMP_CWORD": str(len(words.split())),
    }
    done = subprocess.run(PROGRAM, env=env, capture_output=True, text=True, check=False)
    return set(done.stdout.split())


def test_commands_and_options_are_completed():
    assert offered("scanfab", "co") == {"plain,compute", "plain,compare", "plain,convert"}
    assert offered("scanfab compute", "--tol") == {"plain,--tolerance"}


@pytest.mark.parametrize(
    ("words", "current", "found"),
    [
        ("compute --on-error", "", {"plain,stop", "plain,skip"}),
        ("compute --strain", "ce", {"plain,cell", "file,ce"}),
        ("compute --contacts", "g", {"plain,geometric", "file,g"}),
        ("inspect --format", "l", {"plain,lammps", "plain,liggghts", "plain,lf-dem"}),
        ("compute --figure", "ro", {"plain,rose"}),
        ("compare --figure", "ev", {"plain,evolution"}),
        ("calibrate --rv-shape", "c", {"plain,cylinder", "file,c"}),
        ("compute --directions", "le", {"plain,lebedev:"}),
        ("compute --directions", "equal-angle:", {"plain,equal-angle:"}),
        (
            "compute --fields",
            "frame,alpha_c_axial_s",
            {"plain,frame,alpha_c_axial_se", "plain,frame,alpha_c_axial_sample_se"},
        ),
        ("compare --summary --fields", "slope_o", {"plain,slope_origin"}),
        ("view --axis", "", {"plain,x", "plain,y", "plain,z"}),
    ],
)
def test_choices_are_completed(words, current, found):
    assert offered(f"scanfab {words}", current) == found


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_and_version_are_there_at_once(word):
    def seconds() -> float:
        start = time.perf_counter()
        subprocess.run([*PROGRAM, word], capture_output=True, check=True)
        return time.perf_counter() - start

    # 150 ms on a machine at rest
    assert min(seconds() for _ in range(5)) < 0.6


@pytest.mark.parametrize("command", ["compute", "calibrate"])
def test_a_dash_is_standard_output_as_csv(packed, monkeypatch, ask, command):
    """On a terminal too, which gets a readable table without it."""
    words = ["--variants", "c", "--cutoff", "0.2rmin", "--tolerance", "0.1", "--max-chords", "1e5"]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    rows = ask(command, packed, *words, "-o", "-").rows
    assert {row["variant"] for row in rows} == {"c"}
    assert not os.path.exists("-")


def test_a_dash_goes_with_columns_and_digits_and_is_compared(packed, ask, tmp_path):
    printed = ask("compute", packed, *FAST, "--digits", "3", "-o", "-").out
    table = write(tmp_path / "table.csv", printed)
    fields = ["--fields", "variant,frame,alpha_vs_axial", "--digits", "2"]
    rows = ask("compare", table, *fields, "-o", "-").rows
    assert list(rows[0]) == ["variant", "frame", "alpha_vs_axial"]
    for row in rows:
        assert float(row["alpha_vs_axial"]) == float(f"{float(row['alpha_vs_axial']):.2g}")
