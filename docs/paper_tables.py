"""The stored tables of the paper's runs, and how their numbers are written on a page."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

import scanfab
from scanfab.table.compare import SAME_STRAIN
from scanfab.table.row import total_error

TABLES = Path(__file__).parents[1] / "sample_data" / "paper"
RUNS = {
    "yade_1": "YADE, 13,723 spheres in a shell",
    "yade_2": "the same, other seed",
    "yade_dense": "the same, denser",
    "periodic_1": "LIGGGHTS, 12,000 spheres, periodic",
    "biaxial_1": "LAMMPS, 10,000 discs, periodic",
}
# to try what makes the differences
TRIED = {
    "yade_rough": "`yade_1` with friction 0.5 in the shell, too, up to 12 %",
    "yade_printed": "`yade_1` as the printed radius would have it, up to 12 %",
}
# of the mean stress: Pa, of discs N/m
TARGETS = {"biaxial_1": 400.0, "yade_printed": 44.2e3}
TARGET = 200e3
MAIN = "yade_1"
SLOPE, SLOPE_2D = 0.096, 0.231
UP_TO = 0.12
VARIANTS = "abcd"


def has(name: str) -> bool:
    return (TABLES / f"{name}.csv").exists()


_load = cache(scanfab.load)


def table(name: str) -> Any:
    """A stored table."""
    return _load(TABLES / f"{name}.csv")


def engine(run_name: str) -> Any:
    """What the program itself counted."""
    return np.genfromtxt(TABLES / f"{run_name}_engine.csv", delimiter=",", names=True)


def runs(measure: str = "default") -> list[str]:
    """Runs that this was measured of."""
    return [name for name in RUNS if has(f"{name}_{measure}")]


def in_shell() -> list[str]:
    """Runs of a sample that ends in a shell; cells have no such end."""
    return [name for name in runs("ends") if name.startswith("yade")]


def row_of(name: str, variant: str, strain: float) -> Any:
    """The frame of a table that is nearest to a strain."""
    rows = table(name).select(variant=variant)
    return min(rows, key=lambda row: abs(row["strain"] - strain))


def of_whole(name: str, measure: str, column: str, strain: float) -> float:
    """An anisotropy of the whole over that of the RV."""
    whole, rv = (row_of(f"{name}_{measure}", one, strain)[column] for one in "ac")
    return float(whole / rv)


def stress_of_whole(row: Any) -> float:
    """The stress ratio of the whole over that of the RV."""
    return float(row["q_whole"] / row["p_whole"] / (row["q"] / row["p"]))


def apart(name: str, measure: str, strain: float) -> tuple[float, float]:
    """Void anisotropy of a less that of c, and its error by leaving out the octants of both."""
    whole, rv = (row_of(f"{name}_{measure}", one, strain) for one in "ac")
    names = [f"alpha_vs_axial_without_{block}" for block in range(1, 9)]
    without = np.array([whole[one] - rv[one] for one in names])
    error = math.sqrt(7.0 * without.var())
    return whole.alpha_vs_axial - rv.alpha_vs_axial, error


def normalised_gaps(name: str, variant: str) -> list[float]:
    """Mean of void less contact, each over its own largest value, up to 12 % strain and beyond."""
    rows = table(f"{name}_default").select(variant=variant)
    curves = [rows[f"alpha_{kind}_axial"] for kind in ("vs", "c")]
    void, contact = (curve / abs(curve).max() for curve in curves)
    early = rows["strain"] <= UP_TO + SAME_STRAIN
    return [float((void - contact)[part].mean()) for part in (early, ~early)]


def errors_from_null(rows: Iterable[dict[str, str]]) -> list[float]:
    """Of packings of others: how many of its errors each anisotropy is from 0."""
    return [
        abs(float(row[f"alpha_vs_{axis}"]) / float(row[f"alpha_vs_{axis}_se"]))
        for row in rows
        for axis in "xyz"
        if row[f"alpha_vs_{axis}_se"]
    ]


def usual_variant(name: str) -> str:
    """The RV of a sample in a shell; a periodic medium as a whole has no edge."""
    return "c" if name.startswith("yade") else "a"


def fits(name: str, strain_max: float | None = UP_TO, **chosen: Any) -> dict[str, Any]:
    """Rows of the comparison by variant."""
    rows = table(name).select(**chosen) if chosen else table(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scanfab.ScanfabNote)
        summary = scanfab.compare_tables(rows, strain_max=strain_max).summary
    return {one.variant: one for one in summary}


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def half_width(fit: Any, name: str) -> float:
    """Of the 95 % interval of a slope, from octants or quadrants that are left out in turn."""
    blocks = 4 if "biaxial" in name else 8
    return float(student.ppf(0.975, blocks - 1)) * (fit.slope_se or 0.0)


def with_half_width(fit: Any, name: str) -> str:
    """A slope and how far its 95 % interval reaches to either side."""
    if fit.slope_se is None:
        return f"{fit.slope:.3f}"
    return f"{fit.slope:.3f} ± {half_width(fit, name):.3f}"


def interval(fit: Any, name: str) -> str:
    """A slope with its 95 % interval, where the table has octants."""
    if fit.slope is None:
        return "-"
    if fit.slope_se is None:
        return f"{fit.slope:.3f}"
    half = half_width(fit, name)
    return f"{fit.slope:.3f} ({fit.slope - half:.3f} to {fit.slope + half:.3f})"


def with_error(row: Any, name: str) -> str:
    """An anisotropy in thousandths with its error, where that is known."""
    error = total_error(row, name)
    return f"{1e3 * row[name]:.2f}" + ("" if error is None else f" ± {1e3 * error:.2f}")
