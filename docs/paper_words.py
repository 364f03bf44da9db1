"""The numbers that stand in the sentences of the page, from the same tables."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Iterable

import numpy as np
import paper_tables
from paper_tables import (
    MAIN,
    SLOPE,
    SLOPE_2D,
    TRIED,
    VARIANTS,
    engine,
    errors_from_null,
    fits,
    half_width,
    has,
    in_shell,
    interval,
    normalised_gaps,
    of_whole,
    row_of,
    runs,
    stress_of_whole,
    table,
    usual_variant,
)

from scanfab.table.row import total_error


def span(values: Iterable[float], form: str = "{:.0f}") -> str:
    """The smallest and the largest: 5 to 12."""
    found = sorted(values)
    ends = [form.format(found[0]), form.format(found[-1])]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def start_worst() -> str:
    """How many of its errors the isotropic void fabric is from 0, at the most."""
    name = "alpha_vs_axial"
    rows = [row_of(f"{run}_default", one, 0.0) for run in runs() for one in VARIANTS]
    known = [(abs(row[name]), total_error(row, name)) for row in rows]
    return f"{max(value / error for value, error in known if error):.1f}"


def off_share() -> str:
    """The largest off-diagonal term over the final anisotropy, percent."""
    return f"{100 * max(_shares(('xy', 'xz', 'yz'))):.1f}"


def lateral_share() -> str:
    """The largest difference of the lateral values over the final anisotropy, percent."""
    return f"{100 * max(_shares(())):.0f}"


def _shares(off: tuple[str, ...]) -> list[float]:
    found = []
    for name in [one for one in runs() if off or "biaxial" not in one]:
        rows = table(f"{name}_default").select(variant="c")
        for kind in ("vs", "c"):
            lateral = [abs(rows[f"g{kind}_xx"] - rows[f"g{kind}_yy"]).max()]
            terms = [abs(rows[f"g{kind}_{axes}"]).max() for axes in off] or lateral
            found.append(max(terms) / rows[f"alpha_{kind}_axial"][-1])
    return found


def contact_share() -> str:
    """Of the contact fabric at 20 % strain, what is there at 10 %."""
    return span(_at_ten("alpha_c_axial"))


def void_share() -> str:
    """Of the void fabric at 20 % strain, what is there at 10 %."""
    return span(_at_ten("alpha_vs_axial"))


def lagging() -> str:
    """In how many curves void fabric has the smaller share."""
    pairs = [*zip(_at_ten("alpha_vs_axial"), _at_ten("alpha_c_axial"), strict=True)]
    return f"{sum(void < contact for void, contact in pairs)} of {len(pairs)}"


def _at_ten(column: str) -> list[float]:
    found = []
    for name in runs():
        for variant in VARIANTS:
            ten, end = (row_of(f"{name}_default", variant, one)[column] for one in (0.1, 0.2))
            found.append(100 * ten / end)
    return found


def normalised_worst() -> str:
    """The largest mean difference of the normalised curves of spheres."""
    spheres = [one for one in runs() if "biaxial" not in one]
    gaps = [gap for name in spheres for one in VARIANTS for gap in normalised_gaps(name, one)]
    return f"{max(map(abs, gaps)):.2f}"


def left_by_ends(strain: float) -> str:
    """Of the difference between a and c by clip, what is left by ends, percent."""
    found = []
    for name in in_shell():
        clip, ends = (
            row_of(f"{name}_{rule}", "a", strain).alpha_vs_axial
            - row_of(f"{name}_{rule}", "c", strain).alpha_vs_axial
            for rule in ("default", "ends")
        )
        found.append(100 * ends / clip)
    return span(found)


def shell_shares(names: Collection[str], kind: str) -> str:
    """What the whole has of the RV's stress ratio or contact fabric, at 5, 10 and 20 % strain."""
    found = []
    for name in names:
        numbers = engine(name)[:41]
        for strain in (one for one in (0.05, 0.1, 0.2) if one < numbers["strain"][-1] + 0.01):
            row = numbers[np.argmin(abs(numbers["strain"] - strain))]
            contacts = of_whole(name, "default", "alpha_c_axial", strain)
            found.append(stress_of_whole(row) if kind == "stress" else contacts)
    return span(found, "{:.2f}")


def rv_slope(name: str) -> str:
    """The slope of c up to 12 % with its interval."""
    return interval(fits(name)["c"], name)


def overlap(name: str) -> str:
    """The mean overlap of contacts over the sum of their radii up to 12 %, percent."""
    return f"{100 * engine(name)['overlap'][:25].mean():.1f}"


def rv_contacts() -> str:
    """In how many frames the contacts of the RV are one more or less than the program's."""
    off = total = 0
    for name in [*in_shell(), *TRIED]:
        rv, own = table(f"{name}_counts").select(variant="c"), engine(name)
        own = own[np.isin(own["frame"], rv["frame"])]
        difference = np.abs(rv["contacts"] - own["contacts_rv"])
        assert difference.max() <= 1
        off, total = off + int(difference.sum()), total + len(rv)
    return f"{off} of {total}"


def printed_rv_grains() -> str:
    """How many of the grains a ball of the printed 4.5 mm holds."""
    return f"{13_723 * (4.5 / float(printed_radius())) ** 3:.0f}"


def slope_misses() -> str:
    """Which slopes of spheres up to 12 % miss the paper's, and how far beyond their interval."""
    found, count = [], 0
    for name in [one for one in runs() if "biaxial" not in one]:
        for measure in ("default", "start"):
            if not has(f"{name}_{measure}"):
                continue
            for variant, fit in fits(f"{name}_{measure}").items():
                count += 1
                beyond = abs(fit.slope - SLOPE) - half_width(fit, name)
                if beyond > 0:
                    rule = "clip" if measure == "default" else measure
                    found.append(f"`{name}` {variant} by {rule} (by {beyond:.4f})")
    names = ", ".join(found) or "none"
    return f"{count - len(found)} of {count} intervals; the others miss it: {names}"


