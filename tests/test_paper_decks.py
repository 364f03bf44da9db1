"""
The decks of sample_data/paper, run small by the programs themselves, and read by scanfab.

Contacts, rattlers and contact fabric are those that the programs count, on every frame.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab.pipeline.inspection import inspect_series
from tests.helpers.truth import COMPONENTS, SAMPLE_DATA, csv_rows

DECKS = SAMPLE_DATA / "paper"
SCAN = {"directions": 9, "spacing": "3rmin", "workers": 1}
FRAMES = 3
# the samples are small, and decks and logs lie beside the dumps
pytestmark = [
    pytest.mark.filterwarnings(f"ignore::scanfab.base.errors.{kind}")
    for kind in ("ScanfabWarning", "ScanfabNote")
]
AXES = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
# two steps of strain that take a second, whatever the program
STEP = 0.002


def run(folder: Path, *words: str | Path) -> str:
    """Run a program in a folder, and what it printed; skip without it."""
    if shutil.which(words[0]) is None:
        pytest.skip(f"{words[0]} is not installed")
    done = subprocess.run(
        [*map(str, words)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={"PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1", "HOME": str(folder)},
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def cell(folder: Path, program: str, deck: str, grains: int) -> list[str]:
    """The command of a deck in a periodic cell."""
    words = {"grains": grains, "frames": FRAMES - 1, "dstrain": STEP, "folder": "."}
    more = [word for name, value in words.items() for word in ("-var", name, str(value))]
    return [program, "-in", str(DECKS / deck), "-log", "none", *more]


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """A sphere of grains in its shell, by YADE."""
    folder = tmp_path_factory.mktemp("shell")
    words = ["yade", "-n", "-x", "-j1", DECKS / "triaxial.py", "--grains", 60]
    words += ["--frames", FRAMES, "--strain", STEP * (FRAMES - 1)]
    run(folder, *words)
    return folder, words


@pytest.fixture(scope="module", params=["in.periodic", "in.biaxial"])
def periodic(request, tmp_path_factory):
    """A periodic cell, of spheres by LIGGGHTS or of discs by LAMMPS."""
    folder = tmp_path_factory.mktemp("cell")
    program, grains = {"in.periodic": ("liggghts", 200), "in.biaxial": ("lmp", 200)}[request.param]
    words = cell(folder, program, request.param, grains)
    run(folder, *words)
    run(folder, sys.executable, DECKS / "engine.py", ".")
    return folder, words


def assert_same(table, engine, prefix: str = "gc") -> None:
    """Numbers of a variant are those of the program, in all frames."""
    assert len(table) == len(engine) == FRAMES
    for name in COMPONENTS:
        np.testing.assert_allclose(
            table[f"gc_{name}"], engine[f"{prefix}_{name}"], rtol=0, atol=1e-5, err_msg=name
        )


def test_yades_numbers_are_met(shell) -> None:
    folder, _ = shell
    engine = csv_rows(folder / "engine.csv")
    table = scanfab.compute(
        scanfab.read_series(folder),
        boundary="mask=3",
        rv_radius=float(engine["rv_radius"][0]),
        rv_center=(0.0, 0.0, 0.0),
        **SCAN,
    )
    whole, rv = table.select(variant="a"), table.select(variant="c")
    for name in ("grains", "contacts", "rattlers", "coordination"):
        np.testing.assert_array_equal(whole[name], engine[name], err_msg=name)
    np.testing.assert_array_equal(rv["contacts"], engine["contacts_rv"])
    assert_same(whole, engine)
    assert_same(rv, engine, "gcrv")
    np.testing.assert_allclose(whole["strain"], engine["strain"], rtol=0, atol=1e-5)


def test_liggghts_and_lammps_numbers_are_met(periodic) -> None:
    folder, _ = periodic
    engine = csv_rows(folder / "engine.csv")
    reports = list(inspect_series(scanfab.read_series(folder), scanfab.Settings()))
    for name in ("step", "grains", "contacts", "rattlers", "coordination"):
        np.testing.assert_array_equal([getattr(r, name) for r in reports], engine[name], name)
    for frame, row in zip(scanfab.read_series(folder), engine, strict=True):
        normals = frame.read().contacts.normal
        found = np.einsum("ni,nj->ij", normals, normals) / len(normals)
        expected = [row[f"gc_{name}"] for name in COMPONENTS]
        np.testing.assert_allclose(found[AXES], expected, rtol=0, atol=1e-5)


def test_yades_sample_is_isotropic_at_the_mean_stress_and_compressed(shell) -> None:
    engine = csv_rows(shell[0] / "engine.csv")
    np.testing.assert_allclose(engine["p"], 200e3, rtol=0.02)
    np.testing.assert_allclose(engine["strain"], STEP * np.arange(FRAMES), atol=1e-9)
    assert (engine["inertial_number"] < 1e-3).all()
    assert (np.diff(engine["q"]) > 0).all()


def test_cells_are_isotropic_at_the_mean_stress_and_compressed(periodic) -> None:
    engine = csv_rows(periodic[0] / "engine.csv")
    spheres = (periodic[0] / "engine.txt").read_text("utf-8").split("\n")[0].count("szz")
    np.testing.assert_allclose(engine["p"][0], 200e3 if spheres else 400.0, rtol=1e-3)
    np.testing.assert_allclose(engine["strain"], STEP * np.arange(FRAMES), atol=1e-5)
    assert (engine["inertial_number"] < 1e-3).all()
    assert (np.diff(engine["q"]) > 0).all()


def test_a_finished_run_of_yade_goes_on_backwards(shell, tmp_path) -> None:
    folder, words = shutil.copytree(shell[0], tmp_path / "longer"), shell[1]
    before = (folder / "engine.csv").read_text("utf-8")
    run(folder, *words, "--reversal", STEP)
    assert (folder / "engine.csv").read_text("utf-8").startswith(before)
    strain = csv_rows(folder / "engine.csv")["strain"]
    np.testing.assert_allclose(strain[-2:], [STEP * (FRAMES - 1), STEP * (FRAMES - 2)], atol=1e-9)


def test_a_stopped_run_in_a_cell_goes_on(periodic, tmp_path) -> None:
    folder, words = shutil.copytree(periodic[0], tmp_path / "longer"), periodic[1].copy()
    words[words.index("frames") + 1] = str(FRAMES)
    steps = csv_rows(folder / "engine.csv")["step"]
    run(folder, *words, "-var", "from", str(FRAMES - 1))
    run(folder, sys.executable, DECKS / "engine.py", ".")
    engine = csv_rows(folder / "engine.csv")
    np.testing.assert_array_equal(engine["step"][:-1], steps)
    np.testing.assert_allclose(engine["strain"], STEP * np.arange(FRAMES + 1), atol=1e-5)
