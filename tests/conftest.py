"""What several tests look at: one table of a real test with its ParaView files, made once."""

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from scanfab.cli.main import run
from scanfab.table.formats import read_rows
from tests.helpers.dumps import write

# programs that tests start would otherwise compile all modules anew
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

ROOT = Path(__file__).parents[1]
SAMPLE = "sample_data/yade_triaxial"

# A shell's job in the background ignores interrupts, and so would the programs that tests start and
# interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def signals_as_they_were() -> Iterator[None]:
    """A test that left signals ignored would leave deaf what later tests start and interrupt."""
    before = [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)]
    yield
    assert [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.fixture
def table(tmp_path):
    """Write rows into a file."""
    return lambda rows, name="table.jsonl": write(
        tmp_path / name, "".join(json.dumps(row) + "\n" for row in rows)
    )


class Computed(NamedTuple):
    """A finished computation of three frames."""

    table: Path
    vtk: Path
    rows: list


@pytest.fixture(scope="session")
def computed(tmp_path_factory) -> Computed:
    """The sample's first, fourth and last frame; sources are relative to the repository."""
    folder = tmp_path_factory.mktemp("computed")
    table, vtk = folder / "fabric.csv", folder / "vtk"
    before = Path.cwd()
    os.chdir(ROOT)
    try:
        words = ["compute", SAMPLE, "--boundary", "mask=3", "--tolerance", "5e-4"]
        assert run([*words, "--frames", "0::3", "-o", str(table), "--vtk", str(vtk)]) == 0
    finally:
        os.chdir(before)
    return Computed(table, vtk, read_rows(table))