def spacing_change() -> str:
    """By how much the paper's lines change a slope of spheres up to 12 % at the most."""
    spheres = [one for one in runs("paper") if "biaxial" not in one]
    pairs = [(fits(f"{one}_paper"), fits(f"{one}_default")) for one in spheres]
    return f"{max(abs(a[v].slope - b[v].slope) for a, b in pairs for v in VARIANTS):.4f}"


def pooled() -> str:
    """The mean of the RV's slopes over the samples of spheres, by clip, with its interval."""
    found = [fits(f"{one}_default")["c"] for one in runs() if "biaxial" not in one]
    mean = sum(one.slope for one in found) / len(found)
    error = math.sqrt(sum(one.slope_se**2 for one in found)) / len(found)
    apart = np.std([one.slope for one in found], ddof=1) / math.sqrt(len(found))
    return (
        f"{mean:.3f}, with a standard error of {error:.3f} from the octants of each, and of "
        f"{apart:.3f} from how far they are apart"
    )


def disc_ratio() -> str:
    """Of the final anisotropies of discs, voids over contacts, where an octant is a quadrant."""
    row = row_of("biaxial_1_default", "a", 0.2)
    return f"{row.alpha_vs_axial / row.alpha_c_axial:.2f}"


def disc_misses() -> str:
    """By how much the slopes of discs are beyond their intervals about the paper's."""
    found = fits("biaxial_1_default")
    beyond = {
        variant: abs(fit.slope - SLOPE_2D) - half_width(fit, "biaxial_1")
        for variant, fit in found.items()
    }
    missed = [f"{variant} by {value:.3f}" for variant, value in beyond.items() if value > 0]
    return ", ".join(missed) or "none"


def printed_radius() -> str:
    """Of the ball that 13,723 grains of the paper's sizes fill, in mm."""
    porosity = engine(MAIN)["porosity"][0]
    return f"{(13_723 * 1.25 / (1 - porosity)) ** (1 / 3):.1f}"


def best_cutoff(strain: float) -> str:
    """The cut-off at which the RV's void anisotropy is largest, in r_min."""
    rows = table(f"{MAIN}_cutoffs").select(variant="c")
    nearest = min(rows["strain"], key=lambda one: abs(one - strain))
    at_strain = [row for row in rows if row["strain"] == nearest]
    best = max(at_strain, key=lambda row: row["alpha_vs_axial"])
    return f"{3 * best['cutoff'] / max(rows['cutoff']):.2g}"


def cutoff_slopes() -> str:
    """Slopes of the RV up to 12 % at the smallest, the usual and the largest cut-off."""
    rows = table(f"{MAIN}_cutoffs")
    found = sorted({row["cutoff"] for row in rows})
    usual = min(found, key=lambda one: abs(one - found[-1] / 3))
    slopes = [fits(f"{MAIN}_cutoffs", cutoff=one)["c"].slope for one in (0.0, usual, found[-1])]
    return ", ".join(f"{one:.3f}" for one in slopes)


def predicted_off() -> str:
    """How much larger than measured the prediction without a cut-off is, percent."""
    found = []
    for name in runs("cutoffs"):
        rows = table(f"{name}_cutoffs").select(variant=usual_variant(name), cutoff=0.0)
        for strain in (0.05, 0.1, 0.2):
            row = min(rows, key=lambda one: abs(one["strain"] - strain))
            found.append(100 * (row["alpha_vs_axial_contacts"] / row["alpha_vs_axial"] - 1))
    return span(found)


def null_tests() -> str:
    """Anisotropies of hard spheres, and how many are more than 1, 2 and 3 errors from 0."""
    with (paper_tables.TABLES / "others.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["sample"].startswith("hs")]
    ratios = errors_from_null(rows)
    beyond = [sum(one > errors for one in ratios) for errors in (1, 2, 3)]
    return (
        f"Of {len(ratios)} anisotropies of hard spheres {beyond[0]} are more than one error from "
        f"0, {beyond[1]} more than two, {beyond[2]} more than three"
    )


def order_four(fabric: str, plane: bool = False) -> str:
    """Order 4 over order 2 of one fabric, of spheres or of discs, percent at the most."""
    found = []
    for name in [one for one in runs("harmonics") if ("biaxial" in one) == plane]:
        for strain in (0.05, 0.1, 0.2):
            row = row_of(f"{name}_harmonics", usual_variant(name), strain)
            found.append(100 * abs(row[f"{fabric}_a4"] / row[f"{fabric}_a2"]))
    return f"{max(found):.0f}"


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


def reversal_pressure() -> str:
    """How far from its target the mean stress was on the way back, percent at the most."""
    numbers = engine("yade_reversal")
    return f"{100 * abs(numbers['p'][41:] / 200e3 - 1).max(initial=0.0):.1f}"


def _line_back() -> tuple[float, float]:
    """Slope and intercept of the RV's voids over its contacts on the way back."""
    rows = table("yade_reversal_default").select(variant="c")
    slope, intercept = np.polyfit(rows["alpha_c_axial"], rows["alpha_vs_axial"], 1)
    return float(slope), float(intercept)


def slope_back() -> str:
    """Of the line on the way back."""
    return f"{_line_back()[0]:.3f}"


def offset_back() -> str:
    """The void anisotropy where that line has none of the contacts."""
    return f"{_line_back()[1]:.4f}"
