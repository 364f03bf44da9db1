"""The ladders of a calibration as a figure of four panels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scanfab.writers.plot import LOOKS, check_plot_file, new_figure, save_figure

__all__ = ["plot_calibration"]

# ladder: label of the axis, whether it is logarithmic, and the paper's choice
PANELS: dict[str, tuple[str, bool, float | None]] = {
    "spacing": ("spacing of lines $s/r_{min}$", True, 0.1),
    "directions": ("number of directions", True, None),
    "cutoff": ("cut-off $c/r_{min}$", False, 1.0),
    "rv": ("RV radius / half extent of the sample", False, 0.67),
}


def plot_calibration(rows: Sequence[Any], path: Path) -> None:
    """
    Draw alpha_vs_axial over each ladder, with the scan's standard errors.

    Parameters
    ----------
    rows : sequence of StepRow
        Of :func:`scanfab.calibrate`; lengths of the axes are relative to r_min.
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    SettingsError
        If the file's name ends otherwise.
    """
    check_plot_file(path)
    with new_figure(7.0, 5.2) as figure:
        panels = figure.subplots(2, 2).ravel()
        for panel, ladder in zip(panels, PANELS, strict=True):
            _draw(panel, [row for row in rows if row.ladder == ladder], ladder)
        panels[0].legend(title="variant")
        figure.supxlabel(
            "bars: standard error of the scan; bands: of the sample; dotted: the choice of the "
            "paper",
            fontsize="medium",
        )
        save_figure(figure, path)


def _draw(panel: Any, rows: Sequence[Any], ladder: str) -> None:
    """One ladder: a curve for each variant, with the sample's own error as a band."""
    label, logarithmic, paper = PANELS[ladder]
    for variant in sorted({row.variant for row in rows}):
        steps = [r for r in rows if r.variant == variant and r.alpha_vs_axial is not None]
        values = [row.value for row in steps]
        alphas = [row.alpha_vs_axial for row in steps]
        colour = LOOKS[variant]["color"]
        own = [row.alpha_vs_axial_sample_se or 0.0 for row in steps]
        if ladder in ("cutoff", "rv"):
            low, high = (
                [a + sign * e for a, e in zip(alphas, own, strict=True)] for sign in (-1, 1)
            )
            panel.fill_between(values, low, high, color=colour, alpha=0.15, linewidth=0)
        panel.errorbar(
            values,
            alphas,
            yerr=[row.alpha_vs_axial_se or 0.0 for row in steps],
            label=variant,
            **LOOKS[variant],
        )
    if paper is not None:
        panel.axvline(paper, color="0.6", linewidth=0.8, linestyle=":")
    if logarithmic:
        panel.set_xscale("log")
    panel.set_xlabel(label)
    panel.set_ylabel(r"$\alpha_{vs}$, axial")
    panel.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2))
