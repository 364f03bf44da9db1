"""What a report is made of: tables, each read once, with the manifests beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scanfab.base.errors import SettingsError
from scanfab.pipeline.record import read_manifest
from scanfab.table.curves import spelt_strain, strain_column
from scanfab.table.formats import read_rows
from scanfab.table.row import numbers_of
from scanfab.table.selection import choose_rows


@dataclass(frozen=True)
class Input:
    """One table, its rows, and the manifest beside it."""

    path: Path
    rows: list[dict[str, Any]]
    manifest: dict[str, Any] | None
    cutoff: float | None
    """The one whose rows were chosen from several."""

    @property
    def first_series(self) -> list[dict[str, Any]]:
        """The rows of the first source, which is the one that can be looked at."""
        return [row for row in self.rows if row["source"] == self.rows[0]["source"]]

    @property
    def last_frame(self) -> int:
        """Of the first series, if possible with a void fabric."""
        own = self.first_series
        filled = [row for row in own if row["alpha_vs_axial"] is not None]
        return int(max(numbers_of(filled, "frame") or numbers_of(own, "frame"), default=0))

    def strain_of(self, frame: int) -> str:
        """In words; empty where the frames of the series have no strain to be told apart by."""
        own = self.first_series
        found = [row for row in own if row["frame"] == frame]
        return spelt_strain(found[0], strain_column(own)) if found else ""


def read_inputs(
    tables: Sequence[Path], cutoff: float | None = None, labels: Sequence[str] | None = None
) -> list[Input]:
    """
    Read tables and manifests.

    Raises
    ------
    ScanfabError
        If one cannot be read or is no fabric table, or if no table has a row.
    """
    read = [(path, [_completed(path, row) for row in read_rows(path)]) for path in tables]
    chosen = choose_rows(read, cutoff, labels)
    inputs = [
        Input(path, rows, read_manifest(path), cutoff)
        for path, rows in zip(tables, chosen, strict=True)
    ]
    if not any(one.rows for one in inputs):
        raise SettingsError(
            f"{', '.join(map(str, tables))}: there is nothing to report: no row in the table"
        )
    return inputs


def _completed(path: Path, row: dict[str, Any]) -> dict[str, Any]:
    """A row of a table of few columns: what a report can do without is empty."""
    if "frame" not in row or "variant" not in row:
        return row
    return {"source": path.stem, "strain": None, **row}
