"""What fabric tables are drawn and fitted over: the axial strain, the shear strain, or frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scanfab.table.reading import number_of

Rows = Sequence[Mapping[str, Any]]

# columns of strains: in words, and as the symbol of figures
STRAINS = {
    "strain": ("axial strain", r"$\varepsilon_a$"),
    "shear_strain": ("shear strain", r"$\varepsilon_q$"),
}
# strains that differ by less are one strain: a rounding error is no deformation
SAME = 1e-9


def strain_column(rows: Rows) -> str | None:
    """
    The column that tells how far the frames of all sources have deformed.

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
    >>> from scanfab.table.abscissa import strain_column
    >>> rows = [dict(source="s", frame=k, strain=0.0, shear_strain=0.1 * k, alpha_vs_axial=0.0)
    ...         for k in range(3)]
    >>> strain_column(rows)
    'shear_strain'
    """
    found = [name for name in STRAINS if not _lacking(rows, name)]
    return found[0] if found and any(map(_is_drawn, rows)) else None


def frame_strain_column(row: Mapping[str, Any]) -> str | None:
    """That column for a single frame, which is not 0 there if either strain is not."""
    known = [name for name in STRAINS if number_of(row, name) is not None]
    moved = [name for name in known if abs(row[name]) >= SAME]
    return next(iter([*moved, *known]), None)


def is_ambiguous(row: Mapping[str, Any]) -> bool:
    """Whether a single frame has both strains and neither has begun: other frames must tell."""
    values = [number_of(row, name) for name in STRAINS]
    return all(value is not None and abs(value) < SAME for value in values)


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
    >>> from scanfab.table.abscissa import spelt_strain
    >>> spelt_strain({"strain": 0.0, "shear_strain": 0.123}, "shear_strain")
    'shear strain 12.3 %'
    """
    value = None if column is None else number_of(row, column)
    if column is None or value is None:
        return ""
    words, sign = STRAINS[column]
    return f"{f'{sign} =' if symbol else words} {100 * value:.3g} %"


def why_not_strain(rows: Rows) -> str | None:
    """A hint if the axial strain of some source is no abscissa; None if all have one, or none."""
    lacking = _lacking(rows, "strain")
    if not lacking or all(number_of(row, "strain") is None for row in rows):
        return None
    shear = strain_column(rows) == "shear_strain"
    instead, cure = (
        ("shear_strain", "`strain` of compute takes another length")
        if shear
        else ("the frame's number", "`strain` of compute says what length it is taken from")
    )
    return f"{instead} stands in for the axial strain, as {'; '.join(lacking)}: {cure}"


def _is_drawn(row: Mapping[str, Any]) -> bool:
    return number_of(row, "alpha_vs_axial") is not None


def _lacking(rows: Rows, column: str) -> list[str]:
    """What is wrong with the strain of each source, in words."""
    sources: dict[str, dict[int, float | None]] = {}
    for row in filter(_is_drawn, rows):
        sources.setdefault(row["source"], {})[row["frame"]] = number_of(row, column)
    said = ((source, _flaw(strains)) for source, strains in sources.items())
    return [f"{source} has {flaw}" for source, flaw in said if flaw is not None]


def _flaw(strains: Mapping[int, float | None]) -> str | None:
    known = [strain for strain in strains.values() if strain is not None]
    if not known:
        return "none"
    if len(known) < len(strains):
        frame = next(frame for frame, strain in strains.items() if strain is None)
        return f"none in frame {frame}"
    if len(known) > 1 and max(known) - min(known) < SAME:
        return f"the same in all frames ({known[0]:g})"
    return None
