"""
Whether another version of the program makes the same tables.

    python -m tests.campaigns.same_tables [--base COMMIT] [--keep FOLDER]

The base version is checked out and installed in an environment of its own; it is held against the
version that is installed beside this interpreter. Scans of fixed lines agree to 1e-9, others within
three of their standard errors. Each difference is printed; exit code 1 if there is one.
"""

import argparse
import csv
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = "sample_data"
MAIN = "from scanfab.cli.main import main; main()"
BOX, TRIAXIAL = f"{DATA}/liggghts_box", f"{DATA}/yade_triaxial --boundary mask=3"
PERIODIC, SHEAR = f"{DATA}/liggghts_periodic", f"{DATA}/lammps_shear"
FLOOR, DISCS = f"{DATA}/liggghts_formats/floor", f"{DATA}/lammps_discs"
ROUGH, FIXED = "--tolerance 3e-3", "--spacing 2rmin --directions lebedev:11"
FIRST = "compare {out}/triaxial.csv {out}/auto.csv --label one --label two"

# by the name of the table; {out} is the folder of the tables before
COMMANDS = {
    "auto": f"compute {BOX} {ROUGH}",
    "triaxial": f"compute {TRIAXIAL} {ROUGH} --strain boundary --workers 1",
    "fixed": f"compute {TRIAXIAL} {FIXED} --rv 0.6 --on-error skip",
    "rvs": f"compute {BOX} {FIXED} --rv 0.4,0.6 --variants cd --edge start",
    "ends": f"compute {BOX} {FIXED} --edge ends --frames 1::2 --seed 3",
    "cutoffs": f"compute {SHEAR} {ROUGH} --cutoffs 0:2rmin:0.5rmin --moment 2",
    "oblique": f"compute {PERIODIC} {ROUGH} --axis 1,1,0 --min-contacts 3",
    "whole": f"compute {BOX} {FIXED} --variants ab --contacts geometric --contact-tolerance 1e-4",
    "recursive": f"compute {TRIAXIAL} {FIXED} --rattlers recursive --frames -1:",
    "force": f"compute {PERIODIC} {FIXED} --rattlers force --min-force 0.1",
    "with": f"compute {PERIODIC} {FIXED} --with forces,state,invariants,harmonics",
    "boxed": f"compute {BOX} {FIXED} --rv-shape box --rv-size 0.02,0.02,0.02",
    "cylinder": f"compute {BOX} {FIXED} --rv-shape cylinder --rv-axis x",
    "placed": f"compute {BOX} {FIXED} --rv-radius 0.005 --rv-center 0 0 0",
    "follows": f"compute {SHEAR} {FIXED} --rv-follows strain --strain cell",
    "discs": f"compute {DISCS} {ROUGH} --dim 2",
    "clumps": f"compute {DATA}/clumps/clumps_spheres.0.vtu {FIXED} --bodies clumpId",
    "saved": f"compute {DATA}/yade_strained/saved_17500.xml.bz2 {FIXED}",
    "celled": f"compute {FLOOR}/noradius.txt {FIXED} --cell 0.014 0.013 0.04 --periodic xy "
    "--radius 0.00125",
    "part_0": f"compute {BOX} {FIXED} --frames 0:2",
    "part_2": f"compute {BOX} {FIXED} --frames 2:",
    "map_grid": f"map {BOX} --grid 2,2,2 {ROUGH}",
    "map_slices": f"map {TRIAXIAL} --slices 3 --frames -1: {FIXED}",
    "map_shells": f"map {PERIODIC} --shells 2 --variants ac {FIXED}",
    "calibrate": f"calibrate {BOX} --frame -1 {ROUGH}",
    "compared": FIRST,
    "summary": f"{FIRST} --summary --strain-max 0.1",
    "differences": f"{FIRST} --differences",
    "merged": "merge {out}/part_0.csv {out}/part_2.csv",
}


def installed(commit: str, kept: Path) -> Path:
    """The Python of an environment with a commit; made where it is not."""
    checkout, python = kept / commit, kept / f"{commit}-env" / "bin" / "python"
    if not python.exists():
        subprocess.run(["git", "clone", "--quiet", ROOT, checkout], check=True)
        subprocess.run(["git", "-C", checkout, "checkout", "--quiet", commit], check=True)
        subprocess.run([sys.executable, "-m", "venv", python.parents[1]], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", checkout], check=True)
    return python


def table(python: Path, name: str, out: Path) -> list[dict[str, str]]:
    """The rows of a command's table; none if it fails."""
    words = COMMANDS[name].format(out=out).split()
    path = out / f"{name}.csv"
    words = [python, "-P", "-c", MAIN, *words, "-o", path]
    subprocess.run(words, cwd=ROOT, stderr=subprocess.DEVNULL, check=False)
    return list(csv.DictReader(path.open())) if path.exists() else []


def agree(row: dict[str, str], other: dict[str, str], column: str, fixed: bool) -> bool:
    """Whether two cells are the same number, or the same word."""
    try:
        one, two = float(row[column]), float(other[column])
    except ValueError:
        return row[column] == other[column]
    errors = (x.get(f"{column}_se") or x.get("alpha_vs_axial_se") or 0 for x in (row, other))
    near = 0.0 if fixed else 3 * math.hypot(*map(float, errors))
    return math.isclose(one, two, rel_tol=1e-9, abs_tol=max(near, 1e-12))


def differences(
    name: str, rows: list[dict[str, str]], others: list[dict[str, str]]
) -> Iterator[str]:
    """Where two tables differ, a line for each cell."""
    if not rows or [len(rows), *rows[0]] != [len(others), *(others or [{}])[0]]:
        yield f"{name}: {len(rows)} and {len(others)} rows, or other columns"
        return
    fixed = "--directions" in COMMANDS[name]
    for number, (row, other) in enumerate(zip(rows, others, strict=True)):
        for column in row.keys() - {"seconds"}:
            if not agree(row, other, column, fixed):
                yield f"{name} row {number} {column}: {row[column]} -> {other[column]}"


def main() -> None:
    """Make the base, ask both versions, print the differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--base", default="HEAD~1")
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / "same_tables")
    given = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
        base = installed(given.base, given.keep.resolve())
        for name in COMMANDS:
            before = table(base, name, Path(one))
            found += differences(name, before, table(Path(sys.executable), name, Path(two)))
            print(f"{name}: {len(found)} differences so far", flush=True)
    print(*found, sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
