"""The report: what a table says, in plain words, tables, figures and a view that can be turned."""

from __future__ import annotations

import base64
import io
import math
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scanfab.caveats import caveats_of
from scanfab.compare import compare_tables
from scanfab.errors import ScanfabError, ScanfabWarning, SettingsError
from scanfab.figures import fits_of
from scanfab.frame_figures import plot_frames
from scanfab.frame_view import scene_at
from scanfab.rerun import read_manifest, reopen, repeat_command, restored_settings, spelt_settings
from scanfab.scene import section_lines
from scanfab.tabular import read_rows
from scanfab.writers.page import Content, Part, Picture, Section, render_page, view_data

__all__ = ["has_void_fabric", "make_report"]

# frames of a source and variant that the tables show
MOST_FRAMES = 12
MOST_INPUTS = 20
# standard error that is good enough for pictures
ROUGH = 1e-3

SETTING_MEANINGS = {
    "variants": "a whole sample, b without rattlers, c RV, d RV without rattlers",
    "rv": "radius of the RV over half the smallest extent of the grains",
    "rv_radius": "radius of the RV, dump's unit",
    "rv_center": "centre of the RV, dump's unit",
    "boundary": "particles that are boundary, not grains",
    "cutoff": "shortest void segment that counts (rmin: smallest grain radius)",
    "spacing": "distance between neighbouring scan lines",
    "directions": "rule of the scan directions",
    "tolerance": "wanted standard error of the scan",
    "min_contacts": "a grain with fewer contacts is a rattler",
    "contact_tolerance": "relative tolerance of contacts by geometry",
    "axis": "loading axis",
    "strain": "where the axial strain comes from",
    "frames": "which frames",
    "seed": "of the random numbers",
    "contacts": "where the contacts come from",
}


@dataclass(frozen=True)
class _Input:
    """One table, its rows, and the manifest beside it."""

    path: Path
    rows: list[dict[str, Any]]
    manifest: dict[str, Any] | None


def make_report(tables: Sequence[Path]) -> str:
    """
    The report on fabric tables as one HTML page that needs nothing else.

    Parameters
    ----------
    tables : sequence of Path
        Tables of :func:`scanfab.compute`; settings and versions come from the manifest beside
        each, ``TABLE.manifest.json``, and the view from the source that it names.

    Raises
    ------
    ScanfabError
        If a table cannot be read, or holds no frames.
    """
    inputs = [_Input(path, read_rows(path), read_manifest(path)) for path in tables]
    rows = [row for one in inputs for row in one.rows]
    if not rows:
        raise SettingsError(
            f"{', '.join(map(str, tables))}: there is nothing to report: no row in the table"
        )
    comparison = compare_tables(rows)
    told: list[str] = []
    sections = [_section(one, told) for one in inputs]
    return render_page(
        Content(
            summary=[_overview(one) for one in inputs],
            results=_results(comparison.summary, rows),
            pictures=[*_table_pictures(rows), *(p for one in sections for p in one.pictures)],
            warnings=list(dict.fromkeys([*told, *caveats_of(rows, _asked(inputs))])),
            sections=sections,
            frames=_frame_table(rows),
        )
    )


def has_void_fabric(tables: Sequence[Path]) -> bool:
    """Whether any row of the tables has a void fabric."""
    rows = (row for path in tables for row in read_rows(path))
    return any(row.get("alpha_vs_axial") is not None for row in rows)


def _asked(inputs: Iterable[_Input]) -> list[Mapping[str, Any]]:
    return [one.manifest["settings"] for one in inputs if one.manifest is not None]


def _overview(one: _Input) -> str:
    """What was measured, in a sentence."""
    if not one.rows:
        return f"{one.path}: an empty table."
    sources = list(dict.fromkeys(str(row["source"]) for row in one.rows))
    frames = len({(row["source"], row["frame"]) for row in one.rows})
    variants = ", ".join(sorted({str(row["variant"]) for row in one.rows}))
    grains = [row["grains"] for row in one.rows if row.get("grains") is not None]
    strains = [row["strain"] for row in one.rows if row["strain"] is not None]
    parts = [
        f"{frames} {'frame' if frames == 1 else 'frames'} of {', '.join(sources)}",
        f"variants {variants}",
    ]
    if grains:
        parts.append(f"{min(grains)} to {max(grains)} grains")
    if strains:
        parts.append(f"axial strain {100 * min(strains):.3g} to {100 * max(strains):.3g} %")
    return "; ".join(parts) + "."


