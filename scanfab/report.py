"""The report: what a table says, in plain words, tables, figures and a view that can be turned."""

from __future__ import annotations

import base64
import io
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
from scanfab.report_tables import (
    frame_table,
    input_table,
    overview,
    results_table,
    settings_table,
)
from scanfab.rerun import read_manifest, reopen, repeat_command, restored_settings
from scanfab.scene import section_lines
from scanfab.tabular import numbers_of, read_rows
from scanfab.writers.page import Content, Picture, Section, render_page, view_data

__all__ = ["has_void_fabric", "make_report"]

# standard error that is good enough for pictures
ROUGH = 1e-3


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
            summary=[overview(one.path, one.rows) for one in inputs],
            results=results_table(comparison.summary, rows),
            pictures=[*_table_pictures(rows), *(p for one in sections for p in one.pictures)],
            warnings=list(dict.fromkeys([*told, *caveats_of(rows, _asked(inputs))])),
            sections=sections,
            frames=frame_table(rows),
        )
    )


def has_void_fabric(tables: Sequence[Path]) -> bool:
    """Whether any row of the tables has a void fabric."""
    rows = (row for path in tables for row in read_rows(path))
    return any(row.get("alpha_vs_axial") is not None for row in rows)


def _asked(inputs: Iterable[_Input]) -> list[Mapping[str, Any]]:
    return [one.manifest["settings"] for one in inputs if one.manifest is not None]


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
        command=repeat_command(asked, one.path.name, _overridden(one.manifest)),
        settings=settings_table(asked),
        versions=[(str(k), str(v)) for k, v in (one.manifest.get("versions") or {}).items()],
        inputs=input_table(one.manifest),
        view=view,
        view_title=_view_title(one),
        no_view=no_view,
        pictures=pictures,
    )


def _overridden(manifest: Mapping[str, Any]) -> list[str]:
    """Options of the settings file beside the dumps that the command line has overridden."""
    found = manifest.get("settings_file")
    return [str(name) for name in found.get("not_used", [])] if isinstance(found, dict) else []


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
    own = [row for row in rows if row["source"] == rows[0]["source"]]
    filled = [row for row in own if row["alpha_vs_axial"] is not None]
    return int(max(numbers_of(filled, "frame") or numbers_of(own, "frame"), default=0))


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


def _view_title(one: _Input) -> str:
    return f"{one.rows[0]['source']}, frame {_last_frame(one.rows)}" if one.rows else ""
