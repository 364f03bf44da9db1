"""The tables of the report as text: results, frames, inputs and settings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.option import flag_of
from scanfab.pipeline.options import MEANINGS
from scanfab.pipeline.record import HIDDEN, given_settings
from scanfab.table.curves import STRAINS, is_turned, spelt_strain, strain_column
from scanfab.table.row import Row as TableRow
from scanfab.table.row import groups_of, number_of, numbers_of, total_error, variant_of

Row = Mapping[str, Any]

# The table shows at most about so many frames of a source and variant.
MOST_FRAMES = 12
MOST_INPUTS, MOST_BLOCKS = 20, 200
PLACES = ("x", "y", "z", "r_inner", "r_outer")
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"

TURNED = (
    "The loading axis is not the axis of the contact fabric, as in simple shear, so no line of the "
    "values along it is given. Intensities are largest minus smallest principal value, whichever "
    "way the axes point: never negative, so noise raises them. The table has no errors of them."
)

# Further columns of the frame table, with the titles that readers see.
MORE_COLUMNS = {
    "grains": "grains",
    "rattlers": "rattlers",
    "contacts": "contacts",
    "coordination": "coordination",
    "solid_fraction": "solid fraction",
    "mean_length": "mean void length",
    "segments": "void segments",
}


class Part(NamedTuple):
    """A table of texts."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    title: str = ""


def overview(table: Path, rows: Sequence[Row]) -> str:
    """Summarise in a sentence what was measured."""
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
        # variants count all grains, grains in the RV, or grains without rattlers
        grains = {
            variant: _span([row for row in rows if variant_of(row) == variant], "grains", ".0f")
            for variant in sorted(set(map(variant_of, rows)))
        }
        each = ", ".join(f"{number} in {variant}" for variant, number in grains.items())
        same = len(set(grains.values())) == 1
        parts.append(f"{next(iter(grains.values()))} grains" if same else f"grains: {each}")
    if column is not None:
        parts.append(f"{STRAINS[column][0]} {_span(rows, column, '.3g', 100)} %")
    return "; ".join(parts) + "."


def _span(rows: Sequence[Row], column: str, spelling: str, factor: float = 1.0) -> str:
    """Spell the smallest and the largest number of a column; one of them if both look alike."""
    values = sorted(numbers_of(rows, column))
    ends = [f"{factor * value:{spelling}}" for value in (*values[:1], *values[-1:])]
    return " to ".join(dict.fromkeys(ends)) or "-"


def results_tables(summary: Iterable[TableRow], rows: Sequence[Row]) -> list[Part]:
    """A table for each source, with a column for each variant."""
    sources: dict[str, list[TableRow]] = {}
    for one in summary:
        sources.setdefault(one.source, []).append(one)
    return [
        _results(source, lines, [row for row in rows if row["source"] == source])
        for source, lines in sources.items()
    ]


def _results(source: str, summary: Sequence[TableRow], rows: Sequence[Row]) -> Part:
    filled = groups_of(row for row in rows if row[VOID] is not None)
    each = [filled.get((source, variant_of(one)), [{}]) for one in summary]
    first, last = [one[0] for one in each], [one[-1] for one in each]
    column = strain_column(rows)
    if len({spelt_strain(row, column) for row in (*first, *last)}) < 2:
        column = None
    here, there = _where("last", last, column), _where("first", first, column)
    lines: dict[str, list[str]] = {}
    if is_turned(rows):
        # no line is fitted, as axial values miss a fabric with turned axes
        for ends, at in ((last, here), (first, there)):
            lines |= {
                f"intensity α_vs{at}": [_intensity(row, VOID) for row in ends],
                f"intensity α_c{at}": [_intensity(row, CONTACT) for row in ends],
                f"angle between their axes{at}": [_degrees(row) for row in ends],
                f"α_vs along the loading axis{at}": [_value(row, VOID) for row in ends],
            }
    else:
        lines = {
            f"α_vs{here}": [_value(row, VOID) for row in last],
            "its error: scan": [_error(row, f"{VOID}_se") for row in last],
            "its error: sample": [_error(row, f"{VOID}_sample_se") for row in last],
            f"α_c{here}": [_value(row, CONTACT) for row in last],
        }
    if first != last and not is_turned(rows):
        lines |= {
            f"α_vs{there}": [_value(row, VOID) for row in first],
            f"α_c{there}": [_value(row, CONTACT) for row in first],
            "slope of α_vs on α_c": [_with_error(one.slope, one.slope_se) for one in summary],
            "R² of that line": [_spell(one.r2) for one in summary],
            "largest α_vs": [_spell(one.peak) for one in summary],
            "frames in the line": [str(one.frames) for one in summary],
        }
    # leave out lines that are empty for all variants
    shown = [[name, *cells] for name, cells in lines.items() if any(one != "-" for one in cells)]
    note = TURNED if is_turned(rows) else ""
    return Part(["variant", *map(variant_of, summary)], shown, note, source)


def _where(which: str, rows: Sequence[Row], column: str | None) -> str:
    """Spell the strain or the frame, if it is the same for all variants."""
    row = next((row for row in rows if row), {})
    if not row or len({one["frame"] for one in rows if one}) > 1:
        return f", {which} frame that has one"
    strain = spelt_strain(row, column)
    return f" at {strain}" if strain else f", frame {row['frame']}"


