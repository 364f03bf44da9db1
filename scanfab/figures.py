"""Figures of tables: the rows, the lines fitted to them, and the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.compare import SummaryRow, compare_tables, fitted_points
from scanfab.writers.plot_table import TABLE_FIGURES, Fit, plot_table

__all__ = ["TABLE_FIGURES", "fits_of", "plot_rows"]


def plot_rows(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    name: str | None = None,
    strain_max: float | None = None,
) -> None:
    """
    Draw a fabric table.

    Parameters
    ----------
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    rows : sequence of mapping
        Rows by column, as :func:`scanfab.read_rows` returns them.
    name : str, optional
        ``evolution``, ``normalised`` or ``correlation``; all on one page by default.
    strain_max : float, optional
        Leave frames beyond this strain out of the fitted lines.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """
    plot_table(path, rows, fits_of(rows, strain_max), name)


def fits_of(rows: Sequence[Mapping[str, Any]], strain_max: float | None = None) -> list[Fit | None]:
    """The line of each source and variant as ``compare --summary`` has it; None without one."""
    summary = compare_tables(rows, strain_max=strain_max).summary
    points = fitted_points(rows, strain_max)
    return [_fit(one, group) for one, group in zip(summary, points, strict=True)]


def _fit(summary: SummaryRow, points: npt.NDArray[np.float64]) -> Fit | None:
    if summary.slope is None:
        return None
    middle = points.mean(axis=0)
    return Fit(
        slope=summary.slope,
        slope_se=summary.slope_se,
        r2=summary.r2,
        contact=(float(points[:, 0].min()), float(points[:, 0].max())),
        middle=(float(middle[0]), float(middle[1])),
    )
