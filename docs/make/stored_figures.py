"""Pictures of stored numbers: sizes of the RV, the spectrum of cut-offs, a load reversal."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from paper import MAIN, table, usual_variant

from scanfab.viz.figures.style import COLOURS, WIDTH, new_figure

# mean length and anisotropy of RVs of a known medium, measured by random places
RV_SIZE = Path(__file__).parents[1] / "validation" / "rv_size.csv"
# colour and marker of each rule, and how far beside the radius its errors stand
RULES = {
    "clip": ("vermilion", "s", -0.06),
    "start": ("blue", "o", 0.0),
    "ends": ("green", "^", 0.06),
}
STRAINS = {0.05: "blue", 0.1: "vermilion", 0.2: "green"}


def draw_rv_size(picture: Path) -> None:
    """Mean length and anisotropy by each rule over the radius of the RV, beside the known ones."""
    with RV_SIZE.open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    known = next(row for row in rows if row["rule"] == "medium")
    with new_figure(WIDTH, 2.5) as figure:
        titles = {"mean_length": "mean length ℓ / $r_{mean}$", "alpha": "axial anisotropy α"}
        for axes, (column, title) in zip(figure.subplots(1, 2), titles.items(), strict=True):
            for rule, (colour, marker, aside) in RULES.items():
                of_rule = [row for row in rows if row["rule"] == rule]
                radius, value, error = (
                    np.array([float(row[name]) for row in of_rule])
                    for name in ("radius", column, f"{column}_se")
                )
                looks = {"color": COLOURS[colour], "marker": marker, "label": rule}
                axes.errorbar(radius + aside, value, error, **looks)
            axes.axhline(
                float(known[column]), color="0.3", linestyle="--", label="without a window"
            )
            axes.set_xlabel("radius of the RV / $r_{mean}$")
            axes.set_ylabel(title)
        # room for the legend
        figure.axes[0].set_ylim(bottom=1.2)
        figure.axes[0].legend()
        figure.savefig(picture, dpi=300)


def draw_spectrum(picture: Path) -> None:
    """Void anisotropy over the cut-off, and what contacts predict of it, in two samples."""
    with new_figure(WIDTH, 2.6) as figure:
        names = (MAIN, "periodic_1")
        for axes, name in zip(figure.subplots(1, len(names), sharey=True), names, strict=True):
            rows = table(f"{name}_cutoffs").select(variant=usual_variant(name))
            smallest = max(rows["cutoff"]) / 3
            for strain, colour in STRAINS.items():
                nearest = min(rows["strain"], key=lambda one, wanted=strain: abs(one - wanted))
                curve = [row for row in rows if row["strain"] == nearest]
                cut = np.array([row["cutoff"] for row in curve]) / smallest
                alpha = [1e3 * row["alpha_vs_axial"] for row in curve]
                axes.plot(cut, alpha, color=COLOURS[colour], marker="o", label=f"{strain:.0%}")
                known = np.array([row["alpha_vs_axial_contacts"] for row in curve], float)
                axes.plot(cut, 1e3 * known, color=COLOURS[colour], marker="x", linestyle=":")
            axes.set_title(f"{name}, {usual_variant(name)}")
            axes.set_xlabel("cut-off / $r_{min}$")
        figure.axes[0].set_ylabel("10³ α_vs, axial")
        # room for the legend
        figure.axes[0].set_ylim(0, 12)
        figure.axes[0].legend(title="axial strain; crosses: from contacts")
        figure.savefig(picture, dpi=300)


def draw_reversal(picture: Path) -> None:
    """Both anisotropies of the RV over the strain, there and back."""
    with new_figure(WIDTH, 2.6) as figure:
        kinds = {"alpha_vs_axial": "10³ α_vs, axial", "alpha_c_axial": "10³ α_c, axial"}
        for axes, (column, title) in zip(figure.subplots(1, 2), kinds.items(), strict=True):
            for name, look in ((MAIN, "-"), ("yade_reversal", "--")):
                rows = table(f"{name}_default").select(variant="c")
                label = "there" if name == MAIN else "and back"
                strain, value = 100 * rows["strain"], 1e3 * rows[column]
                axes.plot(strain, value, color=COLOURS["blue"], linestyle=look, label=label)
            axes.set_xlabel("axial strain, %")
            axes.set_ylabel(title)
        figure.axes[0].legend()
        figure.savefig(picture, dpi=300)


STORED: dict[str, Callable[[Path], None]] = {
    "rv_size": draw_rv_size,
    "paper-spectrum": draw_spectrum,
    "paper-reversal": draw_reversal,
}
