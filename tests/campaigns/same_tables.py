"""
Whether two versions of the program write the same bytes, for changes that shall change no number.

python tests/campaigns/same_tables.py write FOLDER    tables of the sample data, by this version
python tests/campaigns/same_tables.py hold ONE OTHER  names the files that differ

Every command runs as a process of its own in the project's folder. A command that fails leaves its
message in place of a table, so errors are held against one another as well.
"""

from __future__ import annotations

import argparse
import filecmp
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DATA = "sample_data"

SERIES = {
    "box": [f"{DATA}/liggghts_box"],
    "triaxial": [f"{DATA}/yade_triaxial", "--boundary", "mask=3"],
    "periodic": [f"{DATA}/liggghts_periodic"],
    "shear": [f"{DATA}/lammps_shear"],
    "strained": [f"{DATA}/yade_strained/saved_17500.xml.bz2"],
    "clumps": [f"{DATA}/clumps/clumps_spheres.0.vtu"],
}
OPTIONS = {
    "auto": ["--tolerance", "2e-3"],
    "fixed": ["--spacing", "2rmin", "--directions", "lebedev:11", "--rv", "0.6"],
    "directions": ["--spacing", "1.5rmean", "--tolerance", "2e-3", "--variants", "cd"],
    "cutoffs": ["--cutoffs", "0:2rmin:0.5rmin", "--moment", "2", "--tolerance", "2e-3"],
    "oblique": ["--axis", "1,1,0", "--min-contacts", "3", "--tolerance", "3e-3", "--seed", "7"],
    "whole": ["--variants", "ab", "--contacts", "geometric", "--tolerance", "2e-3"],
}
OTHERS = {
    "periodic.json": ["compute", f"{DATA}/liggghts_periodic", "--tolerance", "3e-3"],
    "shear.tsv": ["compute", f"{DATA}/lammps_shear", "--frames", "1::2", "--tolerance", "3e-3"],
    "calibrate.csv": [
        "calibrate", f"{DATA}/liggghts_box", "--frame", "-1", "--tolerance", "3e-3",
        # all but the seconds that a step took
        "--fields", "ladder,value,variant,rule,directions,replicates,spacing,cutoff,rv_radius,"
        "segments,mean_length,alpha_vs_axial,alpha_vs_axial_se,alpha_vs_axial_sample_se,steady,note",
    ],
}  # fmt: skip
SUMMARIES = ("box_auto", "triaxial_auto", "shear_auto")


def run(words: list[str], output: Path) -> None:
    """One command; its error, if it ends with one, goes where the table would."""
    program = [sys.executable, "-c", "from scanfab.cli.main import main; main()"]
    done = subprocess.run(
        [*program, *words, "-o", str(output)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode:
        output.write_text(done.stderr)
    # says when it was made
    Path(f"{output}.manifest.json").unlink(missing_ok=True)


def write(folder: Path) -> None:
    """All tables of this version."""
    folder.mkdir(parents=True)
    for series, source in SERIES.items():
        for name, options in OPTIONS.items():
            run(["compute", *source, *options], folder / f"{series}_{name}.csv")
    for name, words in OTHERS.items():
        run(words, folder / name)
    for name in SUMMARIES:
        run(["compare", str(folder / f"{name}.csv")], folder / f"{name}_compared.csv")
        run(["compare", str(folder / f"{name}.csv"), "--summary"], folder / f"{name}_summary.csv")


def different(one: Path, other: Path) -> list[str]:
    """Names of the files that only one folder has, or whose bytes differ."""
    names = sorted({file.name for folder in (one, other) for file in folder.iterdir()})
    _, differ, missing = filecmp.cmpfiles(one, other, names, shallow=False)
    return sorted(differ + missing)


def main() -> None:
    """Write, or hold two folders against one another; exit code 1 if they differ."""
    parser = argparse.ArgumentParser(description="Hold the tables of two versions together.")
    parser.add_argument("task", choices=("write", "hold"))
    parser.add_argument("folders", nargs="+", type=Path)
    given = parser.parse_args()
    if given.task == "write":
        write(given.folders[0].resolve())
        return
    one, other = given.folders
    found = different(one, other)
    print(f"{len(list(one.iterdir()))} files, different: {', '.join(found) or 'none'}")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
