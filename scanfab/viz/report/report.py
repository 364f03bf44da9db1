"""The report: what a table says, in plain words, tables, figures and a view that can be turned."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from scanfab.base.errors import ScanfabError, ScanfabNote, ScanfabWarning, SettingsError
from scanfab.base.files import whole_file
from scanfab.io.families import PathLike
from scanfab.pipeline.options import as_options
from scanfab.pipeline.record import read_manifest
from scanfab.pipeline.repeat import repeat_command
from scanfab.table.compare import Comparison, compare_tables
from scanfab.table.formats import read_rows
from scanfab.table.selection import choose_rows
from scanfab.viz.figures.page import make_figures
from scanfab.viz.report.caveats import caveats_of
from scanfab.viz.report.frames import Input, show_frames
from scanfab.viz.report.page import Picture, check_page_file, picture_of, render_page
from scanfab.viz.report.tables import (
    frame_table,
    input_table,
    overview,
    results_tables,
    settings_table,
)

Told = dict[type[Warning], list[str]]
"""What was told, warnings and notes apart."""


@dataclass(frozen=True)
class Report:
    """
    A report on fabric tables, as :func:`make_report` makes it.

    Attributes
    ----------
    page : str
        HTML that needs nothing else.
    has_void_fabric : bool
        Whether any row of the tables has one.

    Examples
    --------
    >>> from scanfab import Report
    >>> Report("<!doctype html>" + 2_000_000 * " ", has_void_fabric=True)
    Report: an HTML page of 2 MB, with void fabric
    """

    page: str
    has_void_fabric: bool

    def __repr__(self) -> str:
        fabric = "with" if self.has_void_fabric else "without any"
        return f"Report: an HTML page of {len(self.page) / 1e6:.2g} MB, {fabric} void fabric"

    def save(self, path: PathLike) -> None:
        """
        Write the page.

        Parameters
        ----------
        path : path
            ``.html``; the file is complete or untouched.

        Raises
        ------
        SettingsError
            If it has another suffix, or the folder does not exist.
        """
        check_page_file(Path(path))
        with whole_file(Path(path)) as part:
            part.write_text(self.page, encoding="utf-8", errors="backslashreplace")


def make_report(
    tables: PathLike | Sequence[PathLike],
    *,
    title: str | None = None,
    author: str = "",
    cutoff: float | None = None,
    labels: Sequence[str] | None = None,
    today: date | None = None,
) -> Report:
    """
    The report on fabric tables as one HTML page that needs nothing else.

    Parameters
    ----------
    tables : path, or sequence of paths
        Files of :func:`scanfab.compute_file` or ``scanfab compute -o``; settings and versions come
        from the manifest beside each, ``TABLE.manifest.json``, and the view from the source that it
        names. Without a manifest, the report says that they are not known.
    title, author : str, optional
        Of the page; by default the sources' names, and none.
    cutoff : float, optional
        Report the rows of this cut-off, if the tables have several.
    labels : sequence of str, optional
        A name for each table in place of its source.
    today : date, optional
        The date of the report.

    Returns
    -------
    Report
        To be saved: ``report.save("report.html")``.

    Raises
    ------
    ScanfabError
        If a table cannot be read, is no fabric table, or holds no frames.

    Examples
    --------
    >>> import scanfab, tempfile
    >>> row = dict(source="box", frame=0, variant="c", alpha_vs_axial=0.012, alpha_c_axial=0.1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     scanfab.Table([row]).save(f"{folder}/fabric.csv")
    ...     report = scanfab.make_report(f"{folder}/fabric.csv", title="A box")
    ...     report.save(f"{folder}/report.html")
    >>> report.has_void_fabric
    True
    """
    named = [tables] if isinstance(tables, str | os.PathLike) else list(tables)
    if not all(isinstance(one, str | os.PathLike) for one in named):
        raise SettingsError(
            "expected files of tables, beside which manifests say what made them: save a table, or "
            "compute it by scanfab.compute_file, and name its file"
        )
    told: Told = {ScanfabWarning: [], ScanfabNote: []}
    with _listening(told) as caught:
        inputs = read_inputs([Path(one) for one in named], cutoff, labels)
        rows = [row for one in inputs for row in one.rows]
        comparison = compare_tables(rows)
        pictures = _table_pictures(rows, comparison)
    for one in caught:
        warnings.warn(one.message, one.category, stacklevel=2)
    sections = [_section(one, told) for one in inputs]
    for section in sections:
        pictures += section["shown"]["pictures"] if section["shown"] else []
    asked = [one.manifest["settings"] for one in inputs if one.manifest is not None]
    doubts = [*told[ScanfabWarning], *map(as_options, caveats_of(rows, asked))]
    page = render_page(
        title=title or _usual_title(rows),
        author=author,
        date=(today or datetime.now(UTC).astimezone().date()).isoformat(),
        summary=[overview(one.path, one.rows) for one in inputs],
        results=results_tables(comparison.summary, rows),
        pictures=pictures,
        warnings=list(dict.fromkeys(doubts)),
        notes=list(dict.fromkeys(told[ScanfabNote])),
        sections=sections,
        frames=frame_table(rows),
    )
    return Report(page, any(row["alpha_vs_axial"] is not None for row in rows))


@contextmanager
def _listening(told: Told) -> Iterator[list[Any]]:
    """Collect what is told in the block; it gives back the warnings themselves."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield caught
        finally:
            for one in caught:
                for kind in told:
                    if issubclass(one.category, kind):
                        told[kind].append(as_options(str(one.message)))


def read_inputs(
    tables: Sequence[Path], cutoff: float | None = None, labels: Sequence[str] | None = None
) -> list[Input]:
    """
    Read tables and manifests.

    Raises
    ------
    ScanfabError
        If one cannot be read or is no fabric table, or if no table has a row.
    """
    # a report can do without the names of the source and the strain
    read = [
        (path, [{"source": path.stem, "strain": None, **row} for row in read_rows(path)])
        for path in tables
    ]
    chosen = choose_rows(read, cutoff, labels)
    inputs = [
        Input(path, rows, read_manifest(path), cutoff)
        for path, rows in zip(tables, chosen, strict=True)
    ]
    if not any(one.rows for one in inputs):
        raise SettingsError(
            f"{', '.join(map(str, tables))}: there is nothing to report: no row in the table"
        )
    return inputs


def _usual_title(rows: Sequence[Mapping[str, Any]]) -> str:
    sources = list(dict.fromkeys(str(row["source"]) for row in rows))
    names = [Path(source).name or source for source in sources]
    return f"Void fabric of {', '.join(names) if len(names) < 4 else f'{len(names)} samples'}"


def _table_pictures(rows: Sequence[Mapping[str, Any]], comparison: Comparison) -> list[Picture]:
    """The figures of the table; none if it has no void fabric."""
    try:
        figures = make_figures(rows, "table", comparison=comparison)
    except SettingsError:
        return []
    return [picture_of(one, "svg") for one in figures]


def _section(one: Input, told: Told) -> dict[str, Any]:
    """What the manifest says, and what the source shows; ``told`` gets the warnings."""
    section: dict[str, Any] = {"title": str(one.path), "missing": "", "shown": None, "no_view": ""}
    if one.manifest is None:
        missing = (
            f"There is no {one.path.name}.manifest.json beside {one.path}: settings, versions and "
            f"inputs are not known. scanfab compute writes it with -o."
        )
        return {**section, "missing": missing}
    asked, found = one.manifest["settings"], one.manifest.get("settings_file")
    told[ScanfabWarning] += map(str, one.manifest.get("warnings") or [])
    told[ScanfabNote] += map(str, one.manifest.get("notes") or [])
    if one.rows:
        try:
            with _listening(told):
                section["shown"] = show_frames(one)
        except (ScanfabError, OSError) as error:
            section["no_view"] = f"The view is left out: {as_options(error)}."
    # options of the settings file beside the dumps that the command line has overridden
    overridden = found.get("not_used", []) if isinstance(found, dict) else []
    return {
        **section,
        "command": repeat_command(asked, one.path.name, [str(name) for name in overridden]),
        "settings": settings_table(asked),
        "versions": [(str(k), str(v)) for k, v in (one.manifest.get("versions") or {}).items()],
        "inputs": input_table(one.manifest),
    }
