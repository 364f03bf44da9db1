"""
Whether another version of the program reads, packs, computes and converts the same.

    python tests/campaigns/same_tables.py [--base COMMIT] [--keep FOLDER] [--also FOLDER ...]
                                          [--only read commands converted]

The base version is checked out and installed in an environment of its own; it is held against the
version that is installed beside this interpreter. What is read and packed must be the same to the
bit; scans of fixed lines agree to 1e-12, others within three of their standard errors. Each
difference is printed; those of WANTED with their reason. Exit code 1 if there are others.

Data: all of sample_data, the sound files of the tests, and the files of the folders named --also.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(ROOT)

import pyvista  # noqa: E402

from scanfab.io.writer import installed_writers, writer_named  # noqa: E402
from tests.helpers import fuzzing, sound_files, versions  # noqa: E402
from tests.helpers.versions import Reading  # noqa: E402

DATA = "sample_data"

WANTED: dict[str, str] = {
    r"\.multisphere( [a-z-]+)?: UnknownFormatError -> ReadError": "any text is tried as a table",
    r"(pfc|edem)/(grains|pairs)\.\w+( [a-z-]+)?: UnknownFormatError": "known by their columns",
    r"H10A22L0M0\.5B0\.5\.restart: ReadError": "MercuryDPM restarts of version 2 are read",
    r"vtk/0_cloud\.vtk( vtk)? \[0\]: contacts": "contacts of the same number are read",
    r"new_empty\.bin lammps-data \[0\]: column type": "without rows a column has no kind",
    r"step: -?\d+ -> None": "a single file has no step by its name",
    r"clumps\.csv row \d step: 0 -> $": "a single file has no step by its name",
    r"engines/lammps/dump\.7[05]00\.\w+ \[0\]: contacts": "contacts of the same step are read",
    r"column radius_of_dump: None|column radius: .* -> None": "a column beside the named radius",
    r"tesis_particles_0\.vtk \[0\]: column": "without rows a column has no kind",
    r"\.csv: other order of columns$": "the parts of the jackknife come last",
    r"(auto|triaxial|cutoffs|oblique|discs)\.csv row \d+ (lines|segments|gvs_axis|coax)": "a and b "
    "have an automatic scan of their own, c and d another",
    r"^(compared_\w+|one_cutoff)\.csv row": "made of tables of automatic scans",
    r"row \d+ alpha_vs_axial_(without|half|sample_se)": "the sample's error has a scan of its own",
    r"surface\.csv row \d+ window_alpha": "exact for a shape from a file",
}
"""Regular expression of what differs, and why it shall."""

BOX, TRIAXIAL = f"{DATA}/liggghts_box", f"{DATA}/yade_triaxial --boundary mask=3"
PERIODIC, SHEAR = f"{DATA}/liggghts_periodic", f"{DATA}/lammps_shear"
FLOOR, DISCS = f"{DATA}/liggghts_formats/floor", f"{DATA}/lammps_discs"
ROUGH, FIXED = "--tolerance 3e-3", "--spacing 2rmin --directions lebedev:11"

# every option of the commands that read a source, at least once; {out} is a folder for results
COMPUTE = {
    "auto": f"{BOX} {ROUGH} --quiet",
    "triaxial": f"{TRIAXIAL} {ROUGH} --strain boundary --workers 1",
    "fixed": f"{TRIAXIAL} {FIXED} --rv 0.6 --on-error skip",
    "rvs": f"{BOX} {FIXED} --rv 0.4,0.6 --variants cd --edge start",
    "ends": f"{BOX} {FIXED} --edge ends --frames 1::2 --seed 3",
    "cutoffs": f"{SHEAR} {ROUGH} --cutoffs 0:2rmin:0.5rmin --moment 2",
    "oblique": f"{PERIODIC} {ROUGH} --axis 1,1,0 --min-contacts 3",
    "whole": f"{BOX} {FIXED} --variants ab --contacts geometric --contact-tolerance 1e-4",
    "recursive": f"{TRIAXIAL} {FIXED} --rattlers recursive --frames -1:",
    "force": f"{PERIODIC} {FIXED} --rattlers force --min-force 0.1",
    "with": f"{PERIODIC} {FIXED} --with forces,state,invariants,harmonics",
    "boxed": f"{BOX} {FIXED} --rv-shape box --rv-size 0.02,0.02,0.02",
    "cylinder": f"{BOX} {FIXED} --rv-shape cylinder --rv-axis x",
    "placed": f"{BOX} {FIXED} --rv-radius 0.005 --rv-center 0 0 0",
    "surface": f"{BOX} {FIXED} --rv-shape {{out}}/ball.stl",
    "follows": f"{SHEAR} {FIXED} --rv-follows strain --strain cell",
    "chords": f"{BOX} --max-chords 1e6 --variants c",
    "discs": f"{DISCS} {ROUGH} --dim 2",
    "spheres": f"{DISCS} --directions lebedev:3 --spacing 0.1rmin --dim 3 --variants a",
    "clumps": f"{DATA}/clumps/clumps_spheres.0.vtu {FIXED} --bodies clumpId",
    "saved": f"{DATA}/yade_strained/saved_17500.xml.bz2 {FIXED}",
    "columns": f"{DATA}/yade_formats/x_y_z_r.txt {FIXED} --format table --skip 1 "
    "--columns x=1,y=2,z=3,radius=4 --max-unpacked 50",
    "celled": f"{FLOOR}/noradius.txt {FIXED} --cell 0.014 0.013 0.04 --periodic xy "
    "--radius 0.00125",
    "positional": f"{FLOOR}/shuffled.txt {FIXED} --contacts {FLOOR}/pairs_pos_id_force.txt "
    "--contact-columns 'pos id force'",
    "followed": f"{BOX} {FIXED} --follow-for 0.5 --variants c",
    "fields": f"{BOX} {FIXED} --fields frame,variant,alpha_vs_axial --digits 6",
    "told": f"{BOX} {FIXED} --verbose --vtk {{out}}/paraview --plot {{out}}/told.png "
    "--manifest {out}/told.json",
    "part_0": f"{BOX} {FIXED} --frames 0:2",
    "part_2": f"{BOX} {FIXED} --frames 2:",
}
CALIBRATED = (
    "ladder,value,variant,rule,directions,replicates,spacing,cutoff,rv_radius,segments,mean_length,"
    "alpha_vs_axial,alpha_vs_axial_se,alpha_vs_axial_sample_se,steady,note"
)
COMPARED = "compare {out}/triaxial.csv {out}/auto.csv --label one --label two"
TABLES = {
    **{name: f"compute {words}" for name, words in COMPUTE.items()},
    "map_grid": f"map {BOX} --grid 2,2,2 {ROUGH}",
    "map_slices": f"map {TRIAXIAL} --slices 3 --frames -1: {FIXED}",
    "map_shells": f"map {PERIODIC} --shells 2 --variants ac {FIXED} --plot {{out}}/map.png",
    "calibrate": f"calibrate {BOX} --frame -1 {ROUGH} --fields {CALIBRATED}",
    "compared_frames": COMPARED,
    "compared_summary": f"{COMPARED} --summary --strain-max 0.1 --digits 17",
    "compared_differences": f"{COMPARED} --differences",
    "compared_figure": f"{COMPARED} --plot {{out}}/figure.svg --figure evolution",
    "one_cutoff": "compare {out}/cutoffs.csv --cutoff 0.0",
    "merged": "merge {out}/part_0.csv {out}/part_2.csv",
}
OTHERS = {
    **{f"auto.{x}": f"compute {BOX} {ROUGH} -o {{out}}/auto.{x}" for x in ("tsv", "json", "jsonl")},
    "auto.parquet": f"compute {BOX} {ROUGH} -o {{out}}/auto.parquet",
    "stdout": f"compute {BOX} {FIXED} --resume -o {{out}}/auto_fixed.csv",
    **{
        f"inspect_{k}": f"inspect {words} --json"
        for k, words in enumerate((BOX, TRIAXIAL, PERIODIC, SHEAR, DISCS))
    },
    "report": "report {out}/auto.csv --title T --author A -o {out}/report.html",
    "view": f"view {BOX} --frame 0 --cut --screenshot {{out}}/view.png",
    "formats": "formats",
    "converted": f"convert {BOX} {{out}}/converted --to vtp --frames 0:2",
}
COMMANDS = {
    **{f"{name}.csv": [*shlex.split(x), "-o", f"{{out}}/{name}.csv"] for name, x in TABLES.items()},
    **{name: shlex.split(words) for name, words in OTHERS.items()},
}
"""The words of a command by the name of its result."""


def unnamed_options(base: Path) -> set[str]:
    """Options of the base's help that no command above has."""
    said = {"--help", "--version", "--debug", "--follow", "--scheduler", "--scheduler-file"}
    said |= {word for words in COMMANDS.values() for word in words if word.startswith("--")}
    found = set()
    for name in ("compute", "map", "calibrate", "inspect", "compare", "merge", "report", "view",
                 "convert"):  # fmt: skip
        text = subprocess.run(
            [base, "-P", "-c", MAIN, name, "--help"], capture_output=True, text=True
        )
        found |= set(re.findall(r"^ +(?:-\w, )?(--[a-z-]+)", text.stdout, re.MULTILINE))
    return found - said


