"""The report: what a table says, in plain words, tables, figures and a view that can be turned."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import ScanfabError, SettingsError
from scanfab.base.files import whole_file
from scanfab.io.families import PathLike
from scanfab.pipeline.options import Told, as_options, listening
from scanfab.pipeline.record import read_manifest, reopen, repeat_command, restored_settings
from scanfab.pipeline.values import Length
from scanfab.table.compare import compare_tables
from scanfab.table.formats import read_rows
from scanfab.table.row import numbers_of
from scanfab.table.selection import MAP, choose_rows
from scanfab.viz.figures.figure import Figure, make_figures
from scanfab.viz.report import tables as words
from scanfab.viz.report.page import check_page_file, picture_of, render_page, view_data
from scanfab.viz.scanned_frames import ScannedFrames
from scanfab.viz.scene import Look, look_at

# columns without which nothing can be said of a map
OF_MAPS = ("frame", "variant", "alpha_vs_axial")


class Input(NamedTuple):
    """One table, its rows, and the manifest beside it."""

    path: Path
    rows: list[dict[str, Any]]
    manifest: dict[str, Any] | None
    cutoff: float | None
    """The cut-off whose rows were chosen from several."""
    is_map: bool


@dataclass(frozen=True)
class Report:
    """
    A report on fabric tables, as :func:`report` makes it.

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


def report(
    tables: PathLike | Sequence[PathLike],
    *,
    title: str | None = None,
    author: str = "",
    cutoff: float | None = None,
    labels: Sequence[str] | None = None,
    today: date | None = None,
) -> Report:
    """
    The report on fabric tables and maps as one HTML page that needs nothing else.

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
    ...     page = scanfab.report(f"{folder}/fabric.csv", title="A box")
    ...     page.save(f"{folder}/report.html")
    >>> page.has_void_fabric
    True
    """
    named = [tables] if isinstance(tables, str | os.PathLike) else list(tables)
    if not all(isinstance(one, str | os.PathLike) for one in named):
        raise SettingsError(
            "expected files of tables with a manifest beside each: save a table, or compute it by "
            "scanfab.compute_file, and name its file"
        )
    with listening() as told:
        inputs = read_inputs([Path(one) for one in named], cutoff, labels)
        rows = [row for one in inputs if not one.is_map for row in one.rows]
        maps = [one.rows for one in inputs if one.is_map]
        comparison = compare_tables(rows)
        figures = []
        for kind, data in [("table", rows), *(("map", blocks) for blocks in maps)]:
            with suppress(SettingsError):  # there are no figures without a void fabric
                figures += make_figures(data, kind, comparison=comparison)
        pictures = [picture_of(one, "svg") for one in figures]
    # warnings about the sources read again stand only in the page
    with listening(lambda _: None) as of_sources:
        sections = [_section(one, of_sources) for one in inputs]
    for section in sections:
        pictures += section["shown"]["pictures"] if section["shown"] else []
    every = [row for one in inputs for row in one.rows]
    doubts = [*told.warnings, *of_sources.warnings, *map(as_options, words.caveats_of(rows))]
    names = [Path(one).name or one for one in dict.fromkeys(str(row["source"]) for row in every)]
    about = ", ".join(names) if len(names) < 4 else f"{len(names)} samples"
    page = render_page(
        title=title or f"Void fabric of {about}",
        author=author,
        date=(today or datetime.now(UTC).astimezone().date()).isoformat(),
        summary=[words.overview(one.path, one.rows) for one in inputs],
        results=words.results_tables(comparison.summary, rows),
        pictures=pictures,
        warnings=list(dict.fromkeys(doubts)),
        notes=list(dict.fromkeys([*told.notes, *of_sources.notes])),
        sections=sections,
        frames=[*([words.frame_table(rows)] if rows else []), *map(words.block_table, maps)],
    )
    return Report(page, any(row["alpha_vs_axial"] is not None for row in every))


def read_inputs(
    tables: list[Path], cutoff: float | None, labels: Sequence[str] | None
) -> list[Input]:
    """
    Read tables and manifests.

    Raises
    ------
    ScanfabError
        If one cannot be read or is neither a fabric table nor a map, or if no table has a row.
    """
    read = []
    for path in tables:
        # tables may lack the columns of source and strain
        rows = [{"source": path.stem, "strain": None, **row} for row in read_rows(path)]
        is_map = bool(rows) and MAP in rows[0]
        read.append(Input(path, rows, read_manifest(path), cutoff, is_map))
        if is_map and (lacking := [name for name in OF_MAPS if name not in rows[0]]):
            raise SettingsError(f"{path}: the map lacks the columns {', '.join(lacking)}")
    # a map is shown whole, under the name of its file
    of_frames = [(one.path, [] if one.is_map else one.rows) for one in read]
    chosen = zip(read, choose_rows(of_frames, cutoff, labels), strict=True)
    inputs = [one if one.is_map else one._replace(rows=rows) for one, rows in chosen]
    if not any(one.rows for one in inputs):
        names = ", ".join(map(str, tables))
        raise SettingsError(f"{names}: there is nothing to report: no row in the table")
    return inputs


