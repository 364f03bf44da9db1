"""The command line among other programs: pipes, streams, completion, and how fast it starts."""

from __future__ import annotations

import csv
import gzip
import io
import os
import subprocess
import sys
import time

import pytest
from click.shell_completion import ShellComplete

from scanfab.cli.group import cli
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM

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


def test_bash_is_told_what_completes_a_word():
    asked = {"COMP_WORDS": "scanfab compute --tol", "COMP_CWORD": "2"}
    env = {**os.environ, "_SCANFAB_COMPLETE": "bash_complete", **asked}
    done = subprocess.run(PROGRAM, env=env, capture_output=True, text=True, check=False)
    assert done.stdout == "plain,--tolerance\n"


@pytest.mark.parametrize(
    ("words", "current", "found"),
    [
        ("", "co", {"plain,compute", "plain,compare", "plain,convert"}),
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
def test_commands_and_choices_are_completed(words, current, found):
    complete = ShellComplete(cli, {}, "scanfab", "_SCANFAB_COMPLETE")
    offered = complete.get_completions(words.split(), current)
    assert {f"{one.type},{one.value}" for one in offered} == found


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_and_version_are_there_at_once(word):
    def seconds() -> float:
        start = time.perf_counter()
        subprocess.run([*PROGRAM, word], capture_output=True, check=True)
        return time.perf_counter() - start

    # 150 ms on a machine at rest
    assert min(seconds() for _ in range(3)) < 0.6


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
