"""
Write the first part of docs/validation.md: the experiment of the 2017 paper, claim by claim.

Every number of it comes from the tables in sample_data/paper, which
``python -m tests.campaigns.paper`` makes of the dumps. A test holds the page against the tables.
"""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stdout
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

import scanfab
from scanfab.cli.main import run

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "validation.md"
TABLES = ROOT / "sample_data" / "paper"
WORDS = ROOT / "docs" / "validation_paper.txt"
BEGIN, END = "<!-- paper -->", "<!-- /paper -->"
RUNS = {
    "yade_1": "YADE, 13,723 spheres in a shell",
    "yade_2": "the same, other seed",
    "yade_dense": "the same, denser",
    "periodic_1": "LIGGGHTS, 12,000 spheres, periodic",
    "biaxial_1": "LAMMPS, 10,000 discs, periodic",
}
MAIN = "yade_1"
SLOPE, SLOPE_2D = 0.096, 0.231
UP_TO = 0.12
VARIANTS = "abcd"
CUT = ["--fields", "source,variant,frames,slope,slope_se,r2,peak,peak_strain,final"]
SUMMARY = ["--summary", *CUT, "--digits", "4"]


def has(name: str) -> bool:
    return (TABLES / f"{name}.csv").exists()


@cache
def table(name: str) -> Any:
    """A stored table."""
    return scanfab.load(TABLES / f"{name}.csv")


@cache
def engine(run_name: str) -> Any:
    """What the program itself counted."""
    return np.genfromtxt(TABLES / f"{run_name}_engine.csv", delimiter=",", names=True)


def runs(measure: str = "default") -> list[str]:
    """Runs that this was measured of."""
    return [name for name in RUNS if has(f"{name}_{measure}")]


def row_of(name: str, variant: str, strain: float) -> Any:
    """The frame of a table that is nearest to a strain."""
    rows = table(name).select(variant=variant)
    return min(rows, key=lambda row: abs(row["strain"] - strain))


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


def interval(fit: Any, name: str) -> str:
    """A slope with its 95 % interval, where the table has octants."""
    if fit.slope is None:
        return "-"
    if fit.slope_se is None:
        return f"{fit.slope:.3f}"
    half = half_width(fit, name)
    return f"{fit.slope:.3f} ({fit.slope - half:.3f} to {fit.slope + half:.3f})"


def with_error(row: Any, name: str) -> str:
    """An anisotropy in thousandths with its error, of the scan and of the sample."""
    parts = [row[f"{name}{end}"] for end in ("_se", "_sample_se") if f"{name}{end}" in row]
    error = math.hypot(*(part for part in parts if part is not None))
    return f"{1e3 * row[name]:.2f} ± {1e3 * error:.2f}"


def experiment() -> str:
    """The runs, and what the programs say of them."""
    lines = []
    for name in runs():
        numbers = engine(name)[: len(table(f"{name}_default").select(variant="a"))]
        ratio = numbers["q"] / numbers["p"]
        target = 400.0 if "biaxial" in name else 200e3
        lines.append(
            [
                f"`{name}`: {RUNS[name]}",
                f"{numbers['porosity'][0]:.3f}",
                f"{numbers['coordination'][0]:.2f}",
                f"{int(numbers['rattlers'][0]):,}",
                f"{100 * numbers['overlap'].mean():.1f} %",
                f"{ratio.max():.2f}, {ratio[-1]:.2f}",
                f"{100 * abs(numbers['p'] / target - 1).max():.1f} %",
                f"{numbers['inertial_number'].max():.1e}",
            ]
        )
    head = ["run", "porosity", "coordination", "rattlers", "mean overlap", "q/p peak, end"]
    head += ["p off its target by", "inertial number"]
    return markdown(head, lines)


def counted() -> str:
    """Contacts, rattlers and fabric of scanfab against those of the program, frame by frame."""
    lines = []
    for name in runs("counts"):
        whole, own = table(f"{name}_counts").select(variant="a"), engine(name)
        own = own[: len(whole)]
        equal = [
            sum(np.asarray(whole[column]) == own[column]) for column in ("contacts", "rattlers")
        ]
        axes = ("xx", "yy", "zz", "xy", "xz", "yz")
        off = max(abs(whole[f"gc_{one}"] - own[f"gc_{one}"]).max() for one in axes)
        total = len(whole)
        lines.append([f"`{name}`", *(f"{one} of {total}" for one in equal), f"{off:.0e}"])
    head = ["run", "contacts equal", "rattlers equal", "largest difference of G_c"]
    return markdown(head, lines)


