"""
The tables of the paper's experiment, from the dumps of its runs.

Usage, from the root of the repository, with the runs of sample_data/paper/README.md in RUNS, each
in a folder of its name::

    python -m tests.campaigns.paper RUNS [--into FOLDER] [--only RUN] ... [--measures NAME] ...
                                         [--workers N]

Writes sample_data/paper/RUN_MEASURE.csv, and RUN_engine.csv beside it.

Half an hour to an hour for each run of 13,723 grains on two cores. A table that exists is not
computed again; an unfinished one goes on. docs/make/paper.py makes the page of them.
"""

import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import click

from tests.helpers.interruptions import PROGRAM
from tests.helpers.truth import COMPONENTS, SAMPLE_DATA, csv_rows

TABLES = SAMPLE_DATA / "paper"
A_FOLDER = click.Path(path_type=Path, resolve_path=True)
# what scanfab compare needs, with the sample's octants for the interval of a slope
CURVES = ["source", "frame", "strain", "variant", "alpha_vs_axial", "alpha_vs_axial_se"]
CURVES += ["alpha_c_axial"]
OCTANTS = ["alpha_vs_axial_sample_se", "alpha_c_axial_sample_se"]
OCTANTS += [
    f"alpha_vs_axial_{kind}_{block}" for kind in ("without", "half") for block in range(1, 9)
]
OCTANTS += [f"alpha_c_axial_without_{block}" for block in range(1, 9)]
TENSORS = ["grains", "rattlers", "contacts", "coordination", "segments", "mean_length"]
TENSORS += [f"{name}_{axes}" for name in ("gvs", "gc") for axes in COMPONENTS]
TENSORS += ["alpha_vs", "alpha_c", "alpha_c_axial_se"]
HARMONICS = [f"{name}{end}" for name in ("vs_a2", "vs_a4", "c_a2", "c_a4") for end in ("", "_se")]
USUAL = ("paper", "default", "start", "ends", "counts")


class Run(NamedTuple):
    """A run of a deck, and what there is to measure of it."""

    folder: str
    options: tuple[str, ...] = ()
    frames: str = "0:41"
    measures: tuple[str, ...] = USUAL


class Measure(NamedTuple):
    """Options of compute, and the columns that are kept."""

    options: str
    columns: tuple[str, ...] = (*CURVES, *OCTANTS)