MAIN = "from scanfab.cli.main import main; main()"


# --- holding the answers against one another


def differences(name: str, one: Any, two: Any) -> Iterator[str]:
    """Where two answers differ."""
    if isinstance(one, dict) and isinstance(two, dict):
        for key in {**one, **two}:
            yield from differences(f"{name}: {key}", one.get(key), two.get(key))
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        for k, (first, second) in enumerate(zip(one, two, strict=True)):
            yield from differences(f"{name} [{k}]", first, second)
    elif one != two:
        yield f"{name}: {str(one)[:120]} -> {str(two)[:120]}"


def table_differences(name: str, one: Path, two: Path, fixed: bool) -> Iterator[str]:
    """Where two CSV tables differ by more than rounding, or than their errors where these count."""
    if one.exists() != two.exists():
        yield f"{name}: {'only' if one.exists() else 'not'} by the base"
        return
    if not one.exists():
        return
    rows, others = (list(csv.DictReader(path.open())) for path in (one, two))
    if len(rows) != len(others) or (rows and {*rows[0]} != {*others[0]}):
        yield f"{name}: other rows or columns"
        return
    if rows and list(rows[0]) != list(others[0]):
        yield f"{name}: other order of columns"
    for k, (row, other) in enumerate(zip(rows, others, strict=True)):
        for column in row:
            if not agree(row, other, column, fixed):
                yield f"{name} row {k} {column}: {row[column]} -> {other[column]}"


