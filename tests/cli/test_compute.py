"""scanfab compute gives what the library gives, on any terminal, of files by any name."""

import json
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO

import pytest

import scanfab
from scanfab.table.formats import read_rows
from tests.helpers.interruptions import FAST, PROGRAM
from tests.helpers.tables import curve
from tests.helpers.truth import TRIAXIAL

FILES = sorted(str(path) for path in TRIAXIAL.glob("*0000000[01].vtk.gz"))
ROUGH = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3"]


def test_the_command_gives_what_the_library_gives_with_any_number_of_workers(ask) -> None:
    series = scanfab.read_series(FILES)
    table = scanfab.compute(series, directions=9, spacing="1rmin", boundary="mask=3")
    runs = [ask("compute", *FILES, *ROUGH, "--workers", number) for number in (1, 5)]
    assert len({run.out for run in runs}) == 1
    assert "\x1b" not in runs[0].out + runs[0].err
    printed = runs[0].rows
    assert list(printed[0]) == list(scanfab.COLUMNS)
    assert [row["variant"] for row in printed] == list("abcdabcd")
    for name in ("alpha_vs", "mean_length", "gc_xz", "strain"):
        assert [float(row[name]) for row in printed] == table[name].tolist()
    # frames keep their numbers, and the series its first frame
    assert ask("compute", *FILES, *ROUGH, "--frames", "-1:").rows == printed[4:]


def on_terminal(words: list[str], out: IO[str] | None = None, **more: str) -> str:
    """What a terminal shows of a process, whose results may go to a file."""
    pty = pytest.importorskip("pty", reason="terminals are POSIX")
    ours, theirs = pty.openpty()
    env = {**os.environ, "COLUMNS": "180", "LINES": "40", **more}
    shown = b""
    with subprocess.Popen([*PROGRAM, *words], env=env, stdout=out or theirs, stderr=theirs) as one:
        os.close(theirs)
        with suppress(OSError):  # the other end is closed
            while part := os.read(ours, 1 << 16):
                shown += part
    os.close(ours)
    assert one.returncode == 0, shown
    return shown.decode()


def test_rows_go_to_their_file_while_a_terminal_shows_a_bar(series, tmp_path):
    """And words that come meanwhile begin a line of their own."""
    with open(tmp_path / "rows.csv", "w") as file:
        shown = on_terminal(["compute", str(series), *FAST], file, TERM="xterm")
    assert "5 of 5 frames" in shown
    assert (tmp_path / "rows.csv").read_text().count("\n") == 11
    before = [text for text in shown.split("scanfab: ")[:-1] if text]
    assert all(text.endswith(("\n", "\r", "\x1b[2K")) for text in before)


def test_a_terminal_of_ascii_has_greek_spelt(table):
    shown = on_terminal(["compare", str(table(curve()))], TERM="dumb", PYTHONIOENCODING="ascii")
    assert r"\u03b1_vs axial  \xb1 total" in shown


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are text elsewhere")
@pytest.mark.parametrize("name", ["table.csv", "table.parquet"])
def test_a_folder_whose_name_is_no_text_is_computed_and_reported(series, tmp_path, name, ask):
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/\xff\xc3\xb6")
    shutil.copytree(series, folder)
    table = tmp_path / name
    ask("compute", folder, *FAST, "-o", table, "--frames", "0")
    assert {row["source"] for row in read_rows(table)} == {rf"{tmp_path}/\udcffö"}
    manifest = json.loads(Path(f"{table}.manifest.json").read_text("utf-8"))
    assert manifest["settings"]["sources"] == [folder]
    if name == "table.csv":
        ask("report", table, "-o", tmp_path / "report.html")


@pytest.mark.parametrize("command", ["compute", "calibrate"])
def test_a_dash_is_standard_output_as_csv(series, monkeypatch, ask, command):
    """On a terminal too, which gets a readable table without it."""
    words = ["--variants", "c", "--cutoff", "0.2rmin", "--tolerance", "0.1", "--max-chords", "1e5"]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert {row["variant"] for row in ask(command, series, *words, "-o", "-").rows} == {"c"}
    assert not os.path.exists("-")
    assert "α_vs axial  " in ask(command, series, *words).out