def _value(row: Row, name: str) -> str:
    """Spell a value with its total error, or with the digits that the scan's error allows."""
    error = total_error(row, name)
    if error is None:
        return _with_error(number_of(row, name), number_of(row, f"{name}_se")).partition(" ±")[0]
    return _with_error(number_of(row, name), error)


def _intensity(row: Row, axial: str) -> str:
    """Spell an intensity with the digits that the error of the axial value allows."""
    error = total_error(row, axial) or number_of(row, f"{axial}_se")
    return _with_error(number_of(row, axial.removesuffix("_axial")), error).partition(" ±")[0]


def _with_error(value: float | None, error: float | None) -> str:
    """Spell a small number with two digits of its error, if the error is known."""
    if value is None:
        return "-"
    if error is None or error <= 0:
        return f"{value:.5f}"
    # count the digits of the rounded error: 0.00099999 is 0.0010
    digits = max(0, 1 - math.floor(math.log10(float(f"{error:.1e}"))))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _error(row: Row, name: str) -> str:
    error = number_of(row, name)
    return "-" if error is None else f"{error:#.2g}"


def _degrees(row: Row) -> str:
    angle = number_of(row, "coaxiality_deg")
    return "-" if angle is None else f"{angle:.0f}°"


def _spell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def frame_table(rows: Sequence[Row]) -> Part:
    """A table of some frames; the first columns have the anisotropies and their errors."""
    numbers = list(dict.fromkeys((row["source"], row["frame"]) for row in rows))
    step = -(-len(numbers) // MOST_FRAMES)
    shown = {*numbers[::step], numbers[-1]}
    sources = {row["source"] for row in rows}
    # axial strain is the default, also if it does not tell the frames of a source apart
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


def block_table(rows: Sequence[Row]) -> Part:
    """A table of the blocks of a map in its last frame."""
    last = [row for row in rows if (row["source"], row["frame"]) == _of_frame(rows[-1])]
    table = [
        {
            "block": str(row["block"]),
            "variant": variant_of(row),
            **{name: _spell(number_of(row, name)) for name in PLACES},
            "grains": _spell(row.get("grains")),
            "α_vs": _value(row, VOID).partition(" ±")[0],
            "± total": _error({"total": total_error(row, VOID)}, "total"),
            "α_c": _value(row, CONTACT).partition(" ±")[0],
            "± of α_c": _error(row, f"{CONTACT}_sample_se"),
            "solid fraction": _spell(number_of(row, "solid_fraction")),
            "coordination": _spell(number_of(row, "coordination")),
            "at a surface": "yes" if row["at_surface"] else "-",
        }
        for row in last[:MOST_BLOCKS]
    ]
    columns = [name for name in table[0] if any(line[name] != "-" for line in table)]
    note = f"Blocks in frame {last[0]['frame']} of {last[0]['source'] or 'the sample'}."
    if len(last) > MOST_BLOCKS:
        note += f" The first {MOST_BLOCKS} of {len(last)} are shown."
    return Part(columns, [[line[name] for name in columns] for line in table], note)


def _of_frame(row: Row) -> tuple[Any, Any]:
    return row["source"], row["frame"]


def _frame_line(row: Row, column: str, several: bool, turned: bool) -> dict[str, str]:
    """The cells of a row, the most important first."""
    strain, total = number_of(row, column), total_error(row, VOID)
    spelt = "-" if strain is None else f"{100 * strain:.3g} %"
    intensities = {
        "void intensity": _intensity(row, VOID),
        "contact intensity": _intensity(row, CONTACT),
        "angle": _degrees(row) if turned else "-",
    }
    more = {
        # spell the value of the table, so that counts stay whole numbers
        title: "-" if number_of(row, name) is None else _spell(row[name])
        for name, title in MORE_COLUMNS.items()
    }
    return {
        "frame": str(row["frame"]),
        "variant": variant_of(row),
        "strain": spelt if column == "strain" else "-",
        "shear strain": spelt if column == "shear_strain" else "-",
        **(intensities if turned else {}),
        "α_vs": _value(row, VOID).partition(" ±")[0],
        "± total": _error({"total": total}, "total"),
        "scan": _error(row, f"{VOID}_se"),
        "sample": _error(row, f"{VOID}_sample_se"),
        "α_c": _value(row, CONTACT).partition(" ±")[0],
        "± of α_c": _error(row, f"{CONTACT}_sample_se"),
        **more,
        **intensities,
        "source": str(row["source"]) if several else "-",
    }


def input_table(manifest: Mapping[str, Any]) -> Part:
    """The first input files with size and hash."""
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
    given, found = given_settings(asked), []
    for name in asked:
        if name not in HIDDEN:
            value = given.get(name, "auto" if name in ("spacing", "directions") else "-")
            if isinstance(value, dict):
                value = [f"{key}={item}" for key, item in value.items()]
            if isinstance(value, list):
                value = ", ".join(map(str, value))
            found.append((flag_of(name)[2:], str(value), MEANINGS.get(name, "")))
    return found
