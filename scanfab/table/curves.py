"""Curves of fabric tables: one for each source and variant, over strain, time or frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.table.row import Rows, column_of, groups_of, number_of, numbers_of, total_errors

# columns of strains, each with its name and its symbol in figures
STRAINS = {
    "strain": ("axial strain", r"$\varepsilon_a$"),
    "shear_strain": ("shear strain", r"$\varepsilon_q$"),
}
# what curves are drawn over, each with its label in figures and its words in a sentence
ABSCISSAS = {
    **{name: (f"{' '.join(one)} in %", f"the {one[0]}") for name, one in STRAINS.items()},
    "time": ("time (dump's unit)", "the time"),
    "step": ("time step", "the time step"),
    "frame": ("frame", "the number of the frame"),
}
# smaller differences between strains are rounding
SAME = 1e-9
LONGEST_NAME = 32
# matplotlib cannot draw larger values: they overflow when it scales them to the axis
LARGEST = 1e100
# The contact fabric counts as anisotropic if its intensity exceeds CERTAIN standard errors (noise
# alone gives about 1). It counts as turned if its anisotropy along the loading axis is less than
# ALONG times its intensity: of a fabric about another axis, across the loading axis, it is half.
CERTAIN, ALONG = 5.0, 0.6


@dataclass(frozen=True, eq=False)
class Curve:
    """The rows of one source and variant, over the frames."""

    source: str
    variant: str
    """Variant, with the size of its RV if there are several."""
    x: FloatArray
    """Strain in per cent, else time, time step or number of the frame, shape (F,)."""
    rows: Rows
    """The rows of the curve."""

    def values(self, name: str) -> FloatArray:
        """A column of the table, shape (F,); NaN if a value is missing or cannot be drawn."""
        return _drawable(column_of(self.rows, name))

    def errors(self, name: str) -> FloatArray:
        """Standard errors in a column; NaN for negative numbers, which other programs may write."""
        return np.where(self.values(name) < 0, np.nan, self.values(name))

    def total_errors(self, name: str) -> FloatArray:
        """
        Standard error that combines scan and sample for ``alpha_vs_axial``, shape (F,).

        For ``alpha_c_axial`` it is the sample's error; if the table lacks it, the error is that of
        independent contacts.
        """
        if name == "alpha_c_axial" and self.contact_alone:
            return self.errors("alpha_c_axial_se")
        errors = total_errors(self.rows, name)
        return np.where(errors < 0, np.nan, _drawable(errors))

    @property
    def contact_alone(self) -> bool:
        """Whether errors of the contact fabric are those of independent contacts."""
        return not np.isfinite(self.errors("alpha_c_axial_sample_se")).any()


def curves_of(rows: Iterable[Mapping[str, Any]]) -> list[Curve]:
    """The curves of a table, in the order of their first rows."""
    rows = list(rows)
    name = abscissa(rows)
    factor = 100.0 if name in STRAINS else 1.0
    groups = groups_of(rows)
    names = short_names(source for source, _ in groups)
    return [
        Curve(names[source], variant, factor * _drawable(column_of(group, name)), group)
        for (source, variant), group in groups.items()
    ]


def have_errors(curves: Iterable[Curve], column: str) -> bool:
    """Whether some total error of an anisotropy is known."""
    return any(np.isfinite(curve.total_errors(column)).any() for curve in curves)


def _drawable(array: FloatArray) -> FloatArray:
    return np.where(np.abs(array) < LARGEST, array, np.nan)


def strain_column(rows: Rows) -> str | None:
    """
    Choose the column of strain that suits all frames of all sources.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of fabric tables; rows without a void fabric are ignored.

    Returns
    -------
    str or None
        ``strain``. If the axial strain of a source is missing or the same in all its frames,
        ``shear_strain``. If that holds for both strains, None: use the frame number.

    Examples
    --------
    >>> from scanfab.table.curves import strain_column
    >>> rows = [dict(source="s", frame=k, strain=0.0, shear_strain=0.1 * k, alpha_vs_axial=0.0)
    ...         for k in range(3)]
    >>> strain_column(rows)
    'shear_strain'
    """
    usable = [name for name in STRAINS if not _lacking(rows, name)]
    return usable[0] if usable and numbers_of(rows, "alpha_vs_axial") else None


def why_not_strain(rows: Rows) -> str | None:
    """A hint about sources without a useful axial strain; None if all have one, or no source."""
    lacking = _lacking(rows, "strain")
    if not lacking or not numbers_of(rows, "strain"):
        return None
    instead = ABSCISSAS[abscissa(rows)][1]
    why = f"is used, because {'; '.join(lacking)}"
    return f"{instead} {why}: `strain` of compute can measure it by another length"


def _lacking(rows: Rows, column: str) -> list[str]:
    """Describe the sources whose strain is missing or the same in all frames."""
    sources: dict[str, dict[int, float | None]] = {}
    for row in rows:
        if number_of(row, "alpha_vs_axial") is not None:
            sources.setdefault(row["source"], {})[row["frame"]] = number_of(row, column)
    problems = []
    for source, strains in sources.items():
        without = [frame for frame, strain in strains.items() if strain is None]
        known = [strain for strain in strains.values() if strain is not None]
        if without:
            where = f" in frame {without[0]}" if known else ""
            problems.append(f"{source} has no axial strain{where}")
        elif len(known) > 1 and max(known) - min(known) < SAME:
            problems.append(f"the axial strain of {source} is {known[0]:g} in all frames")
    return problems


def frame_strain_column(row: Mapping[str, Any]) -> str | None:
    """The strain column for a single frame, preferably with a strain that is not 0."""
    present = [name for name in STRAINS if number_of(row, name) is not None]
    moved = [name for name in present if abs(row[name]) >= SAME]
    return next(iter([*moved, *present]), None)


def spelt_strain(row: Mapping[str, Any], column: str | None, *, symbol: bool = False) -> str:
    """
    The strain of a frame for a title; empty if there is none.

    Parameters
    ----------
    row : mapping
        Row of a fabric table.
    column : str or None
        Column of the strain, from :func:`strain_column`.
    symbol : bool, optional
        Write the symbol in place of the words, which take more room.

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


