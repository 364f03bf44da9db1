"""The tables of the report: results, frames and inputs, spelt for readers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scanfab.base.option import flag_of
from scanfab.pipeline.options import MEANINGS
from scanfab.pipeline.repeat import given_settings
from scanfab.table.curves import STRAINS, is_turned, spelt_strain, strain_column
from scanfab.table.row import Row as TableRow
from scanfab.table.row import number_of, numbers_of, total_error, variant_of
from scanfab.viz.report.page import Part

Row = Mapping[str, Any]

# frames of a source and variant that the table shows
MOST_FRAMES = 12
MOST_INPUTS = 20
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"

TURNED = (
    "The loading axis is not the axis of the contact fabric, as in simple shear, so no line of the "
    "values along it is given. Intensities are largest minus smallest principal value, whichever "
    "way the axes point: never negative, so noise raises them. The table has no errors of them."
)

# columns of the frame table behind the anisotropies, by the name that readers see
MORE_COLUMNS = {
    "grains": "grains",
    "rattlers": "rattlers",
    "contacts": "contacts",
    "coordination": "coordination",
    "solid_fraction": "solid fraction",
    "mean_length": "mean void length",
    "segments": "void segments",
}


def overview(table: Path, rows: Sequence[Row]) -> str:
    """What was measured, in a sentence."""
    if not rows:
        return f"{table}: an empty table."
    sources = list(dict.fromkeys(str(row["source"]) for row in rows))
    frames = len({(row["source"], row["frame"]) for row in rows})
    variants = ", ".join(sorted({str(row["variant"]) for row in rows}))
    column = strain_column(rows)
    parts = [
        f"{frames} {'frame' if frames == 1 else 'frames'} of {', '.join(sources)}",
        f"variants {variants}",
    ]
    if numbers_of(rows, "grains"):
        parts.append(_grains(rows))
    if column is not None:
        strains = [f"{100 * strain:.3g}" for strain in sorted(numbers_of(rows, column))]
        parts.append(f"{STRAINS[column][0]} {_span(strains)} %")
    return "; ".join(parts) + "."


def _grains(rows: Sequence[Row]) -> str:
    """How many grains each variant has, which are all, those in the RV, or those that carry."""
    of_variant = {}
    for variant in sorted(set(map(variant_of, rows))):
        own = numbers_of([row for row in rows if variant_of(row) == variant], "grains")
        of_variant[variant] = _span([f"{one:.0f}" for one in sorted(own)]) if own else "-"
    if len(set(of_variant.values())) == 1:
        return f"{next(iter(of_variant.values()))} grains"
    return f"grains: {', '.join(f'{number} in {name}' for name, number in of_variant.items())}"


def _span(values: Sequence[str]) -> str:
    """From the first to the last, if they differ as they are spelt."""
    return values[0] if values[0] == values[-1] else f"{values[0]} to {values[-1]}"


def results_tables(summary: Iterable[TableRow], rows: Sequence[Row]) -> list[Part]:
    """A table for each source: a column for each variant, the key numbers first."""
    sources: dict[str, list[TableRow]] = {}
    for one in summary:
        sources.setdefault(one.source, []).append(one)
    return [_results(source, lines, rows) for source, lines in sources.items()]


def _results(source: str, summary: Sequence[TableRow], rows: Sequence[Row]) -> Part:
    ends = [_ends(one, rows) for one in summary]
    first, last = [one[0] for one in ends], [one[1] for one in ends]
    column = strain_column([row for row in rows if row["source"] == source])
    strains = {spelt_strain(row, column) for row in (*first, *last)}
    if len(strains) < 2:
        column = None
    here, there = _where("last", last, column), _where("first", first, column)
    if is_turned([row for row in rows if row["source"] == source]):
        return _turned_results(source, summary, rows, (here, there))
    lines = [
        (f"α_vs{here}", [_value(row, VOID) for row in last]),
        ("its error: scan", [_spell_error(number_of(row, f"{VOID}_se")) for row in last]),
        ("its error: sample", [_spell_error(number_of(row, f"{VOID}_sample_se")) for row in last]),
        (f"α_c{here}", [_value(row, CONTACT) for row in last]),
    ]
    if first != last:
        lines += [
            (f"α_vs{there}", [_value(row, VOID) for row in first]),
            (f"α_c{there}", [_value(row, CONTACT) for row in first]),
            ("slope of α_vs on α_c", [_with_error(one.slope, one.slope_se) for one in summary]),
            ("R² of that line", [_spell(one.r2) for one in summary]),
            ("largest α_vs", [_spell(one.peak) for one in summary]),
            ("frames in the line", [str(one.frames) for one in summary]),
        ]
    return _part(source, summary, lines)


def _part(
    source: str,
    summary: Sequence[TableRow],
    lines: Sequence[tuple[str, Sequence[str]]],
    note: str = "",
) -> Part:
    """The lines that are known of some variant."""
    shown = [[name, *cells] for name, cells in lines if any(cell != "-" for cell in cells)]
    return Part(["variant", *map(variant_of, summary)], shown, note, source)


def _turned_results(
    source: str, summary: Sequence[TableRow], rows: Sequence[Row], where: tuple[str, str]
) -> Part:
    """
    Of a source whose axes are turned: what is seen whichever way they point, as in its figures.

    There is no line, as the axial values that it would be fitted to miss the fabric.
    """
    ends = [_ends(one, rows) for one in summary]
    lines: list[tuple[str, list[str]]] = []
    for place, at in zip((1, 0), where, strict=True):
        lines += [
            (f"intensity α_vs{at}", [_intensity(row[place], VOID) for row in ends]),
            (f"intensity α_c{at}", [_intensity(row[place], CONTACT) for row in ends]),
            (f"angle between their axes{at}", [_degrees(row[place]) for row in ends]),
            (f"α_vs along the loading axis{at}", [_value(row[place], VOID) for row in ends]),
        ]
    return _part(source, summary, list(dict(lines).items()), TURNED)


def _intensity(row: Row, axial: str) -> str:
    """The table has no error of it; it has the digits that the error of the axial value leaves."""
    error = total_error(row, axial) or number_of(row, f"{axial}_se")
    return _with_error(number_of(row, axial.removesuffix("_axial")), error).partition(" ±")[0]


def _degrees(row: Row) -> str:
    angle = number_of(row, "coaxiality_deg")
    return "-" if angle is None else f"{angle:.0f}°"


def _ends(one: TableRow, rows: Sequence[Row]) -> tuple[Row, Row]:
    """The first and the last row of a source and variant that have a void fabric."""
    group = [
        row
        for row in rows
        if (row["source"], variant_of(row)) == (one.source, variant_of(one))
        and row[VOID] is not None
    ]
    return (group[0], group[-1]) if group else ({}, {})


def _where(which: str, rows: Sequence[Row], column: str | None) -> str:
    """At which strain or in which frame, if it is the same for all variants."""
    row = next((row for row in rows if row), {})
    if not row or len({one["frame"] for one in rows if one}) > 1:
        return f", {which} frame that has one"
    strain = spelt_strain(row, column)
    return f" at {strain}" if strain else f", frame {row['frame']}"


def _value(row: Row, name: str) -> str:
    """With the total error; without one, the digits that the scan's error leaves."""
    value, error = number_of(row, name), total_error(row, name)
    if error is None:
        return _with_error(value, number_of(row, f"{name}_se")).partition(" ±")[0]
    return _with_error(value, error)