def _section(one: Input, told: Told) -> dict[str, Any]:
    """The part of the page on one table; warnings of its manifest are added to ``told``."""
    section: dict[str, Any] = {"title": str(one.path), "missing": "", "shown": None, "no_view": ""}
    if one.manifest is None:
        missing = (
            f"There is no {one.path.name}.manifest.json beside {one.path}: settings, versions and "
            f"inputs are not known. scanfab compute writes it with -o."
        )
        return {**section, "missing": missing}
    asked, found = one.manifest["settings"], one.manifest.get("settings_file")
    told.warnings += map(str, one.manifest.get("warnings") or [])
    told.notes += map(str, one.manifest.get("notes") or [])
    if one.rows:
        try:
            section["shown"] = show_frames(one, one.manifest)
        except (ScanfabError, OSError) as error:
            section["no_view"] = f"The view is left out: {as_options(error)}."
    # options of the settings file beside the dumps, which the command line has overridden
    overridden = found.get("not_used", []) if isinstance(found, dict) else []
    return {
        **section,
        "command": repeat_command(asked, one.path.name, [str(name) for name in overridden]),
        "settings": words.settings_table(asked),
        "versions": [(str(k), str(v)) for k, v in (one.manifest.get("versions") or {}).items()],
        "inputs": words.input_table(one.manifest),
    }


def show_frames(one: Input, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """
    Read the first source of a table again: its view, the sample in numbers, and pictures.

    Raises
    ------
    ScanfabError, OSError
        If it has changed, or cannot be read again.
    """
    for file in manifest["inputs"]:
        path = Path(str(file.get("path")))
        if path.exists() and path.stat().st_size != file.get("size"):
            raise SettingsError(f"{path} has changed since the table was computed")
    asked = manifest["settings"]
    series, settings = reopen(asked), restored_settings(asked, one.path)
    if settings.cutoffs:
        # the cut-off whose rows are reported
        cutoff = settings.cutoff if one.cutoff is None else Length(one.cutoff)
        settings = replace(settings, cutoffs=(), cutoff=cutoff)
    source = str(one.rows[0]["source"])
    rows = [row for row in one.rows if row["source"] == one.rows[0]["source"]]
    filled = [row for row in rows if row["alpha_vs_axial"] is not None]
    number = int(max(numbers_of(filled or rows, "frame"), default=0))
    look = look_at(series, settings, number)
    figures: list[Figure] = []
    if filled and not one.is_map:
        figures = make_figures(ScannedFrames(series, settings, rows), "frames")
    return {
        "view": view_data(look.scene, look.axis),
        "view_title": ", ".join(filter(None, [source, f"frame {look.number}", look.strain])),
        "facts": _facts(look),
        # pixels, as the coloured disks are pixels anyway
        "pictures": [picture_of(figure, "png") for figure in figures if not figure.slow],
    }


def _facts(look: Look) -> list[tuple[str, str]]:
    """The sample in numbers."""
    first, plan = look.first, look.plan
    radii, boundary = first.packing.radius[first.grains], first.number(first.boundary)
    smallest, mean = float(radii.min()), float(radii.mean())
    axis = [name for name, part in zip("xyz", look.axis, strict=True) if part == 1.0]
    cell, told = look.sample.packing.cell, "not periodic"
    if cell is not None and any(cell.periodic):
        along = "".join(name for name, repeats in zip("xyz", cell.periodic, strict=True) if repeats)
        told = f"periodic along {along}, vectors ({'; '.join(map(_numbers, cell.vectors))})"
    return [
        ("grains", f"{first.number(first.grains)} in the reference frame"),
        ("radii", f"smallest {smallest:.4g}, mean {mean:.4g}, largest {radii.max():.4g}"),
        ("boundary", f"{boundary} particles" if boundary else "none"),
        ("cell", told),
        ("loading axis", axis[0] if axis else _numbers(look.axis)),
        ("cut-off", f"{plan.cutoff:.4g}, {plan.cutoff / smallest:.3g} smallest radii"),
        *(("RV", f"{one.shape} about ({_numbers(one.center)})") for one in plan.windows),
    ]


def _numbers(vector: Any) -> str:
    return ", ".join(f"{part:.4g}" for part in vector)
