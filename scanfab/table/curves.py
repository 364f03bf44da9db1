"""Rows of fabric tables as curves to draw: one for each source and variant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.abscissa import STRAINS, strain_column
from scanfab.table.reading import number_of, total_error, variant_of

Rows = Sequence[Mapping[str, Any]]

LONGEST_NAME = 32
# beyond it nothing can be drawn: in units of the axis it would be infinite
LARGEST = 1e100
# contact fabric is anisotropic for certain if its intensity is so many standard errors (about one
# without any anisotropy), and turned if less than this part of it shows along the loading axis
CERTAIN, ALONG = 5.0, 0.5


@dataclass(frozen=True, eq=False)
class Curve:
    """One source and variant over its frames; NaN where a value does not exist, shape (F,)."""

    source: str
    variant: str
    """With the size of its RV, where there are several."""
    x: FloatArray
    """Strain in per cent, or the number of the frame."""
    void: FloatArray
    """alpha_vs_axial, dimensionless."""
    void_scan: FloatArray
    """The scan's part of its standard error."""
    void_total: FloatArray
    """Its standard error, of scan and sample together."""
    contact: FloatArray
    """alpha_c_axial, dimensionless."""
    contact_total: FloatArray
    """Its standard error, which is the sample's; as if contacts were independent where the curve
    has no other."""
    contact_alone: bool
    """Whether contacts are taken as independent."""
    void_intensity: FloatArray
    """alpha_vs, dimensionless."""
    contact_intensity: FloatArray
    """alpha_c, dimensionless."""
    angle: FloatArray
    """Between both major axes, degrees."""
    rows: Rows
    """What it is made of."""

    def values(self, name: str) -> FloatArray:
        """Any column; NaN where there is no number."""
        return _array([number_of(row, name) for row in self.rows])


def curves_of(rows: Iterable[Mapping[str, Any]]) -> list[Curve]:
    """The curves of a table, in the order in which they first appear."""
    rows = list(rows)
    abscissa = strain_column(rows)
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["source"], variant_of(row)), []).append(row)
    names = short_names(source for source, _ in groups)
    return [
        _curve(names[source], variant, group, abscissa)
        for (source, variant), group in groups.items()
    ]


def abscissa_label(rows: Rows) -> str:
    """What the abscissa is."""
    column = strain_column(rows)
    return "frame" if column is None else f"{' '.join(STRAINS[column])} in %"


def abscissa_words(rows: Rows) -> str:
    """What the abscissa is, in a sentence."""
    column = strain_column(rows)
    return "the number of the frame" if column is None else f"the {STRAINS[column][0]}"


def is_turned(rows: Rows) -> bool:
    """
    Whether the axial anisotropies miss the fabric, as its axes are not the loading axis.

    So it is in simple shear. The frame whose contacts are most certainly anisotropic tells; where
    none is, so does what the frames are drawn over.
    """
    known = [row for row in rows if None not in _contact_intensity(row)]
    certainty, along = max(map(_certainty, known), default=(0.0, 1.0))
    return along < ALONG if certainty > CERTAIN else strain_column(known) == "shear_strain"


def _contact_intensity(row: Mapping[str, Any]) -> list[float | None]:
    names = ("alpha_c", "alpha_c_axial", "alpha_c_axial_se", "alpha_vs")
    return [number_of(row, name) for name in names]


def _certainty(row: Mapping[str, Any]) -> tuple[float, float]:
    """The intensity over its error, and the part of it that shows along the loading axis."""
    intensity, axial, error = row["alpha_c"], row["alpha_c_axial"], row["alpha_c_axial_se"]
    if intensity <= 0 or error <= 0:
        return 0.0, 1.0
    return intensity / error, abs(axial) / intensity


def _curve(source: str, variant: str, group: Rows, abscissa: str | None) -> Curve:
    def column(name: str) -> FloatArray:
        return _array([number_of(row, name) for row in group])

    sample = _error([total_error(row, "alpha_c_axial") for row in group])
    alone = not np.isfinite(sample).any()
    return Curve(
        source=source,
        variant=variant,
        x=column("frame") if abscissa is None else 100.0 * column(abscissa),
        void=column("alpha_vs_axial"),
        void_scan=_error([number_of(row, "alpha_vs_axial_se") for row in group]),
        void_total=_error([total_error(row, "alpha_vs_axial") for row in group]),
        contact=column("alpha_c_axial"),
        contact_total=(
            _error([number_of(row, "alpha_c_axial_se") for row in group]) if alone else sample
        ),
        contact_alone=alone,
        void_intensity=column("alpha_vs"),
        contact_intensity=column("alpha_c"),
        angle=column("coaxiality_deg"),
        rows=group,
    )


def _array(values: Iterable[float | None]) -> FloatArray:
    array = np.array([np.nan if value is None else value for value in values], np.float64)
    return np.where(np.abs(array) < LARGEST, array, np.nan)


def _error(values: Iterable[float | None]) -> FloatArray:
    """Tables come from anywhere: what is below zero is no error."""
    array = _array(values)
    return np.where(array < 0, np.nan, array)


def short_names(sources: Iterable[str], longest: int = LONGEST_NAME) -> dict[str, str]:
    """Sources by the last part of their path, and not too long, where that tells them apart."""
    sources = list(dict.fromkeys(sources))
    for shorten in (_last_part, str):
        names = {source: middle_out(shorten(source), longest) for source in sources}
        if len(set(names.values())) == len(names):
            return names
    return {source: f"{number}: {names[source]}" for number, source in enumerate(sources, 1)}


def _last_part(source: str) -> str:
    return PurePath(source).name or source


def middle_out(name: str, longest: int) -> str:
    """Both ends of a long name, as either may be what matters."""
    if len(name) <= longest:
        return name
    half = (longest - 3) // 2
    return f"{name[:half]}...{name[-half:]}"