def abscissa(rows: Rows) -> str:
    """The column over which curves are drawn: a strain, else the first that all frames have."""
    if column := strain_column(rows):
        return column
    for name in ("time", "step"):
        places = {(row["source"], row["frame"]): number_of(row, name) for row in rows}
        if None not in places.values() and len(set(places.values())) > 1:
            return name
    return "frame"


def is_turned(rows: Rows) -> bool:
    """
    Whether the fabric is turned away from the loading axis, as in simple shear.

    The axial anisotropies of a turned fabric miss most of it. The frame with the largest ratio of
    contact anisotropy to error decides. If no frame is clearly anisotropic, the fabric counts as
    turned when the shear strain is the abscissa.
    """
    names = ("alpha_c", "alpha_c_axial", "alpha_c_axial_se", "alpha_vs")
    complete = [row for row in rows if None not in [number_of(row, name) for name in names]]
    certainty, along = 0.0, 1.0
    for row in complete:
        intensity, error = row["alpha_c"], row["alpha_c_axial_se"]
        if intensity > 0 and error > 0:
            axial = abs(row["alpha_c_axial"]) / intensity
            certainty, along = max((certainty, along), (intensity / error, axial))
    return along < ALONG if certainty > CERTAIN else strain_column(complete) == "shear_strain"


def short_names(sources: Iterable[str], longest: int = LONGEST_NAME) -> dict[str, str]:
    """Short names of sources: the last part of each path if these differ, else the path."""
    sources = list(dict.fromkeys(sources))
    last = [PurePath(source).name or source for source in sources]
    short = ([middle_out(name, longest) for name in names] for names in (last, sources))
    names = next(names for names in (*short, sources) if len(set(names)) == len(names))
    return dict(zip(sources, names, strict=True))


def middle_out(name: str, longest: int) -> str:
    """Shorten a long name in the middle, because either end may be what tells it apart."""
    if len(name) <= longest:
        return name
    half = (longest - 3) // 2
    return f"{name[:half]}...{name[-half:]}"
