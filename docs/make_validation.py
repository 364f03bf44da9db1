"""
Write the first part of docs/validation.md: the experiment of the 2017 paper, claim by claim.

Every number of it comes from the tables in sample_data/paper, which
``python -m tests.campaigns.paper`` makes of the dumps. A test holds the page against the tables.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import paper_claims as claims
import paper_tables
import paper_words as words
from paper_tables import (
    MAIN,
    UP_TO,
    VARIANTS,
    errors_from_null,
    fits,
    has,
    in_shell,
    markdown,
    runs,
    table,
    with_half_width,
)

from scanfab.cli.main import run

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "validation.md"
WORDS = ROOT / "docs" / "validation_paper.txt"
BEGIN, END = "<!-- paper -->", "<!-- /paper -->"
CUT = ["--fields", "source,variant,frames,slope,slope_se,r2,peak,peak_strain,final"]
SUMMARY = ["--summary", *CUT, "--digits", "4"]
CHOICES: dict[str, tuple[str, dict[str, Any]]] = {
    "the paper's lines, s = r_min/10": ("paper", {}),
    "defaults": ("default", {}),
    "`--spacing 4rmin`": ("coarse", {}),
    "`--directions 9`": ("few", {}),
    **{f"cut-off {one} r_min": ("cutoffs", {"cutoff": one}) for one in (0, 0.3, 0.5, 1, 1.5, 2, 3)},
    **{f"RV {one}": ("rvs", {"rv": one}) for one in (0.4, 0.5, 0.6)},
    "RV of the printed 4.5 mm": ("small-rv", {}),
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
        cells = [with_half_width(early[one], name) if one in early else "" for one in VARIANTS]
        cells += [f"{all_[one].slope:.3f}" if one in all_ else "" for one in VARIANTS]
        final = [f"{1e3 * early[one].final:.2f}" if one in early else "" for one in "ac"]
        lines.append([label, *cells, *final])
    head = [
        f"`{name}`",
        *(f"{one}, 12 %" for one in VARIANTS),
        *(f"{one}, all" for one in VARIANTS),
    ]
    return markdown([*head, "final 10³ α_vs, a", "c"], lines)


def others() -> str:
    """Packings of other people: the mean length against a closed form, and how isotropic it is."""
    lines = []
    with (paper_tables.TABLES / "others.csv").open(encoding="utf-8", newline="") as file:
        samples = groupby(csv.DictReader(file), key=lambda row: row["sample"])
        for name, rows in samples:
            first, *_, last = cut = list(rows)
            solid = float(first["solid_fraction"])
            # equal spheres that do not overlap: the void over what all lines meet of the surfaces
            exact = 4 * (1 - solid) / (3 * solid) * float(last["cutoff"])
            ratios = errors_from_null(cut)
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


CLAIMS = (
    claims.experiment, claims.counted, claims.isotropic_start, claims.off_diagonals, claims.rise,
    claims.parting, claims.smoothness, claims.normalised, claims.slopes, claims.predicted,
    claims.shell_stress, claims.tried, claims.harmonics, claims.hysteresis,
)  # fmt: skip
NUMBERS = (
    words.start_worst, words.off_share, words.lateral_share, words.contact_share, words.void_share,
    words.lagging,
    words.normalised_worst, words.slope_misses, words.pooled, words.disc_misses, words.disc_ratio,
    words.printed_radius, words.cutoff_slopes, words.predicted_off,
    words.null_tests, words.voids_left, words.reversal_pressure, words.slope_back,
    words.offset_back, words.printed_rv_grains, words.spacing_change, words.rv_contacts,
)  # fmt: skip
PARTS: dict[str, Callable[[], str]] = {
    **{claim.__name__: claim for claim in CLAIMS},
    "choices": choices,
    "summaries": summaries,
    "others": others,
    **{number.__name__: number for number in NUMBERS},
    **{
        f"{kind}_{name}": partial(words.shell_shares, names, kind)
        for kind in ("stress", "contacts")
        for name, names in (("smooth", in_shell()), ("rough", ["yade_rough"]))
    },
    "slope_small_rv": partial(words.rv_slope, f"{MAIN}_small-rv"),
    "overlap_usual": partial(words.overlap, MAIN),
    "overlap_stiff": partial(words.overlap, "yade_printed"),
    "best_cutoff_early": partial(words.best_cutoff, 0.05),
    "best_cutoff": partial(words.best_cutoff, 0.2),
    "contacts_back": partial(words.strain_back, "c"),
    "voids_back": partial(words.strain_back, "vs"),
    "order_four_contacts": partial(words.order_four, "c"),
    "order_four_voids": partial(words.order_four, "vs"),
    "order_four_discs": partial(words.order_four, "vs", plane=True),
    **{f"left_{percent}": partial(words.left_by_ends, percent / 100) for percent in (8, 12, 20)},
}


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