def isotropic_start() -> str:
    lines = []
    for name in runs():
        rows = [row_of(f"{name}_default", one, 0.0) for one in VARIANTS]
        values = [with_error(row, "alpha_vs_axial") for row in rows]
        lines.append([f"`{name}`", *values, with_error(rows[2], "alpha_c_axial")])
    head = ["10³ α_vs axial, strain 0", *VARIANTS, "10³ α_c axial, c"]
    return markdown(head, lines)


def off_diagonals() -> str:
    lines = []
    for name in runs():
        cells = []
        for kind in ("gvs", "gc"):
            rows = table(f"{name}_default").select(variant="c")
            off = max(abs(rows[f"{kind}_{axes}"]).max() for axes in ("xy", "xz", "yz"))
            lateral = abs(rows[f"{kind}_xx"] - rows[f"{kind}_yy"]).max()
            # discs have one lateral value
            sideways = "-" if "biaxial" in name else f"{1e3 * lateral:.2f}"
            final = rows[f"{'alpha_vs' if kind == 'gvs' else 'alpha_c'}_axial"][-1]
            cells += [f"{1e3 * off:.2f}", sideways, f"{1e3 * final:.2f}"]
        lines.append([f"`{name}`", *cells])
    head = ["10³, variant c", "off-diagonal G_vs", "G_vs xx - yy", "final α_vs axial"]
    head += ["off-diagonal G_c", "G_c xx - yy", "final α_c axial"]
    return markdown(head, lines)


def rise() -> str:
    lines = []
    strains = (0.02, 0.05, 0.1, 0.15, 0.2)
    for name in runs():
        for column, sign in (("alpha_vs_axial", "α_vs"), ("alpha_c_axial", "α_c")):
            for variant in "ac":
                values = [row_of(f"{name}_default", variant, one)[column] for one in strains]
                cells = [f"{1e3 * value:.2f}" for value in values]
                share = f"{100 * values[2] / values[-1]:.0f} %"
                lines.append([f"`{name}` {sign} {variant}", *cells, share])
    return markdown(["10³ α axial", *(f"{one:.0%}" for one in strains), "10 % over 20 %"], lines)


def apart() -> str:
    """Whole against RV, by the rules at the surface."""
    lines = []
    strains = (0.04, 0.08, 0.12, 0.16, 0.2)
    for name in [one for one in runs() if has(f"{one}_ends")]:
        for measure in ("default", "ends"):
            pairs = [
                [row_of(f"{name}_{measure}", one, strain).alpha_vs_axial for one in "ac"]
                for strain in strains
            ]
            cells = [f"{1e3 * (a - c):+.2f}" for a, c in pairs]
            lines.append([f"`{name}`, {'clip' if measure == 'default' else measure}", *cells])
    return markdown(["10³ (α_vs of a - c)", *(f"{one:.0%}" for one in strains)], lines)


def roughness(values: np.ndarray) -> float:
    """Scatter of a curve about its own neighbours."""
    return float(np.std(np.diff(values, 2)) / math.sqrt(6))


def smoothness() -> str:
    lines = []
    for name in runs():
        rows = [table(f"{name}_default").select(variant=one) for one in VARIANTS]
        cells = [f"{1e3 * roughness(one['alpha_vs_axial']):.2f}" for one in rows]
        late = [row_of(f"{name}_default", one, 0.1).alpha_vs_axial for one in VARIANTS]
        shares = [
            f"{100 * value / one['alpha_vs_axial'][-1]:.0f} %"
            for value, one in zip(late, rows, strict=True)
        ]
        lines.append([f"`{name}`", *cells, *shares])
    head = ["run", *(f"{one}, 10³ scatter" for one in VARIANTS)]
    return markdown([*head, *(f"{one}, 10 % over 20 %" for one in VARIANTS)], lines)


