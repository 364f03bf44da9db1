"""scanfab compute gives what the library gives, and a readable table on a terminal."""

from __future__ import annotations

from functools import partial

import pytest

import scanfab
from tests.cli.test_letters import on_terminal
from tests.helpers.truth import TRIAXIAL

FILES = sorted(str(path) for path in TRIAXIAL.glob("*0000000[01].vtk.gz"))
FAST = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3"]


@pytest.fixture
def compute(ask):
    return partial(ask, "compute")


def test_the_command_gives_what_the_library_gives_with_any_number_of_workers(compute) -> None:
    table = scanfab.compute(
        scanfab.read_series(FILES), directions=9, spacing="1rmin", boundary="mask=3"
    )
    runs = [compute(*FILES, *FAST, "--workers", number) for number in (1, 2, 5)]
    assert len({run.out for run in runs}) == 1
    assert "\x1b" not in runs[0].out + runs[0].err
    printed = runs[0].rows
    assert list(printed[0]) == list(scanfab.COLUMNS)
    assert [row["variant"] for row in printed] == list("abcdabcd")
    for name in ("alpha_vs", "mean_length", "gc_xz", "strain"):
        assert [float(row[name]) for row in printed] == table[name].tolist()
    # frames keep their numbers, and the series its first frame
    assert compute(*FILES, *FAST, "--frames", "-1:").rows == printed[4:]
    chosen = compute(*FILES, *FAST, "--variants", "ca", "--frames", "0").rows
    assert [row["variant"] for row in chosen] == ["a", "c"]


def test_contacts_by_geometry_and_by_file_are_told_apart(compute) -> None:
    spheres = [file for file in FILES if "spheres" in file]
    words = (*FAST, "--frames", "1")
    by_file = compute(*spheres, "--contacts", TRIAXIAL / "*intrs*", *words).rows
    by_geometry = compute(*FILES, "--contacts", "geometric", *words).rows
    assert {row["contacts_from"] for row in by_file} == {"file"}
    assert {row["contacts_from"] for row in by_geometry} == {"geometric"}


def test_a_missing_boundary_is_a_warning(compute) -> None:
    answer = compute(*FILES, "--frames", "0", *FAST[:4])
    assert 'name them: --boundary "mask=3"' in answer.err


def test_a_terminal_gets_a_readable_table() -> None:
    code, shown = on_terminal(["compute", *FILES, *FAST, "--frames", "0"])
    assert code == 0
    assert "α_vs axial" in shown
    assert "solid fraction" in shown
    assert "source,frame" not in shown
