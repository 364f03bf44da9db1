"""
All benchmarks by one command; docs/developers.md has the main results.

python tests/benchmarks/run.py [--only chords reading ...] [--repeats 5] [--largest]

Each section is a function of a module's SECTIONS, which takes how many runs of each way
there are and returns a table.
"""

import argparse
import datetime
import platform
import subprocess
import sys
import warnings
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULES = ("chords", "scaling", "startup", "reading")
PACKAGES = ("scanfab", "numpy", "numba", "polars")


def machine() -> str:
    """Date, processor and versions."""
    name = platform.processor() or platform.machine()
    cpus = "?"
    if sys.platform == "linux":
        lines = subprocess.run(["lscpu"], capture_output=True, text=True, check=True).stdout
        found = dict(line.split(":", 1) for line in lines.splitlines() if ":" in line)
        name, cpus = found.get("Model name", name).strip(), found.get("CPU(s)", "?").strip()
    versions = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    return (
        f"{datetime.date.today()}, {name}, {cpus} cores, Python {platform.python_version()}, "
        f"{versions}."
    )


def main() -> None:
    """Measure and print."""
    warnings.simplefilter("ignore")
    sys.path[0] = str(ROOT)  # not this folder, whose modules have common names
    sections = {}
    for module in MODULES:
        sections |= import_module(f"tests.benchmarks.{module}").SECTIONS
    parser = argparse.ArgumentParser(description="Measure and print how fast scanfab is.")
    parser.add_argument("--only", nargs="+", choices=sections, default=[*sections], metavar="NAME")
    parser.add_argument("--repeats", type=int, default=5, help="runs of which the median counts")
    parser.add_argument("--largest", action="store_true", help="ten million grains too")
    given = parser.parse_args()
    if given.largest:
        sections["growth"] = partial(sections["growth"], largest=True)
    for name in given.only:
        dated = f"{machine()}\n\n{sections[name](given.repeats)}"
        print(f"\n## {name}\n\n{dated}", flush=True)


if __name__ == "__main__":
    main()