def normalised() -> str:
    """How far the two curves, each divided by its own largest value, are apart."""
    lines = []
    for name in runs():
        cells = []
        for variant in VARIANTS:
            rows = table(f"{name}_default").select(variant=variant)
            curves = [rows[f"alpha_{kind}_axial"] for kind in ("vs", "c")]
            void, contact = (curve / abs(curve).max() for curve in curves)
            early = rows["strain"] <= UP_TO
            cells += [f"{(void - contact)[part].mean():+.2f}" for part in (early, ~early)]
        lines.append([f"`{name}`", *cells])
    head = [f"{one}, {part} 12 %" for one in VARIANTS for part in ("up to", "beyond")]
    return markdown(["mean of void less contact, normalised", *head], lines)


def slopes() -> str:
    lines = []
    for name in runs():
        for measure in ("default", "start", "ends"):
            if not has(f"{name}_{measure}"):
                continue
            early, all_ = fits(f"{name}_{measure}"), fits(f"{name}_{measure}", None)
            for variant in early:
                expected = SLOPE_2D if "biaxial" in name else SLOPE
                half = half_width(early[variant], name)
                holds = abs((early[variant].slope or math.nan) - expected) <= half
                rule = "clip" if measure == "default" else measure
                cells = [interval(fit[variant], name) for fit in (early, all_)]
                cells.append(f"{early[variant].slope_origin:.3f}")
                lines.append([f"`{name}`", variant, rule, *cells, "yes" if holds else "no"])
    head = [
        "run",
        "variant",
        "edge",
        "slope up to 12 %",
        "all frames",
        "through 0, 12 %",
        "holds the paper's",
    ]
    return markdown(head, lines)


CHOICES: dict[str, tuple[str, dict[str, Any]]] = {
    "the paper's lines, s = r_min/10": ("paper", {}),
    "defaults": ("default", {}),
    "`--spacing 4rmin`": ("coarse", {}),
    "`--directions 9`": ("few", {}),
    **{f"cut-off {one} r_min": ("cutoffs", {"cutoff": one}) for one in (0, 0.3, 0.5, 1, 1.5, 2, 3)},
    **{f"RV {one}": ("rvs", {"rv": one}) for one in (0.4, 0.5, 0.6)},
    "`--edge start`": ("start", {}),
    "`--edge ends`": ("ends", {}),
    "`--rattlers recursive`": ("recursive", {}),
    "`--min-contacts 4`": ("four", {}),
    "Eq. 1 read literally, `equal-angle:10`": ("literal", {}),
    "the half sphere, `equal-angle-full:10`": ("half-sphere", {}),
}


def chosen_rows(name: str, chosen: dict[str, Any]) -> dict[str, Any]:
    """The cut-off of a table that is nearest to so many r_min: r_min is a length of the dump."""
    if "cutoff" not in chosen:
        return chosen
    found = sorted({row["cutoff"] for row in table(name)})
    smallest = found[-1] / 3
    return {"cutoff": min(found, key=lambda one: abs(one - chosen["cutoff"] * smallest))}


def choices(name: str = MAIN) -> str:
    """How each choice changes slope and final value."""
    lines = []
    for label, (measure, chosen) in CHOICES.items():
        if not has(f"{name}_{measure}"):
            continue
        rows = chosen_rows(f"{name}_{measure}", chosen)
        early, all_ = (fits(f"{name}_{measure}", limit, **rows) for limit in (UP_TO, None))
        cells = [
            f"{fit[one].slope:.3f}" if one in fit else "" for fit in (early, all_) for one in "abcd"
        ]
        final = [f"{1e3 * early[one].final:.2f}" if one in early else "" for one in "ac"]
        lines.append([label, *cells, *final])
    head = [
        f"`{name}`",
        *(f"{one}, 12 %" for one in VARIANTS),
        *(f"{one}, all" for one in VARIANTS),
    ]
    return markdown([*head, "final 10³ α_vs, a", "c"], lines)


def predicted() -> str:
    """Void anisotropy at small cut-offs beside what near contacts predict."""
    lines = []
    for name in runs("cutoffs"):
        for variant in "c" if name.startswith("yade") else "a":
            of_variant = table(f"{name}_cutoffs").select(variant=variant)
            found = sorted({row["cutoff"] for row in of_variant})
            for strain in (0.05, 0.1, 0.2):
                cells = []
                for cutoff in found[:3]:
                    rows = of_variant.select(cutoff=cutoff)
                    row = min(rows, key=lambda one: abs(one["strain"] - strain))
                    pair = (row["alpha_vs_axial"], row["alpha_vs_axial_contacts"])
                    cells.append(" / ".join("-" if x is None else f"{1e3 * x:.2f}" for x in pair))
                lines.append([f"`{name}`, {variant}, {strain:.0%}", *cells])
    return markdown(
        ["10³ α_vs axial measured / predicted", "c = 0", "0.1 r_min", "0.3 r_min"], lines
    )


