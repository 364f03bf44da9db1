"""What the paper claims, each as a table of our numbers."""

from __future__ import annotations

import math

import numpy as np
from paper_tables import (
    MAIN,
    RUNS,
    SLOPE,
    SLOPE_2D,
    TARGET,
    TARGETS,
    TRIED,
    VARIANTS,
    apart,
    engine,
    fits,
    half_width,
    has,
    in_shell,
    interval,
    markdown,
    normalised_gaps,
    of_whole,
    row_of,
    runs,
    stress_of_whole,
    table,
    usual_variant,
    with_error,
    with_half_width,
)

from scanfab.table.compare import SAME_STRAIN

# by measure: the rule at the surface
RULES = {"default": "clip", "paper": "clip, s = r_min/10", "start": "start", "ends": "ends"}


def experiment() -> str:
    """The runs, and what the programs say of them."""
    lines = []
    for name, what in (RUNS | TRIED).items():
        numbers = engine(name)[: len(table(f"{name}_default").select(variant="a"))]
        ratio = numbers["q"] / numbers["p"]
        target = TARGETS.get(name, TARGET)
        lines.append(
            [
                f"`{name}`: {what}",
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
    for name in [*runs("counts"), "yade_reversal", *TRIED]:
        whole, own = table(f"{name}_counts").select(variant="a"), engine(name)
        own = own[np.isin(own["frame"], whole["frame"])]
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


def gap(name: str, measure: str, strain: float) -> str:
    """The difference between a and c in thousandths, with its error."""
    value, error = apart(name, measure, strain)
    return f"{1e3 * value:+.2f} ± {1e3 * error:.2f}"


def parting() -> str:
    """Whole against RV, by the rules at the surface."""
    lines = []
    strains = (0.04, 0.08, 0.12, 0.16, 0.2)
    for name in in_shell():
        for measure in ("default", "ends"):
            cells = [gap(name, measure, one) for one in strains]
            lines.append([f"`{name}`, {RULES[measure]}", *cells])
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
        cells = [f"{gap:+.2f}" for one in VARIANTS for gap in normalised_gaps(name, one)]
        lines.append([f"`{name}`", *cells])
    head = [f"{one}, {part} 12 %" for one in VARIANTS for part in ("up to", "beyond")]
    return markdown(["mean of void less contact, normalised", *head], lines)


def slopes() -> str:
    lines = []
    for name in runs():
        for measure, rule in RULES.items():
            if not has(f"{name}_{measure}"):
                continue
            early, all_ = fits(f"{name}_{measure}"), fits(f"{name}_{measure}", None)
            for variant in early:
                expected = SLOPE_2D if "biaxial" in name else SLOPE
                half = half_width(early[variant], name)
                holds = abs((early[variant].slope or math.nan) - expected) <= half
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


def predicted() -> str:
    """Void anisotropy at small cut-offs beside what near contacts predict."""
    lines = []
    for name in runs("cutoffs"):
        for variant in usual_variant(name):
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
    """What the whole has of the RV's stress ratio, contact fabric and void fabric."""
    lines = []
    for name in [*in_shell(), *TRIED, "periodic_1"]:
        numbers = engine(name)[:41]
        for strain in (0.05, 0.1, 0.2):
            row = numbers[np.argmin(abs(numbers["strain"] - strain))]
            if abs(row["strain"] - strain) > SAME_STRAIN:
                continue
            cells = [f"{strain:.0%}", "-", "-"]
            if name in (*in_shell(), *TRIED):
                ratios = row["q"] / row["p"], stress_of_whole(row)
                cells[1:] = [f"{ratios[0]:.3f}", f"{ratios[1]:.2f}"]
            cells.append(f"{of_whole(name, 'default', 'alpha_c_axial', strain):.2f}")
            cells.append(f"{of_whole(name, 'ends', 'alpha_vs_axial', strain):.2f}")
            lines.append([f"`{name}`", *cells])
    head = ["run", "strain", "q/p of the RV", "q/p, whole / RV", "α_c, whole / RV"]
    return markdown([*head, "α_vs by `ends`, whole / RV"], lines)


def tried() -> str:
    """Runs with a shell that has friction, and with the printed radius, beside the usual one."""
    lines = []
    for name in [MAIN, *TRIED]:
        numbers, fit = engine(name)[:25], fits(f"{name}_default")
        cells = [f"{100 * numbers['overlap'].mean():.1f} %", f"{numbers['coordination'][0]:.2f}"]
        cells += [with_half_width(fit[one], name) for one in VARIANTS]
        cells += [gap(name, one, 0.12) for one in ("default", "ends")]
        lines.append([f"`{name}`", *cells])
    head = ["run, up to 12 %", "mean overlap", "coordination at 0"]
    head += [f"slope of {one}" for one in VARIANTS]
    head += [f"10³ (α_vs of a - c) by {one}" for one in ("clip", "ends")]
    return markdown(head, lines)


def harmonics() -> str:
    """Order 2 and 4 of both fabrics about the axis."""
    names = ("vs_a2", "vs_a4", "c_a2", "c_a4")
    lines = []
    for name in runs("harmonics"):
        variant = usual_variant(name)
        for strain in (0.05, 0.1, 0.2):
            row = row_of(f"{name}_harmonics", variant, strain)
            cells = [f"{1e3 * row[one]:.1f} ± {1e3 * row[f'{one}_se']:.1f}" for one in names]
            lines.append([f"`{name}`, {variant}, {strain:.0%}", *cells])
    head = ["10³", "ℓ(n), order 2", "order 4", "contacts, order 2", "order 4"]
    return markdown(head, lines)


def hysteresis() -> str:
    """A load reversal: the way back beside the way there, at the same strain."""
    lines = []
    for strain in (0.2, 0.195, 0.19, 0.18, 0.16, 0.14, 0.12, 0.1):
        there, back = (row_of(f"{one}_default", "c", strain) for one in (MAIN, "yade_reversal"))
        cells = [
            f"{1e3 * row[column]:.2f}"
            for column in ("alpha_vs_axial", "alpha_c_axial")
            for row in (there, back)
        ]
        lines.append([f"{strain:.1%}", *cells])
    head = ["10³, strain", "α_vs there", "and back", "α_c there", "and back"]
    return markdown(head, lines)
