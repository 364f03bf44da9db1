"""The tables of the report as text, and its warnings about the numbers in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.option import flag_of
from scanfab.base.spelling import counted
from scanfab.pipeline.options import MEANINGS
from scanfab.pipeline.record import given_settings
from scanfab.table.curves import STRAINS, is_turned, strain_column
from scanfab.table.row import Row as TableRow
from scanfab.table.row import groups_of, number_of, numbers_of, total_error, variant_of, with_error

Row = Mapping[str, Any]

# The table shows at most about so many frames of a source and variant.
MOST_FRAMES = 12
MOST_INPUTS, MOST_BLOCKS = 20, 200
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"
# The report warns of an error above this share of the largest void anisotropy.
NOTABLE = 0.1

# Titles that readers see of columns that are shown as they are.
TITLES = {
    **{name: name for name in ("grains", "rattlers", "contacts", "coordination")},
    "solid_fraction": "solid fraction",
    "mean_length": "mean void length",
    "segments": "void segments",
    "alpha_vs": "void intensity",
    "alpha_c": "contact intensity",
}
INTENSITIES = ("void intensity", "contact intensity", "angle between their axes")
# Names of the lines of the results, with their titles in the table of frames.
RESULTS = {
    **{name: name for name in ("frame", "axial strain", "shear strain", "grains")},
    "α_vs along the loading axis": "α_vs",
    "its error: scan": "scan",
    "its error: sample": "sample",
    "α_c along the loading axis": "α_c",
    **{name: name for name in INTENSITIES},
}
OF_INTENSITIES = (
    "Intensities are largest minus smallest principal value, whichever way the axes point: never "
    "negative, so noise raises them. The table has no errors of them."
)


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
    frames = len(set(map(_of_frame, rows)))
    variants = ", ".join(sorted({str(row["variant"]) for row in rows}))
    parts = [f"{counted(frames, 'frame')} of {', '.join(sources)}", f"variants {variants}"]
    if column := strain_column(rows):
        strains = numbers_of(rows, column)
        ends = dict.fromkeys(f"{100 * one:.3g}" for one in (min(strains), max(strains)))
        parts.append(f"{STRAINS[column][0]} {' to '.join(ends)} %")
    return "; ".join(parts) + "."


def results_tables(summary: Sequence[TableRow], rows: Sequence[Row]) -> list[Part]:
    """A table for each source: the last frame and the fitted line, a column for each variant."""
    filled = groups_of(row for row in rows if row[VOID] is not None)
    parts = []
    for source in dict.fromkeys(one.source for one in summary):
        own = [one for one in summary if one.source == source]
        groups = [filled.get((source, variant_of(one))) for one in own]
        cells = [_cells(group[-1]) if group else {} for group in groups]
        turned = is_turned([row for row in rows if row["source"] == source])
        # axial values miss the fabric of turned axes: intensities lead, and no line is fitted
        names = [*INTENSITIES, *RESULTS] if turned else [*RESULTS]
        lines = {name: [one.get(RESULTS[name], "-") for one in cells] for name in names}
        if not turned:
            lines |= {
                "slope of α_vs on α_c": [with_error(one.slope, one.slope_se, ".5f") for one in own],
                "R² of that line": [_spell(one, "r2") for one in own],
                "largest α_vs": [_spell(one, "peak") for one in own],
                "frames in the line": [str(one.frames) for one in own],
            }
        shown = [[name, *cells] for name, cells in lines.items() if {*cells} != {"-"}]
        parts.append(Part(["variant", *map(variant_of, own)], shown, OF_INTENSITIES, source))
    return parts


def _spell(row: Row, name: str, spelling: str = ".4g", unit: str = "") -> str:
    """A number of a row; counts stay whole numbers."""
    value = row.get(name)
    if number_of(row, name) is None:
        return "-"
    return f"{value:{spelling}}{unit}" if isinstance(value, float) else f"{value}{unit}"


def _cells(row: Row) -> dict[str, str]:
    """The cells of a frame or block by title, in the order of the columns."""
    strains = {words: number_of(row, name) for name, (words, _) in STRAINS.items()}
    void, contact = (
        with_error(number_of(row, name), total_error(row, name), ".5f") for name in (VOID, CONTACT)
    )
    return {
        **{name: _spell(row, name) for name in ("frame", "block")},
        "variant": variant_of(row),
        **{words: "-" if one is None else f"{100 * one:.3g} %" for words, one in strains.items()},
        **{name: _spell(row, name) for name in ("x", "y", "z", "r_inner", "r_outer")},
        "α_vs": void,
        "scan": _spell(row, f"{VOID}_se", "#.2g"),
        "sample": _spell(row, f"{VOID}_sample_se", "#.2g"),
        "α_c": contact,
        **{title: _spell(row, name) for name, title in TITLES.items()},
        "angle between their axes": _spell(row, "coaxiality_deg", ".0f", "°"),
        "at a surface": "yes" if row.get("at_surface") else "-",
    }


def _part(lines: Sequence[Mapping[str, str]], note: str) -> Part:
    """A table of cells by column, without the columns that are empty in all lines."""
    filled = [name for name in lines[0] if any(line[name] != "-" for line in lines)]
    return Part(filled, [[line[name] for name in filled] for line in lines], note)


def frame_table(rows: Sequence[Row]) -> Part:
    """A table of some frames; the first columns have the anisotropies and their errors."""
    numbers = list(dict.fromkeys(map(_of_frame, rows)))
    shown = {*numbers[:: -(-len(numbers) // MOST_FRAMES)], numbers[-1]}
    several = len({source for source, _ in numbers}) > 1
    chosen = [row for row in rows if _of_frame(row) in shown]
    lines = [{**_cells(row), "source": str(row["source"]) if several else "-"} for row in chosen]
    note = "" if len(shown) == len(numbers) else f"{len(shown)} of {len(numbers)} frames are shown."
    return _part(lines, note)


def block_table(rows: Sequence[Row]) -> Part:
    """A table of the blocks of a map in its last frame."""
    last = [row for row in rows if _of_frame(row) == _of_frame(rows[-1])]
    note = f"Blocks in frame {last[0]['frame']} of {last[0]['source'] or 'the sample'}."
    if len(last) > MOST_BLOCKS:
        note += f" The first {MOST_BLOCKS} of {len(last)} are shown."
    return _part([_cells(row) for row in last[:MOST_BLOCKS]], note)


def _of_frame(row: Row) -> tuple[Any, Any]:
    return row["source"], row["frame"]


def input_table(manifest: Mapping[str, Any]) -> Part:
    """The first input files with size and hash."""
    files = list(manifest.get("inputs") or [])
    names = ("path", "size", "sha256")
    lines = [[str(one.get(name)) for name in names] for one in files[:MOST_INPUTS]]
    more = len(files) - len(lines)
    note = f"and {more} more, in the manifest" if more else ""
    return Part(["file", "bytes", "SHA-256"], lines, note)


def settings_table(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting of a manifest that has a value."""
    found = []
    for name, value in given_settings(asked).items():
        if isinstance(value, dict):
            value = [f"{key}={item}" for key, item in value.items()]
        if isinstance(value, list):
            value = ", ".join(map(str, value))
        found.append((flag_of(name)[2:], str(value), MEANINGS.get(name, "")))
    return found


