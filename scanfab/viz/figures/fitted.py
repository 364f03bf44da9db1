"""Figures of tables: the rows, the lines fitted to them, and the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.table.compare import compare_tables
from scanfab.table.comparison_rows import Comparison, SummaryRow
from scanfab.viz.figures.of_tables import TABLE_FIGURES, Fit, plot_table

__all__ = ["TABLE_FIGURES", "fits_of", "plot_rows"]


def plot_rows(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    name: str | None = None,
    comparison: Comparison | None = None,
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
    comparison : Comparison, optional
        Of these rows, with the lines to draw; it is made here, with its hints, if there is none.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """
    plot_table(path, rows, fits_of(comparison or compare_tables(rows)), name)


def fits_of(comparison: Comparison) -> list[Fit | None]:
    """The line of each source and variant as ``compare --summary`` has it; None without one."""
    return [
        _fit(one, points) for one, points in zip(comparison.summary, comparison.points, strict=True)
    ]


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
