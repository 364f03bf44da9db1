"""scanfab compute gives what the library gives, and a readable table on a terminal."""

from __future__ import annotations

import csv
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import scanfab
from scanfab.cli.compute import compute

ROOT = Path(__file__).parents[2]
YADE = ROOT / "sample_data" / "yade_triaxial"
FILES = sorted(str(path) for path in YADE.glob("*0000000[01].vtk.gz"))
FAST = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3"]


def run(*args: str) -> Result:
    answer = CliRunner().invoke(compute, list(args), standalone_mode=False)
    assert answer.exception is None, answer.exception
    return answer


def rows(*args: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(run(*args).stdout)))


def test_the_command_gives_what_the_library_gives() -> None:
    table = scanfab.compute(
        scanfab.read_series(FILES), directions=9, spacing="1rmin", boundary="mask=3"
    )
    printed = rows(*FILES, *FAST)
    assert list(printed[0]) == list(scanfab.COLUMNS)
    assert [row["variant"] for row in printed] == list("abcdabcd")
    for name in ("alpha_vs", "mean_length", "gc_xz", "strain"):
        assert [float(row[name]) for row in printed] == table[name].tolist()


def test_any_number_of_workers_prints_the_same_bytes() -> None:
    runs = [run(*FILES, *FAST, "--workers", str(number)).stdout for number in (1, 2, 5)]
    assert runs[0] == runs[1] == runs[2]


def test_variants_come_in_the_order_a_to_d() -> None:
    printed = rows(*FILES, *FAST, "--variants", "ca", "--frames", "0")
    assert [row["variant"] for row in printed] == ["a", "c"]


def test_contacts_by_geometry_and_by_file_are_told_apart() -> None:
    spheres = [file for file in FILES if "spheres" in file]
    by_file = rows(*spheres, "--contacts", str(YADE / "*intrs*"), *FAST, "--frames", "1")
    by_geometry = rows(*FILES, "--contacts", "geometric", *FAST, "--frames", "1")
    assert {row["contacts_from"] for row in by_file} == {"file"}
    assert {row["contacts_from"] for row in by_geometry} == {"geometric"}


def test_frames_keep_their_numbers_and_the_series_first_frame() -> None:
    whole, last = rows(*FILES, *FAST), rows(*FILES, *FAST, "--frames", "-1:")
    assert {row["frame"] for row in last} == {"1"}
    assert whole[4:] == last


def test_a_missing_boundary_is_a_warning() -> None:
    answer = run(*FILES, "--frames", "0", "--directions", "9", "--spacing", "1rmin")
    assert 'name them: --boundary "mask=3"' in answer.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
def test_a_terminal_gets_a_readable_table() -> None:
    import pty

    screen, terminal = pty.openpty()
    command = [sys.executable, "-c", "from scanfab.cli.main import main; main()", "compute"]
    with subprocess.Popen(
        [*command, *FILES, *FAST, "--frames", "0"],
        stdout=terminal,
        stderr=subprocess.PIPE,
        env={**os.environ, "COLUMNS": "160"},
    ) as process:
        os.close(terminal)
        shown = b""
        while True:
            try:
                part = os.read(screen, 4096)
            except OSError:  # the terminal is closed
                break
            if not part:
                break
            shown += part
    text = shown.decode()
    assert process.returncode == 0
    assert "α_vs axial" in text
    assert "solid fraction" in text
    assert "source,frame" not in text