def agree(row: dict[str, str], other: dict[str, str], column: str, fixed: bool) -> bool:
    """Whether two cells are the same number, or the same word."""
    one, two = row[column], other[column]
    try:
        first, second = float(one), float(two)
    except ValueError:
        # sources are named by their place
        return Path(one).name == Path(two).name
    if math.isclose(first, second, rel_tol=1e-12, abs_tol=1e-15):
        return True
    errors = (x.get(f"{column}_se") or x.get("alpha_vs_axial_se") or 0 for x in (row, other))
    return not fixed and abs(first - second) <= 3 * math.hypot(*map(float, errors))


def run_commands(python: Path, out: Path) -> dict[str, tuple[int, str]]:
    """Exit code and standard output of each command."""
    out.mkdir(parents=True)
    pyvista.Sphere(radius=0.006, theta_resolution=12, phi_resolution=12).save(out / "ball.stl")

    def one(words: list[str]) -> tuple[int, str]:
        words = [word.format(out=out) for word in words]
        done = subprocess.run([python, "-P", "-c", MAIN, *words], cwd=ROOT, capture_output=True,
                              text=True, check=False)  # fmt: skip
        print(".", end="", file=sys.stderr, flush=True)
        return done.returncode, done.stdout

    found: dict[str, tuple[int, str]] = {}
    for of_tables in (False, True):
        wave = {
            n: words for n, words in COMMANDS.items() if (words[0] in MADE_OF_TABLES) == of_tables
        }
        with ThreadPoolExecutor(2) as pool:
            found |= dict(zip(wave, pool.map(one, wave.values()), strict=True))
    return found


MADE_OF_TABLES = ("compare", "merge", "report")