ALL = (*CURVES, *TENSORS, *OCTANTS)
# the lines of the paper: 16 replicates of 43 axes, in total at a distance of r_min/10
PAPER = "--spacing 0.1rmin --directions lebedev:15 --cutoff 1rmin --rv 0.7"
# what the stored tables were computed to
EXACT = "--tolerance 1e-4"
# a hundredth of the signal: what the sweeps need to be told apart
SWEEP = "--spacing 0.4rmin --directions lebedev:15"
CUTOFFS = "--cutoffs 0,0.1rmin,0.3rmin,0.5rmin,0.75rmin,1rmin,1.5rmin,2rmin,3rmin"
MEASURES = {
    "paper": Measure(PAPER, ALL),
    "default": Measure(EXACT, ALL),
    "start": Measure(f"--edge start --variants cd {EXACT}", (*CURVES, "left_out", *OCTANTS)),
    "ends": Measure(f"--edge ends {EXACT}"),
    "cutoffs": Measure(
        f"{CUTOFFS} {SWEEP}", (*CURVES, "cutoff", "alpha_vs_axial_contacts", *OCTANTS)
    ),
    "rvs": Measure(f"--rv 0.4,0.5,0.6 --variants cd {SWEEP}", (*CURVES, "rv", *OCTANTS)),
    # the printed RV of 4.5 mm in a sample of 30.3 mm
    "small-rv": Measure(f"--rv 0.1485 --variants cd {SWEEP}"),
    "recursive": Measure(f"--rattlers recursive --variants bd {SWEEP}"),
    "four": Measure(f"--min-contacts 4 --variants bd {SWEEP}"),
    "coarse": Measure("--spacing 4rmin --directions lebedev:15"),
    "few": Measure("--spacing 0.4rmin --directions 9"),
    "literal": Measure(
        "--directions equal-angle:10 --spacing 0.5rmin", (*CURVES, "gvs_xz", *OCTANTS)
    ),
    "half-sphere": Measure(
        "--directions equal-angle-full:10 --spacing 0.5rmin", (*CURVES, "gvs_xz", *OCTANTS)
    ),
    "harmonics": Measure(
        f"--with harmonics --variants ac {EXACT}", ("frame", "strain", "variant", *HARMONICS)
    ),
    # a rough scan: here only what is counted matters
    "counts": Measure(
        "--directions 9 --spacing 3rmin --variants ac", ("frame", "strain", "variant", *TENSORS)
    ),
}
SHELL = ("--boundary", "mask=3")
SWEEPS = ("cutoffs", "rvs", "small-rv", "recursive", "four", "coarse", "few")
READINGS = ("literal", "half-sphere")
RUNS = {
    "yade_1": Run("yade_1", SHELL, measures=(*USUAL, *SWEEPS, *READINGS, "harmonics")),
    "yade_2": Run("yade_2", SHELL),
    "yade_dense": Run("yade_dense", SHELL),
    "yade_reversal": Run("yade_1", SHELL, "40:", ("default", "start", "counts")),
    "yade_rough": Run("yade_rough", SHELL, "0:25", ("default", "ends", "counts")),
    "yade_printed": Run("yade_printed", SHELL, "0:25", ("default", "ends", "counts")),
    "periodic_1": Run("periodic_1", measures=(*USUAL, "cutoffs", "harmonics")),
    "biaxial_1": Run("biaxial_1", measures=(*USUAL, "cutoffs", "harmonics")),
}


def words(runs: Path, run: Run, name: str) -> list[str]:
    """The command that computes a table, but for the file."""
    options, columns = MEASURES[name]
    more: list[str] = []
    if run.folder.startswith("biaxial"):
        # in a plane directions are so many equal steps
        options = options.replace("lebedev:15", "25")
    if name == "counts" and run.options == SHELL:
        radius = csv_rows(runs / run.folder / "engine.csv")["rv_radius"][0]
        more = ["--rv-radius", repr(float(radius)), "--rv-center", "0", "0", "0"]
    elif run.options != SHELL and "--variants" not in options:
        more = ["--variants", "abcd"]
    more += ["--fields", ",".join(columns), "--digits", "7"]
    return ["compute", run.folder, *run.options, "--frames", run.frames, *options.split(), *more]


@click.command(help="Make the tables of the paper's experiment.")
@click.argument("runs", type=A_FOLDER)
@click.option("--into", type=A_FOLDER, default=TABLES)
@click.option("--only", multiple=True, default=[*RUNS])
@click.option("--measures", multiple=True, default=[*MEASURES])
@click.option("--workers", default=2)
def main(
    runs: Path, into: Path, only: tuple[str, ...], measures: tuple[str, ...], workers: int
) -> None:
    """Compute what is missing."""
    for run_name in only:
        run = RUNS[run_name]
        engine = runs / run.folder / "engine.csv"
        if not engine.exists():
            print(f"{run_name}: no {run.folder}/engine.csv in {runs}, left out", flush=True)
            continue
        shutil.copyfile(engine, into / f"{run_name}_engine.csv")
        for name in [one for one in run.measures if one in measures]:
            table = into / f"{run_name}_{name}.csv"
            if not table.exists():
                print(table.name, flush=True)
                more = ["--workers", str(workers), "--resume", "--quiet", "-o", str(table)]
                # in the folder of the runs: the table says no more of it than the run's name
                subprocess.run([*PROGRAM, *words(runs, run, name), *more], cwd=runs, check=True)
                table.with_name(f"{table.name}.manifest.json").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
