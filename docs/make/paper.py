"""The stored tables of the paper's experiment, and the numbers of docs/validation.md from them."""

from __future__ import annotations

import csv
import math
import warnings
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

import scanfab
from scanfab.table.compare import SAME_STRAIN
from scanfab.table.row import total_error

TABLES = Path(__file__).parents[2] / "sample_data" / "paper"
RUNS = ("yade_1", "yade_2", "yade_dense", "periodic_1", "biaxial_1")
SPHERES, IN_SHELL = RUNS[:4], RUNS[:3]
# runs that try what makes the differences
TRIED = ("yade_rough", "yade_printed")
MAIN = "yade_1"
SLOPE, SLOPE_2D = 0.096, 0.231
UP_TO = 0.12
VARIANTS = "abcd"
# cut-offs whose slope the page has, in r_min
CUTOFFS = (0.0, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0)

_load = cache(scanfab.load)


def table(name: str) -> Any:
    """A stored table."""
    return _load(TABLES / f"{name}.csv")


def engine(run: str) -> Any:
    """What the program itself counted."""
    return np.genfromtxt(TABLES / f"{run}_engine.csv", delimiter=",", names=True)


def usual_variant(run: str) -> str:
    """The RV of a sample in a shell; a periodic medium as a whole has no edge."""
    return "c" if run.startswith("yade") else "a"


def row_of(name: str, variant: str, strain: float, **chosen: Any) -> Any:
    """The frame of a table that is nearest to a strain."""
    rows = table(name).select(variant=variant, **chosen)
    return min(rows, key=lambda row: abs(row["strain"] - strain))


def fits(name: str, strain_max: float | None = UP_TO, **chosen: Any) -> dict[str, Any]:
    """Rows of the comparison by variant."""
    rows = table(name).select(**chosen) if chosen else table(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scanfab.ScanfabNote)
        summary = scanfab.compare_tables(rows, strain_max=strain_max).summary
    return {one.variant: one for one in summary}


def half_width(fit: Any, name: str) -> float:
    """Of the 95 % interval of a slope, from octants or quadrants that are left out in turn."""
    blocks = 4 if "biaxial" in name else 8
    return float(student.ppf(0.975, blocks - 1)) * (fit.slope_se or 0.0)


def slope_tables() -> Iterator[tuple[str, dict[str, Any], str]]:
    """Every stored table with octants, in its parts: name, chosen rows, what they are."""
    for path in sorted(TABLES.glob("*.csv")):
        name = path.stem
        with path.open(encoding="utf-8") as lines:
            if "alpha_vs_axial_without_1" not in next(lines):
                continue
        if name.endswith("_cutoffs"):
            found = sorted(set(table(name)["cutoff"]))
            for ratio in CUTOFFS:
                cutoff = min(found, key=lambda one: abs(3 * one / found[-1] - ratio))
                yield name, {"cutoff": cutoff}, f"`{name}`, cut-off {ratio:g} r_min"
        elif name.endswith("_rvs"):
            for rv in sorted(set(table(name)["rv"])):
                yield name, {"rv": rv}, f"`{name}`, RV {rv:g}"
        else:
            yield name, {}, f"`{name}`"


def slopes() -> str:
    """The slope of each table up to 12 % strain; * marks an interval without the paper's value."""
    lines = ["| table | a | b | c | d |\n|---|---|---|---|---|"]
    for name, chosen, title in slope_tables():
        found = fits(name, **chosen)
        cells = (slope_cell(found[one], name) if one in found else "" for one in VARIANTS)
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def slope_cell(fit: Any, name: str) -> str:
    """A slope with half its interval."""
    half, expected = half_width(fit, name), SLOPE_2D if "biaxial" in name else SLOPE
    misses = "\\*" if abs(fit.slope - expected) > half else ""
    return f"{fit.slope:.3f}\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}{half:.3f}{misses}"