def caveats_of(rows: Sequence[Row]) -> list[str]:
    """Warnings about the rows of fabric tables, each in one or two sentences."""
    found = []
    filled = [row for row in rows if row[VOID] is not None]
    if len(filled) < len(rows):
        found.append(
            f"{len(rows) - len(filled)} of {len(rows)} rows have no void fabric: no void segment "
            f"was long enough, or some direction kept none."
        )
    groups = groups_of(filled)
    for (source, variant), group in groups.items():
        peak = max(group, key=lambda row: abs(float(row[VOID])))
        signal, total = abs(float(peak[VOID])), total_error(peak, VOID)
        if not numbers_of(group, f"{VOID}_se"):
            found.append(
                f"Variant {variant} of {source} has no standard error of the scan: it was made of "
                f"one replicate, or the table lacks the column {VOID}_se. Without that part there "
                f"is no error in all, and none behind ±."
            )
        elif total is not None and total > NOTABLE * signal:
            scan, sample = (_cells(peak)[part] for part in ("scan", "sample"))
            found.append(
                f"{source}, variant {variant}: where α_vs is largest, its standard error is more "
                f"than a tenth of it ({total:.2g} beside {signal:.2g}). A smaller `tolerance` or "
                f"`spacing` makes the scan's part smaller ({scan}), only more grains the sample's "
                f"part ({sample})."
            )
    if groups and max(map(len, groups.values())) < 3:
        found.append(
            "There are fewer than three frames: no line is fitted to void against contact fabric."
        )
    return list(dict.fromkeys(found))
