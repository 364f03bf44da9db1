"""Terminals that know no Greek, and file names that are no text."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from scanfab.table.formats import read_rows
from tests.helpers.interruptions import PROGRAM

FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac"]


def on_terminal(words: list[str], **environment: str) -> tuple[int, str]:
    """Exit code and what a terminal shows of a process."""
    pty = pytest.importorskip("pty", reason="terminals are POSIX")
    ours, theirs = pty.openpty()
    env = {**os.environ, "COLUMNS": "180", "LINES": "40", "TERM": "dumb", **environment}
    with subprocess.Popen([*PROGRAM, *words], stdout=theirs, stderr=theirs, env=env) as process:
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 1 << 16):
                shown += part
        except OSError:  # the other end is closed
            pass
    os.close(ours)
    return process.returncode, shown.decode()


def test_a_terminal_of_ascii_has_greek_spelt(series, tmp_path, ask):
    ask("compute", series, *FAST, "-o", tmp_path / "table.csv")
    code, shown = on_terminal(["compare", str(tmp_path / "table.csv")], PYTHONIOENCODING="ascii")
    assert code == 0, shown
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
