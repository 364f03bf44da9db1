"""The command line among other programs: pipes, streams, completion, and how fast it starts."""

import gzip
import os
import subprocess
import time

import pytest
from click.shell_completion import ShellComplete

from scanfab.cli.group import cli
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import FAST, PROGRAM


@pytest.fixture
def packed(tmp_path):
    """A compressed dump of three frames."""
    texts = [dump_text(cubic_rows(squeeze=1 - 0.02 * k), step=k) for k in range(3)]
    (tmp_path / "dump.gz").write_bytes(gzip.compress("".join(texts).encode()))
    return tmp_path / "dump.gz"


TYPED = [
    ("co", "plain,compute plain,compare plain,convert"),
    ("compare --figure ev", "plain,evolution"), ("compute --strain ce", "plain,cell file,ce"),
    ("compute --on-error ", "plain,stop plain,skip"),
    ("inspect --format l", "plain,lammps plain,liggghts plain,lf-dem"),
    ("calibrate --rv-shape c", "plain,cylinder file,c"),
    ("compute --contacts g", "plain,geometric file,g"), ("compute --figure ro", "plain,rose"),
    ("compute --directions le", "plain,lebedev:"),
    ("compute --directions equal-angle:", "plain,equal-angle:"),
    ("compare --summary --fields slope_o", "plain,slope_origin"),
    ("compute --fields frame,alpha_c_axial_se", "plain,frame,alpha_c_axial_se"),
    ("view --axis ", "plain,x plain,y plain,z"),
]  # fmt: skip


@pytest.mark.parametrize(("typed", "found"), TYPED)
def test_commands_and_choices_are_completed(typed, found):
    complete = ShellComplete(cli, {}, "scanfab", "_SCANFAB_COMPLETE")
    *words, current = typed.split(" ")
    offered = complete.get_completions(words, current)
    assert {f"{one.type},{one.value}" for one in offered} == set(found.split())


@pytest.mark.parametrize("command", ["compute", "calibrate"])
def test_a_dash_is_standard_output_as_csv(packed, monkeypatch, ask, command):
    """On a terminal too, which gets a readable table without it."""
    words = ["--variants", "c", "--cutoff", "0.2rmin", "--tolerance", "0.1", "--max-chords", "1e5"]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert {row["variant"] for row in ask(command, packed, *words, "-o", "-").rows} == {"c"}
    assert not os.path.exists("-")


def test_a_dash_goes_with_columns_and_digits_and_is_compared(packed, ask, tmp_path):
    printed = ask("compute", packed, *FAST, "--digits", "3", "-o", "-").out
    table, names = write(tmp_path / "table.csv", printed), "variant,frame,alpha_vs_axial"
    for row in ask("compare", table, "--fields", names, "--digits", "2", "-o", "-").rows:
        assert list(row) == names.split(",")
        assert float(row["alpha_vs_axial"]) == float(f"{float(row['alpha_vs_axial']):.2g}")


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_and_version_are_there_at_once(word):
    def seconds() -> float:
        start = time.perf_counter()
        subprocess.run([*PROGRAM, word], capture_output=True, check=True)
        return time.perf_counter() - start

    # 150 ms on a machine at rest
    assert min(seconds() for _ in range(3)) < 0.6