def shell_stress() -> str:
    lines = []
    for name in [one for one in runs() if "q_whole" in (engine(one).dtype.names or ())]:
        numbers = engine(name)
        for strain in (0.1, 0.2):
            row = numbers[np.argmin(abs(numbers["strain"][:41] - strain))]
            inner, whole = row["q"] / row["p"], row["q_whole"] / row["p_whole"]
            cells = [f"{strain:.0%}", f"{inner:.3f}", f"{whole:.3f}", f"{whole / inner:.2f}"]
            lines.append([f"`{name}`", *cells])
    return markdown(["run", "strain", "q/p of the RV", "of the whole", "ratio"], lines)


def printed_radius() -> float:
    """Of the ball that 13,723 grains of the paper's sizes fill, in mm."""
    porosity = engine(MAIN)["porosity"][0]
    return float((13_723 * 1.25 / (1 - porosity)) ** (1 / 3))


def others() -> str:
    """Packings of other people: the mean length against a closed form, and how isotropic it is."""
    lines = []
    with (TABLES / "others.csv").open(encoding="utf-8", newline="") as file:
        samples = groupby(csv.DictReader(file), key=lambda row: row["sample"])
        for name, rows in samples:
            first, *_, last = cut = list(rows)
            solid = float(first["solid_fraction"])
            # equal spheres that do not overlap: the void over what all lines meet of the surfaces
            exact = 4 * (1 - solid) / (3 * solid) * float(last["cutoff"])
            ratios = [
                abs(float(row[f"alpha_vs_{axis}"]) / float(row[f"alpha_vs_{axis}_se"]))
                for row in cut
                for axis in "xyz"
                if row[f"alpha_vs_{axis}_se"]
            ]
            lines.append(
                [
                    name,
                    f"{solid:.3f}",
                    f"{float(first['coordination']):.2f}",
                    f"{100 * (float(first['mean_length']) / exact - 1):+.2f} %",
                    thousandths(first),
                    thousandths(last),
                    f"{max(ratios):.1f}" if ratios else "-",
                ]
            )
    head = ["sample", "solid fraction", "coordination", "ℓ at c = 0, off its closed form"]
    head += ["10³ α_vs axial along z, c = 0", "c = r", "most errors from 0"]
    return markdown(head, lines)


def thousandths(row: dict[str, str]) -> str:
    """The anisotropy along z with its error, where that is known."""
    error = row["alpha_vs_z_se"]
    return f"{1e3 * float(row['alpha_vs_z']):+.2f}" + (
        f" ± {1e3 * float(error):.2f}" if error else ""
    )


def command(*words: str) -> str:
    """What a command prints, with the command, as people would run it."""
    out = io.StringIO()
    with redirect_stdout(out):
        if run(list(words)) != 0:
            raise SystemExit(f"scanfab {' '.join(words)} failed")
    return f"```console\n$ scanfab {' '.join(words)}\n{out.getvalue()}```\n"


def summaries() -> str:
    files = [f"sample_data/paper/{name}_default.csv" for name in runs()]
    return (
        command("compare", *files, *SUMMARY, "--strain-max", str(UP_TO))
        + "\n"
        + command("compare", *files, *SUMMARY)
    )


PARTS: dict[str, Callable[[], str]] = {
    "experiment": experiment, "counted": counted, "isotropic_start": isotropic_start,
    "off_diagonals": off_diagonals, "rise": rise, "apart": apart, "smoothness": smoothness,
    "normalised": normalised,
    "slopes": slopes, "choices": choices, "predicted": predicted,
    "shell_stress": shell_stress, "summaries": summaries,
    "others": others,
    "printed_radius": lambda: f"{printed_radius():.1f}",
}  # fmt: skip


def section() -> str:
    """What stands between the marks: the words of the template with their tables and numbers."""
    template = WORDS.read_text(encoding="utf-8")
    for name, part in PARTS.items():
        template = template.replace("{{" + name + "}}", part().rstrip("\n"))
    return template


def page() -> str:
    """The page with its first part of today."""
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN + "\n")
    return f"{before}{BEGIN}\n{section()}{END}\n{rest.split(END + chr(10))[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
