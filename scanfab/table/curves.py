"""Curves of fabric tables, one for each source and variant, and their abscissa."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.row import Rows, column_of, groups_of, number_of, numbers_of, total_error

# columns of strains: in words, and as the symbol of figures
STRAINS = {
    "strain": ("axial strain", r"$\varepsilon_a$"),
    "shear_strain": ("shear strain", r"$\varepsilon_q$"),
}
# strains that differ by less are the same: rounding is no deformation
SAME = 1e-9
LONGEST_NAME = 32
# matplotlib cannot draw larger values, which would be infinite in units of the axis
LARGEST = 1e100
# Contact fabric is certainly anisotropic if its intensity is CERTAIN standard errors (without
# anisotropy it is about one), and turned if less than ALONG of it shows along the loading axis.
CERTAIN, ALONG = 5.0, 0.5


@dataclass(frozen=True, eq=False)
class Curve:
    """One source and variant over its frames."""

    source: str
    variant: str
    """With the size of its RV, where there are several."""
    x: FloatArray
    """Strain in per cent, or the number of the frame, shape (F,)."""
    rows: Rows
    """The rows of the curve."""

    def values(self, name: str) -> FloatArray:
        """A column of the table, shape (F,); NaN where there is no number that can be drawn."""
        return _drawable(column_of(self.rows, name))

    def errors(self, name: str) -> FloatArray:
        """Standard errors in a column; NaN where another program wrote a negative number."""
        return np.where(self.values(name) < 0, np.nan, self.values(name))

    def total_errors(self, name: str) -> FloatArray:
        """
        Errors of scan and sample for ``alpha_vs_axial``, of the sample for ``alpha_c_axial``.

        Where the sample's error is not known, contacts are taken as independent.
        """
        if name == "alpha_c_axial" and self.contact_alone:
            return self.errors("alpha_c_axial_se")
        found = np.array([total_error(row, name) for row in self.rows], np.float64)
        return np.where(found < 0, np.nan, _drawable(found))

    @property
    def contact_alone(self) -> bool:
        """Whether contacts are taken as independent."""
        return not np.isfinite(self.errors("alpha_c_axial_sample_se")).any()


def curves_of(rows: Iterable[Mapping[str, Any]]) -> list[Curve]:
    """The curves of a table, in the order in which they first appear."""
    rows = list(rows)
    abscissa = strain_column(rows)
    groups = groups_of(rows)
    names = short_names(source for source, _ in groups)
    return [
        Curve(
            names[source],
            variant,
            _drawable(column_of(group, abscissa or "frame")) * (100.0 if abscissa else 1.0),
            group,
        )
        for (source, variant), group in groups.items()
    ]


def _drawable(array: FloatArray) -> FloatArray:
    return np.where(np.abs(array) < LARGEST, array, np.nan)


def strain_column(rows: Rows) -> str | None:
    """
    The column with the strain of all frames of all sources.

    Parameters
    ----------
    rows : sequence of mapping
        Of fabric tables; those without a void fabric do not matter.

    Returns
    -------
    str or None
        ``strain``; ``shear_strain`` where the axial strain of a source is missing or the same in
        all its frames; None where that is so of both. Then frames have only their number.

    Examples
    --------
    >>> from scanfab.table.curves import strain_column
    >>> rows = [dict(source="s", frame=k, strain=0.0, shear_strain=0.1 * k, alpha_vs_axial=0.0)
    ...         for k in range(3)]
    >>> strain_column(rows)
    'shear_strain'
    """
    found = [name for name in STRAINS if not _lacking(rows, name)]
    return found[0] if found and numbers_of(rows, "alpha_vs_axial") else None


def why_not_strain(rows: Rows) -> str | None:
    """A hint that some sources lack an axial strain; None if all have one, or none has."""
    lacking = _lacking(rows, "strain")
    if not lacking or not numbers_of(rows, "strain"):
        return None
    instead, cure = "the frame's number", "says what length it is taken from"
    if strain_column(rows) is not None:
        instead, cure = "shear_strain", "takes another length"
    return (
        f"{instead} stands in for the axial strain, as {'; '.join(lacking)}: `strain` of compute "
        f"{cure}"
    )


def _lacking(rows: Rows, column: str) -> list[str]:
    """What is wrong with the strain of each source, in words."""
    sources: dict[str, dict[int, float | None]] = {}
    for row in rows:
        if number_of(row, "alpha_vs_axial") is not None:
            sources.setdefault(row["source"], {})[row["frame"]] = number_of(row, column)
    said = []
    for source, strains in sources.items():
        without = [frame for frame, strain in strains.items() if strain is None]
        known = [strain for strain in strains.values() if strain is not None]
        if without:
            said.append(f"{source} has none" + (f" in frame {without[0]}" if known else ""))
        elif len(known) > 1 and max(known) - min(known) < SAME:
            said.append(f"{source} has the same in all frames ({known[0]:g})")
    return said


def frame_strain_column(row: Mapping[str, Any]) -> str | None:
    """The strain column of a single frame, preferably one that is not 0 there."""
    known = [name for name in STRAINS if number_of(row, name) is not None]
    moved = [name for name in known if abs(row[name]) >= SAME]
    return next(iter([*moved, *known]), None)


def spelt_strain(row: Mapping[str, Any], column: str | None, *, symbol: bool = False) -> str:
    """
    The strain of a frame for its title; empty where there is none.

    Parameters
    ----------
    row : mapping
        Of a fabric table.
    column : str or None
        See :func:`strain_column`.
    symbol : bool, optional
        For a figure, where words take too much room.

    Examples
    --------
    >>> from scanfab.table.curves import spelt_strain
    >>> spelt_strain({"strain": 0.0, "shear_strain": 0.123}, "shear_strain")
    'shear strain 12.3 %'
    """
    value = None if column is None else number_of(row, column)
    if column is None or value is None:
        return ""
    words, sign = STRAINS[column]
    return f"{f'{sign} =' if symbol else words} {100 * value:.3g} %"


def abscissa_label(rows: Rows) -> str:
    """The label of the abscissa."""
    column = strain_column(rows)
    return "frame" if column is None else f"{' '.join(STRAINS[column])} in %"


def abscissa_words(rows: Rows) -> str:
    """The abscissa as words in a sentence."""
    column = strain_column(rows)
    return "the number of the frame" if column is None else f"the {STRAINS[column][0]}"


def is_turned(rows: Rows) -> bool:
    """
    Whether the axes of the fabric are not the loading axis, as in simple shear.

    The axial anisotropies then miss most of the fabric. The frame whose contacts are most certainly
    anisotropic decides; if none is, curves over the shear strain count as turned.
    """
    names = ("alpha_c", "alpha_c_axial", "alpha_c_axial_se", "alpha_vs")
    known = [row for row in rows if None not in [number_of(row, name) for name in names]]
    certainty, along = 0.0, 1.0
    for row in known:
        intensity, error = row["alpha_c"], row["alpha_c_axial_se"]
        if intensity > 0 and error > 0:
            axial = abs(row["alpha_c_axial"]) / intensity
            certainty, along = max((certainty, along), (intensity / error, axial))
    return along < ALONG if certainty > CERTAIN else strain_column(known) == "shear_strain"


def short_names(sources: Iterable[str], longest: int = LONGEST_NAME) -> dict[str, str]:
    """Short names of sources: the last part of the path, where that tells them apart."""
    sources = list(dict.fromkeys(sources))
    for kept in ([PurePath(source).name or source for source in sources], sources):
        names = [middle_out(name, longest) for name in kept]
        if len(set(names)) == len(names):
            break
    else:
        names = [f"{number}: {name}" for number, name in enumerate(names, 1)]
    return dict(zip(sources, names, strict=True))


def middle_out(name: str, longest: int) -> str:
    """A long name without its middle, as either end may be what matters."""
    if len(name) <= longest:
        return name
    half = (longest - 3) // 2
    return f"{name[:half]}...{name[-half:]}"