def _results(summary: Iterable[Any], rows: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """One line for each source and variant."""
    lines = []
    for one in summary:
        group = [
            row
            for row in rows
            if (row["source"], row["variant"]) == (one.source, one.variant)
            and row["alpha_vs_axial"] is not None
        ]
        first, last = (group[0], group[-1]) if group else ({}, {})
        lines.append(
            [
                one.source,
                one.variant,
                str(one.frames),
                _with_error(first.get("alpha_vs_axial"), first.get("alpha_vs_axial_se")),
                _with_error(last.get("alpha_vs_axial"), last.get("alpha_vs_axial_se")),
                _with_error(last.get("alpha_c_axial"), last.get("alpha_c_axial_se")),
                _with_error(one.slope, one.slope_se),
                _spell(one.r2),
            ]
        )
    return lines


def _with_error(value: float | None, error: float | None) -> str:
    """A small number, with two digits of its error if that is known."""
    if value is None:
        return "-"
    if error is None or error <= 0:
        return f"{value:.5f}"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _spell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _frame_table(rows: Sequence[Mapping[str, Any]]) -> Part:
    """The columns that matter most, of some frames."""
    columns = [
        "source", "frame", "strain", "variant", "grains", "rattlers", "contacts", "coordination",
        "solid_fraction", "segments", "mean_length", "alpha_vs", "alpha_vs_axial",
        "alpha_vs_axial_se", "alpha_vs_axial_sample_se", "alpha_c_axial",
    ]  # fmt: skip
    columns = [name for name in columns if any(row.get(name) is not None for row in rows)]
    numbers = list(dict.fromkeys((row["source"], row["frame"]) for row in rows))
    step = -(-len(numbers) // MOST_FRAMES)
    shown = {*numbers[::step], numbers[-1]}
    lines = [
        [_spell(row.get(name)) for name in columns]
        for row in rows
        if (row["source"], row["frame"]) in shown
    ]
    note = "" if len(shown) == len(numbers) else f"{len(shown)} of {len(numbers)} frames are shown."
    return Part(columns, lines, note)


def _table_pictures(rows: Sequence[Mapping[str, Any]]) -> list[Picture]:
    """The figures of the table; none if it has no void fabric."""
    from scanfab.writers.plot import new_figure
    from scanfab.writers.plot_table import SIZES, TABLE_FIGURES, draw_table

    fits = fits_of(rows)
    pictures = []
    for name, caption in TABLE_FIGURES.items():
        with new_figure(*SIZES[name]) as figure:
            try:
                draw_table(figure, rows, fits, name)
            except SettingsError:
                return []
            stream = io.BytesIO()
            figure.savefig(stream, format="svg", metadata={"Date": None})
        pictures.append(
            Picture(_data_url("image/svg+xml", stream.getvalue()), caption[0].upper() + caption[1:])
        )
    return pictures


def _data_url(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"


def _section(one: _Input, told: list[str]) -> Section:
    """What the manifest says, and what the source shows; ``told`` gets the warnings."""
    if one.manifest is None:
        missing = (
            f"There is no {one.path.name}.manifest.json beside {one.path}: settings, versions and "
            f"inputs are not known. scanfab compute writes it with -o."
        )
        return Section(title=str(one.path), missing=missing)
    asked = one.manifest["settings"]
    told += [str(text) for text in one.manifest.get("warnings") or []]
    view: Any = None
    pictures: list[Picture] = []
    no_view = ""
    try:
        with _told(told):
            view, pictures = _look(one, asked)
    except (ScanfabError, OSError) as error:
        no_view = f"The view is left out: {error}."
    return Section(
        title=str(one.path),
        command=repeat_command(asked, one.path.name),
        settings=_settings(asked),
        versions=[(str(k), str(v)) for k, v in (one.manifest.get("versions") or {}).items()],
        inputs=_inputs(one.manifest),
        view=view,
        view_title=_view_title(one),
        no_view=no_view,
        pictures=pictures,
    )


class _told(warnings.catch_warnings):  # noqa: N801
    """Collect the texts of warnings."""

    def __init__(self, texts: list[str]) -> None:
        super().__init__(record=True)
        self.texts = texts

    def __enter__(self) -> Any:
        self.caught = super().__enter__()
        warnings.simplefilter("always")
        return self.caught

    def __exit__(self, *details: Any) -> None:
        for one in self.caught or []:
            if issubclass(one.category, ScanfabWarning):
                self.texts.append(str(one.message))
        super().__exit__(*details)


def _last_frame(rows: Sequence[Mapping[str, Any]]) -> int:
    """The last frame of the first source, if possible with a void fabric."""
    source = rows[0]["source"]
    numbers = [row["frame"] for row in rows if row["source"] == source]
    filled = [
        row["frame"]
        for row in rows
        if row["source"] == source and row["alpha_vs_axial"] is not None
    ]
    return int(max(filled or numbers))


def _look(one: _Input, asked: Mapping[str, Any]) -> tuple[Any, list[Picture]]:
    """The view of the last frame, and the figures that need the dumps."""
    _check_inputs(one.manifest or {})
    series, settings = reopen(asked), restored_settings(asked)
    scene = scene_at(series, replace(settings, variants="c"), _last_frame(one.rows))
    lines = section_lines(scene, settings.axis) if scene.window_radius is not None else None
    view = view_data(replace(scene, lines=lines), settings.axis)
    rough = replace(settings, tolerance=max(settings.tolerance, ROUGH))
    pictures = []
    if any(row["alpha_vs_axial"] is not None for row in one.rows):
        for name, caption in (
            ("projection", "Mean void length and contact normals over all directions"),
            (
                "histogram",
                "Lengths of the void segments; shorter ones than the cut-off are dropped",
            ),
        ):
            pictures.append(_frame_picture(series, rough, one.rows, name, caption))
    return view, pictures


def _frame_picture(
    series: Any, settings: Any, rows: Sequence[Mapping[str, Any]], name: str, caption: str
) -> Picture:
    # the series may be named otherwise if it was opened from another folder
    own = [{**row, "source": series.name} for row in rows if row["source"] == rows[0]["source"]]
    with tempfile.TemporaryDirectory() as folder:
        # pixels, as the disks are pixels anyway, and few of them
        path = Path(folder) / f"{name}.png"
        plot_frames(path, series, settings, own, name, dpi=130)
        return Picture(_data_url("image/png", path.read_bytes()), caption)


def _check_inputs(manifest: Mapping[str, Any]) -> None:
    """An error if a file has another size than when it was computed."""
    for one in manifest.get("inputs") or []:
        path = Path(str(one.get("path")))
        if path.exists() and path.stat().st_size != one.get("size"):
            raise SettingsError(f"{path} has changed since the table was computed")


def _settings(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting."""
    spelt = spelt_settings(asked)
    names = [name for name in asked if name not in ("scanfab", "sources")]
    return [
        (
            name.replace("_", "-"),
            _plain(spelt.get(name, "auto" if name in ("spacing", "directions") else "-")),
            SETTING_MEANINGS.get(name, ""),
        )
        for name in names
        if name in spelt or name in SETTING_MEANINGS
    ]


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}={item}" for key, item in value.items())
    return str(value)


def _inputs(manifest: Mapping[str, Any]) -> Part:
    """The files with size and hash, not more than fit."""
    files = list(manifest.get("inputs") or [])
    lines = [
        [str(one.get("path")), str(one.get("size")), str(one.get("sha256"))]
        for one in files[:MOST_INPUTS]
    ]
    more = len(files) - len(lines)
    note = f"and {more} more, in the manifest" if more else ""
    return Part(["file", "bytes", "SHA-256"], lines, note)


def _view_title(one: _Input) -> str:
    return f"{one.rows[0]['source']}, frame {_last_frame(one.rows)}" if one.rows else ""
