"""
Whether another version of the program makes the same tables.

    python -m tests.campaigns.same_tables [--base COMMIT]

The base version is installed in a folder of its own, beside the packages of this interpreter, and
held against the version that is installed there. Scans of fixed lines agree to 1e-9, others within
three of their standard errors. Each difference is printed; exit code 1 if there is one.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from subprocess import DEVNULL

import click
import numpy as np
import polars
from polars.selectors import numeric

from tests.helpers.interruptions import PROGRAM

ROOT = Path(__file__).resolve().parents[2]
PIP = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
DATA = "sample_data"
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


def table(name: str, out: Path, site: str = "") -> polars.DataFrame:
    """A command's table, by the version in a folder or the installed one; empty if it fails."""
    out.mkdir(exist_ok=True)
    path, words = out / f"{name}.csv", COMMANDS[name].format(out=out).split()
    command, env = [sys.executable, "-P", *PROGRAM[1:], *words], {**os.environ, "PYTHONPATH": site}
    subprocess.run([*command, "-o", path], cwd=ROOT, env=env, stderr=DEVNULL, check=False)
    return polars.read_csv(path, infer_schema_length=None) if path.exists() else polars.DataFrame()


def differences(name: str, rows: polars.DataFrame, others: polars.DataFrame) -> Iterator[str]:
    """Where two tables differ, a line for each cell."""
    if rows.is_empty() or (len(rows), rows.columns) != (len(others), others.columns):
        yield f"{name}: {len(rows)} and {len(others)} rows, or other columns"
        return
    numbers = {*rows.select(numeric()).columns} & {*others.select(numeric()).columns}
    for column in sorted({*rows.columns} - {"seconds"}):
        one, two = rows[column], others[column]
        same = one.cast(str).eq_missing(two.cast(str)).to_numpy()
        if column in numbers:
            near, errors = np.zeros(len(rows)), [f"{column}_se", "alpha_vs_axial_se"]
            errors = [error for error in errors if error in numbers]
            if errors and "--directions" not in COMMANDS[name]:
                near = 3 * np.hypot(*(x[errors[0]].fill_null(0).to_numpy() for x in (rows, others)))
            same |= np.isclose(one, two, rtol=1e-9, atol=np.maximum(near, 1e-12))
        for row in np.flatnonzero(~same).tolist():
            yield f"{name} row {row} {column}: {one[row]} -> {two[row]}"


@click.command(help=__doc__)
@click.option("--base", default="HEAD~1")
def main(base: str) -> None:
    """Make the base, ask both versions, print the differences."""
    found: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        site, source = f"{folder}/site", f"git+file://{ROOT}@{base}"
        subprocess.run([sys.executable, *PIP, "--target", site, source], check=True)
        before, after = Path(folder) / "before", Path(folder) / "after"
        for name in COMMANDS:
            found += differences(name, table(name, before, site), table(name, after))
            print(f"{name}: {len(found)} differences so far", flush=True)
    print(*found, sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
