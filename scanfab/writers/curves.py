"""Rows of fabric tables as curves to draw: one for each source and variant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.tabular import number_of

__all__ = ["Curve", "abscissa_label", "curves_of"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Curve:
    """One source and variant over its frames; NaN where a value does not exist, shape (F,)."""

    source: str
    variant: str
    x: FloatArray
    """Axial strain in per cent, or the number of the frame."""
    void: FloatArray
    """alpha_vs_axial, dimensionless."""
    void_scan: FloatArray
    """Its standard error from the scan."""
    void_sample: FloatArray
    """Its standard error from the sample."""
    contact: FloatArray
    """alpha_c_axial, dimensionless."""
    contact_sample: FloatArray
    """Its standard error: from the sample if the table has it, else as if contacts were
    independent."""


def curves_of(rows: Iterable[Mapping[str, Any]]) -> list[Curve]:
    """The curves of a table, in the order in which they first appear."""
    rows = list(rows)
    use_strain = has_strain(rows)
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["source"], row["variant"]), []).append(row)
    names = _short({source for source, _ in groups})
    return [
        _curve(names[source], variant, group, use_strain)
        for (source, variant), group in groups.items()
    ]


def has_strain(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether every row has a strain; otherwise the frame's number is the abscissa."""
    return bool(rows) and all(row["strain"] is not None for row in rows)


def abscissa_label(rows: Sequence[Mapping[str, Any]]) -> str:
    """What the abscissa is."""
    return r"axial strain $\varepsilon_a$ in %" if has_strain(rows) else "frame"


def _curve(
    source: str, variant: str, group: Sequence[Mapping[str, Any]], use_strain: bool
) -> Curve:
    def column(name: str) -> FloatArray:
        values = [number_of(row, name) for row in group]
        array = np.array([np.nan if value is None else value for value in values], np.float64)
        return np.where(array < 0, np.nan, array) if name.endswith("_se") else array

    sample = column("alpha_c_axial_sample_se")
    return Curve(
        source=source,
        variant=variant,
        x=100.0 * column("strain") if use_strain else column("frame"),
        void=column("alpha_vs_axial"),
        void_scan=column("alpha_vs_axial_se"),
        void_sample=column("alpha_vs_axial_sample_se"),
        contact=column("alpha_c_axial"),
        contact_sample=np.where(np.isnan(sample), column("alpha_c_axial_se"), sample),
    )


def _short(sources: set[str]) -> dict[str, str]:
    """Sources by the last part of their path where that tells them apart."""
    last = {source: PurePath(source).name or source for source in sources}
    return last if len(set(last.values())) == len(last) else {source: source for source in sources}