def held_commands(python: Path, base: Path, folder: Path) -> Iterator[str]:
    """Differences of all commands."""
    for option in sorted(unnamed_options(base)):
        yield f"no command tries the option {option}"
    outs = folder / "base", folder / "this"
    ones, twos = (run_commands(who, out) for who, out in zip((base, python), outs, strict=True))
    for name, words in COMMANDS.items():
        (code, text), (other_code, other_text) = ones[name], twos[name]
        if code and code == other_code:
            yield f"{name} ends with {code} by both, and compares nothing"
        if code != other_code:
            yield f"{name}: exit code {code} -> {other_code}"
        elif name.endswith(".csv"):
            fixed = "--directions" in words or words[0] == "compare"
            yield from table_differences(name, outs[0] / name, outs[1] / name, fixed)
        elif name.startswith("inspect"):
            rows = [
                [{**json.loads(line), "warnings": None} for line in lines.splitlines()]
                for lines in (text, other_text)
            ]
            yield from differences(name, *rows)
    made = [{str(path.relative_to(out)) for path in out.rglob("*")} for out in outs]
    for path in sorted(made[0] ^ made[1]):
        yield f"{path}: {'only' if path in made[0] else 'not'} by the base"


def main() -> None:
    """Make the base, ask both versions, print the differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--base", default=versions.BASE)
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / "same_tables")
    parser.add_argument("--also", type=Path, nargs="*", default=[])
    parser.add_argument("--only", nargs="+", default=["read", "converted", "commands"])
    given = parser.parse_args()
    base = versions.installed_base(given.base, given.keep.resolve())
    pythons = base, Path(sys.executable)
    found: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sources = every_source(folder / "sound", given.also) if {*given.only} - {"commands"} else []
        if "read" in given.only:
            answers = [versions.answers(python, sources) for python in pythons]
            for source, *pair in zip(sources, *answers, strict=True):
                name = f"{source.source} {source.options.get('format', '')}".strip()
                found += differences(name, *pair)
            print(f"read: {len(sources)} sources", flush=True)
        if "converted" in given.only:
            # files that are there unpacked as well, or are like others, are not converted
            plain = {one.source: 0 for one in sources if not one.source.endswith(PACKED)}
            listed = [(source, name) for source in plain for name in installed_writers()]
            answers = [
                versions.answers(python, conversions(listed, folder / f"converted_{k}"))
                for k, python in enumerate(pythons)
            ]
            for (source, name), *pair in zip(listed, *answers, strict=True):
                found += differences(f"converted: {source} {name}", *pair)
            print(f"converted: {len(listed)} conversions", flush=True)
        if "commands" in given.only:
            found += held_commands(pythons[1], base, folder / "commands")
    report(found)


PACKED = (".gz", ".bz2", ".xz", ".lz4", ".zst")


def every_source(folder: Path, also: list[Path]) -> list[Reading]:
    """Samples, and sound files as any format and as their own."""
    sources = [path for path in sorted((ROOT / DATA).iterdir()) if path.is_dir()]
    for top in (ROOT / DATA, *also):
        sources += [x for x in sorted(top.rglob("*")) if x.is_file() and x.parent.name != "paper"]
    found = [Reading(str(path)) for path in sources]
    for name in fuzzing.READERS:
        own = folder / name
        own.mkdir(parents=True)
        for file, content in sound_files.seeds(name, own):
            (own / file).write_bytes(content)
        for path in sorted(own.iterdir()):
            found += [Reading(str(path)), Reading(str(path), {"format": name})]
    return found


def conversions(listed: list[tuple[str, str]], folder: Path) -> list[Reading]:
    """Each source in a format, in a folder of its own."""
    return [
        Reading(source, {}, (str(folder / f"{k}/a{writer_named(name).extensions[0]}"), name))
        for k, (source, name) in enumerate(listed)
    ]


def report(found: list[str]) -> None:
    """The differences, wanted ones with their reason; exit code 1 if there are others."""
    unwanted = 0
    for line in found:
        reason = next((why for what, why in WANTED.items() if re.search(what, line)), None)
        unwanted += reason is None
        print(f"{'wanted' if reason else 'DIFFERS'} {line}{f' ({reason})' if reason else ''}")
    print(f"{len(found)} differences, {unwanted} of them not wanted")
    sys.exit(bool(unwanted))


if __name__ == "__main__":
    main()