def _with_error(value: float | None, error: float | None) -> str:
    """A small number, with two digits of its error if that is known."""
    if value is None:
        return "-"
    if error is None or error <= 0:
        return f"{value:.5f}"
    # of the rounded error: 0.00099999 has the digits of 0.0010
    digits = max(0, 1 - math.floor(math.log10(float(f"{error:.1e}"))))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _spell_error(error: float | None) -> str:
    return "-" if error is None else f"{error:#.2g}"


def _spell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def frame_table(rows: Sequence[Row]) -> Part:
    """Some frames, with the anisotropies and their errors in the first columns."""
    numbers = list(dict.fromkeys((row["source"], row["frame"]) for row in rows))
    step = -(-len(numbers) // MOST_FRAMES)
    shown = {*numbers[::step], numbers[-1]}
    sources = {row["source"] for row in rows}
    # of a source whose strain tells its frames apart badly, what is known of it
    column = {
        source: strain_column([row for row in rows if row["source"] == source]) or "strain"
        for source in sources
    }
    turned = is_turned(rows)
    table = [
        _frame_line(row, column[row["source"]], len(sources) > 1, turned)
        for row in rows
        if (row["source"], row["frame"]) in shown
    ]
    columns = [name for name in table[0] if any(line[name] != "-" for line in table)]
    note = "" if len(shown) == len(numbers) else f"{len(shown)} of {len(numbers)} frames are shown."
    return Part(columns, [[line[name] for name in columns] for line in table], note)


def _frame_line(row: Row, column: str, several: bool, turned: bool) -> dict[str, str]:
    """The cells of a row, those first that tell most."""
    strain = number_of(row, column)
    intensities = {
        "void intensity": _intensity(row, VOID),
        "contact intensity": _intensity(row, CONTACT),
        "angle": _degrees(row) if turned else "-",
    }
    spelt = "-" if strain is None else f"{100 * strain:.3g} %"
    return {
        "frame": str(row["frame"]),
        "variant": variant_of(row),
        "strain": spelt if column == "strain" else "-",
        "shear strain": spelt if column == "shear_strain" else "-",
        **(intensities if turned else {}),
        "α_vs": _value(row, VOID).partition(" ±")[0],
        "± total": _spell_error(total_error(row, VOID)),
        "scan": _spell_error(number_of(row, f"{VOID}_se")),
        "sample": _spell_error(number_of(row, f"{VOID}_sample_se")),
        "α_c": _value(row, CONTACT).partition(" ±")[0],
        "± of α_c": _spell_error(total_error(row, CONTACT)),
        **{title: _spell(_number(row, name)) for name, title in MORE_COLUMNS.items()},
        **({} if turned else intensities),
        "source": str(row["source"]) if several else "-",
    }


def _number(row: Row, name: str) -> int | float | None:
    """As it stands in the table, so that counts stay whole."""
    return None if number_of(row, name) is None else row[name]


def input_table(manifest: Mapping[str, Any]) -> Part:
    """The files with size and hash, not more than fit."""
    files = list(manifest.get("inputs") or [])
    lines = [
        [str(one.get("path")), str(one.get("size")), str(one.get("sha256"))]
        for one in files[:MOST_INPUTS]
    ]
    more = len(files) - len(lines)
    note = f"and {more} more, in the manifest" if more else ""
    return Part(["file", "bytes", "SHA-256"], lines, note)


def settings_table(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting of a manifest."""
    given = given_settings(asked)
    return [
        (
            flag_of(name)[2:],
            _plain(given.get(name, "auto" if name in ("spacing", "directions") else "-")),
            MEANINGS.get(name, ""),
        )
        for name in asked
        if name not in ("scanfab", "sources")
    ]


def _plain(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}={item}" for key, item in value.items())
    return str(value)