def write_slopes(folder: Path) -> None:
    """All slopes with their intervals, up to 12 % strain and of all frames, as a file."""
    head = ["table", "chosen", "variant", "slope_12", "half_12", "slope_origin_12", "slope_all"]
    with (folder / "slopes.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*head, "half_all"])
        for name, chosen, _ in slope_tables():
            early, full = fits(name, **chosen), fits(name, None, **chosen)
            part = " ".join(f"{key}={value:g}" for key, value in chosen.items())
            for variant, fit in early.items():
                every = full[variant]
                values = [fit.slope, half_width(fit, name), fit.slope_origin]
                values += [every.slope, half_width(every, name)]
                writer.writerow([name, part, variant, *(f"{one:.4f}" for one in values)])


def span(values: Iterable[float], form: str = "{:.0f}") -> str:
    """The smallest and the largest: 5 to 12."""
    found = sorted(values)
    ends = [form.format(found[0]), form.format(found[-1])]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def counted() -> str:
    """In how many frames contacts and rattlers are those that the program counts."""
    equal = total = 0
    for run in [*RUNS, "yade_reversal", *TRIED]:
        whole, own = table(f"{run}_counts").select(variant="a"), engine(run)
        own = own[np.isin(own["frame"], whole["frame"])]
        same = [np.asarray(whole[one]) == own[one] for one in ("contacts", "rattlers")]
        equal, total = equal + int((same[0] & same[1]).sum()), total + len(whole)
    return f"{equal} of {total}"


def start_worst() -> str:
    """How many of its errors the isotropic void fabric is from 0, at the most."""
    rows = [row_of(f"{run}_default", one, 0.0) for run in RUNS for one in VARIANTS]
    known = [(abs(row["alpha_vs_axial"]), total_error(row, "alpha_vs_axial")) for row in rows]
    return f"{max(value / error for value, error in known if error):.1f}"


def share_of_final(part: str) -> str:
    """The largest off-diagonal term, or lateral difference, over the final anisotropy, percent."""
    found = []
    for run in RUNS if part == "off" else SPHERES:
        rows = table(f"{run}_default").select(variant="c")
        for kind in ("vs", "c"):
            off = max(abs(rows[f"g{kind}_{axes}"]).max() for axes in ("xy", "xz", "yz"))
            lateral = abs(rows[f"g{kind}_xx"] - rows[f"g{kind}_yy"]).max()
            size = off if part == "off" else lateral
            found.append(100 * size / rows[f"alpha_{kind}_axial"][-1])
    return f"{max(found):.0f}"


def at_ten(column: str) -> list[float]:
    """Of an anisotropy at 20 % strain, what is there at 10 %, percent, by run and variant."""
    pairs = (
        [row_of(f"{run}_default", variant, strain)[column] for strain in (0.1, 0.2)]
        for run in RUNS
        for variant in VARIANTS
    )
    return [100 * ten / end for ten, end in pairs]


def lagging() -> str:
    """In how many curves void fabric has the smaller share at 10 % strain."""
    pairs = [*zip(at_ten("alpha_vs_axial"), at_ten("alpha_c_axial"), strict=True)]
    return f"{sum(void < contact for void, contact in pairs)} of {len(pairs)}"


def normalised_worst() -> str:
    """The largest mean difference of the normalised curves of spheres, before or beyond 12 %."""
    gaps = []
    for run in SPHERES:
        for variant in VARIANTS:
            rows = table(f"{run}_default").select(variant=variant)
            curves = [rows[f"alpha_{kind}_axial"] for kind in ("vs", "c")]
            void, contact = (curve / abs(curve).max() for curve in curves)
            early = rows["strain"] <= UP_TO + SAME_STRAIN
            gaps += [(void - contact)[part].mean() for part in (early, ~early)]
    return f"{max(map(abs, gaps)):.2f}"


def apart(run: str, measure: str, strain: float) -> tuple[float, float]:
    """Void anisotropy of a less that of c, and its error by leaving out the octants of both."""
    whole, rv = (row_of(f"{run}_{measure}", one, strain) for one in "ac")
    names = [f"alpha_vs_axial_without_{block}" for block in range(1, 9)]
    without = np.array([whole[one] - rv[one] for one in names])
    return whole.alpha_vs_axial - rv.alpha_vs_axial, math.sqrt(7.0 * without.var())


def apart_at(strain: float) -> str:
    """The smallest difference of a and c in units of its error, over the samples in a shell."""
    found = [apart(run, "default", strain) for run in IN_SHELL]
    return f"{min(abs(value) / error for value, error in found):.1f}"


def left_by_ends(strain: float) -> str:
    """Of the difference between a and c by clip, what is left by ends, percent."""
    pairs = [(apart(run, "ends", strain), apart(run, "default", strain)) for run in IN_SHELL]
    return span(100 * ends[0] / clip[0] for ends, clip in pairs)


def shell_shares(runs: Iterable[str], kind: str) -> str:
    """What the whole has of the RV's stress ratio or contact fabric, at 5, 10 and 20 % strain."""
    found = []
    for run in runs:
        numbers = engine(run)[:41]
        for strain in (one for one in (0.05, 0.1, 0.2) if one < numbers["strain"][-1] + 0.01):
            row = numbers[np.argmin(abs(numbers["strain"] - strain))]
            whole, rv = (row_of(f"{run}_default", one, strain)["alpha_c_axial"] for one in "ac")
            stress = row["q_whole"] / row["p_whole"] / (row["q"] / row["p"])
            found.append(stress if kind == "stress" else whole / rv)
    return span(found, "{:.2f}")


def held() -> str:
    """How many slopes of spheres up to 12 %, by clip and by start, hold the paper's."""
    names = [f"{run}_{rule}" for run in SPHERES for rule in ("default", "start")]
    pairs = [(fit, name) for name in names for fit in fits(name).values()]
    holds = [abs(fit.slope - SLOPE) <= half_width(fit, name) for fit, name in pairs]
    return f"{sum(holds)} of {len(holds)}"


def pooled() -> str:
    """The mean slope of c over the samples of spheres, with its error from their scatter."""
    found = [fits(f"{run}_default")["c"].slope for run in SPHERES]
    error = np.std(found, ddof=1) / math.sqrt(len(found))
    return f"{np.mean(found):.3f} ± {error:.3f}"


def disc_ratio() -> str:
    """Of the final anisotropies of discs, voids over contacts."""
    row = row_of("biaxial_1_default", "a", 0.2)
    return f"{row.alpha_vs_axial / row.alpha_c_axial:.2f}"


def best_cutoff(strain: float) -> str:
    """The cut-off at which the RV's void anisotropy is largest, in r_min."""
    rows = table(f"{MAIN}_cutoffs").select(variant="c")
    nearest = min(rows["strain"], key=lambda one: abs(one - strain))
    at_strain = [row for row in rows if row["strain"] == nearest]
    best = max(at_strain, key=lambda row: row["alpha_vs_axial"])
    return f"{3 * best['cutoff'] / max(rows['cutoff']):.2g}"


def predicted_off() -> str:
    """How much larger than measured the prediction without a cut-off is, percent."""
    found = []
    for run in ("yade_1", "periodic_1", "biaxial_1"):
        for strain in (0.05, 0.1, 0.2):
            row = row_of(f"{run}_cutoffs", usual_variant(run), strain, cutoff=0.0)
            found.append(100 * (row["alpha_vs_axial_contacts"] / row["alpha_vs_axial"] - 1))
    return span(found)


def order_four(fabric: str, runs: Iterable[str]) -> str:
    """Order 4 over order 2 of one fabric, percent at the most."""
    rows = [
        row_of(f"{run}_harmonics", usual_variant(run), strain)
        for run in runs
        for strain in (0.05, 0.1, 0.2)
    ]
    return f"{max(100 * abs(row[f'{fabric}_a4'] / row[f'{fabric}_a2']) for row in rows):.0f}"


def strain_back(kind: str) -> str:
    """How much strain has to be taken back until a fabric of the RV is isotropic, percent."""
    rows = table("yade_reversal_default").select(variant="c")
    strain, alpha = rows["strain"], rows[f"alpha_{kind}_axial"]
    # both fall all the way
    return f"{100 * (strain[0] - np.interp(0.0, alpha[::-1], strain[::-1])):.1f}"


def voids_left() -> str:
    """Of the void fabric of the RV, what is left when contacts are isotropic again, percent."""
    rows = table("yade_reversal_default").select(variant="c")
    contacts, voids = rows["alpha_c_axial"], rows["alpha_vs_axial"]
    return f"{100 * np.interp(0.0, contacts[::-1], voids[::-1]) / voids[0]:.0f}"


def others() -> list[dict[str, str]]:
    """The table of packings that other people made."""
    with (TABLES / "others.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def null_tests() -> str:
    """Anisotropies of hard spheres, and how many are more than 1, 2 and 3 errors from 0."""
    ratios = [
        abs(float(row[f"alpha_vs_{axis}"]) / float(row[f"alpha_vs_{axis}_se"]))
        for row in others()
        for axis in "xyz"
        if row["sample"].startswith("hs") and row[f"alpha_vs_{axis}_se"]
    ]
    beyond = [sum(one > errors for one in ratios) for errors in (1, 2, 3)]
    return (
        f"Of {len(ratios)} anisotropies of hard spheres, {beyond[0]} are more than one error from "
        f"0, {beyond[1]} more than two, {beyond[2]} more than three"
    )


def exact_length(least: float) -> str:
    """How far mean lengths without a cut-off are from their closed form at the most, percent."""
    off = []
    for row in others():
        solid = float(row["solid_fraction"])
        radius = max(float(one["cutoff"]) for one in others() if one["sample"] == row["sample"])
        if float(row["cutoff"]) == 0.0 and solid > least:
            exact = 4 * (1 - solid) / (3 * solid) * radius
            off.append(100 * abs(float(row["mean_length"]) / exact - 1))
    return f"{max(off):.2f}"
