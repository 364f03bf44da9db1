"""
The decks of sample_data/paper, run small by the programs themselves, and read by scanfab.

Contacts, rattlers and contact fabric are those that the programs count, on every frame.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import scanfab
from tests.helpers.truth import COMPONENTS, SAMPLE_DATA, csv_rows

DECKS = SAMPLE_DATA / "paper"
SCAN = {"directions": 9, "spacing": "3rmin", "workers": 1}
FRAMES = 3
# the samples are small, and decks and logs lie beside the dumps
pytestmark = [
    pytest.mark.filterwarnings(f"ignore::scanfab.base.errors.{kind}")
    for kind in ("ScanfabWarning", "ScanfabNote")
]
# two steps of strain that take a second, whatever the program
STEP = 0.002
# of each deck: the program and its mean stress
PROGRAMS = {"triaxial.py": ("yade", 200e3), "in.periodic": ("liggghts", 200e3)}
PROGRAMS["in.biaxial"] = ("lmp", 400.0)


def run(folder: Path, deck: str, frames: int, *more: object) -> None:
    """Run a deck in a folder; skip without its program."""
    program, _ = PROGRAMS[deck]
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    if program == "yade":
        words = ["-n", "-x", "-j1", DECKS / deck, "--grains", 60, "--frames", frames]
        commands = [[program, *words, "--strain", STEP * (frames - 1), *more]]
    else:
        values = {"grains": 200, "frames": frames - 1, "dstrain": STEP, "folder": "."}
        given = [word for name, value in values.items() for word in ("-var", name, value)]
        commands = [[program, "-in", DECKS / deck, "-log", "none", *given, *more]]
        commands.append([sys.executable, DECKS / "engine.py", "."])
    environment = {"PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1", "HOME": str(folder)}
    for command in commands:
        done = subprocess.run(
            [*map(str, command)], cwd=folder, env=environment, capture_output=True, text=True,
            check=False, timeout=300,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


@pytest.fixture(scope="module", params=PROGRAMS)
def finished(request, tmp_path_factory):
    """The deck, the folder of its run, and the program's own numbers."""
    folder = tmp_path_factory.mktemp("run")
    run(folder, request.param, FRAMES)
    return request.param, folder, csv_rows(folder / "engine.csv")


def test_the_programs_numbers_are_met(finished) -> None:
    deck, folder, engine = finished
    options = {"variants": "a", "strain": "cell"}
    if deck == "triaxial.py":
        options = {"boundary": "mask=3", "rv_radius": float(engine["rv_radius"][0])}
        options["rv_center"] = (0.0, 0.0, 0.0)
    table = scanfab.compute(scanfab.read_series(folder), **options, **SCAN)
    variants = {"a": ("gc", ""), "c": ("gcrv", "_rv")}
    for variant in set(table["variant"]) & set(variants):
        found, (prefix, end) = table.select(variant=variant), variants[variant]
        for name in ("grains", "contacts", "rattlers", "coordination"):
            if f"{name}{end}" in engine.dtype.names:
                np.testing.assert_array_equal(found[name], engine[f"{name}{end}"], err_msg=name)
        for name in COMPONENTS:
            expected = engine[f"{prefix}_{name}"]
            np.testing.assert_allclose(found[f"gc_{name}"], expected, rtol=0, atol=1e-5)
        np.testing.assert_allclose(found["strain"], engine["strain"], rtol=0, atol=1e-5)


def test_the_sample_is_isotropic_at_the_mean_stress_and_compressed(finished) -> None:
    deck, _, engine = finished
    program, stress = PROGRAMS[deck]
    if program == "yade":
        np.testing.assert_allclose(engine["p"], stress, rtol=0.02)
    else:
        np.testing.assert_allclose(engine["p"][0], stress, rtol=1e-3)
    assert (engine["inertial_number"] < 1e-3).all()
    assert (np.diff(engine["q"]) > 0).all()


def test_a_run_goes_on_forwards_or_in_yade_backwards(finished, tmp_path) -> None:
    deck, folder, before = finished
    longer = shutil.copytree(folder, tmp_path / "longer")
    if deck == "triaxial.py":
        run(longer, deck, FRAMES, "--reversal", STEP)
        written = (folder / "engine.csv").read_text("utf-8")
        assert (longer / "engine.csv").read_text("utf-8").startswith(written)
        expected = STEP * np.array([0, 1, 2, 1])
    else:
        run(longer, deck, FRAMES + 1, "-var", "from", FRAMES - 1)
        expected = STEP * np.arange(FRAMES + 1)
    engine = csv_rows(longer / "engine.csv")
    for name in {"step", "contacts"} & {*engine.dtype.names}:
        np.testing.assert_array_equal(engine[name][:FRAMES], before[name], err_msg=name)
    # dumps of cells have six digits of their edges
    digits = 1e-9 if deck == "triaxial.py" else 1e-5
    np.testing.assert_allclose(engine["strain"], expected, atol=digits)
