"""What a report shows of the dumps: a view, the sample in numbers, and pictures of two frames."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from scanfab.base.errors import SettingsError
from scanfab.io.series import Series
from scanfab.packing.sample import Sample
from scanfab.packing.window import SurfaceBox
from scanfab.pipeline.repeat import reopen, restored_settings
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Length, Vector
from scanfab.table.row import number_of
from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.page import drawn_page, make_figures
from scanfab.viz.figures.style import figure_bytes
from scanfab.viz.report.inputs import Input
from scanfab.viz.report.page import Picture, view_data
from scanfab.viz.scanned_frames import ScannedFrames
from scanfab.viz.scene import Look, look_at

# CSS pixels an inch, and those of pictures that are pixels
PIXELS, DPI = 96, 130
KINDS = {"svg": "image/svg+xml", "png": "image/png"}
# segments of a scan that takes about half a minute: pictures that would need more are rougher
MOST_SEGMENTS = 3e8


def show_frames(one: Input) -> dict[str, Any]:
    """
    Read the source of a table again: its view, the sample in numbers, and pictures.

    Raises
    ------
    ScanfabError, OSError
        If it has changed, or cannot be read again.
    """
    manifest = one.manifest or {}
    _check_inputs(manifest)
    asked = manifest["settings"]
    series, settings = reopen(asked), restored_settings(asked)
    if settings.cutoffs:
        # the one whose rows are reported
        cutoff = settings.cutoff if one.cutoff is None else Length(one.cutoff)
        settings = replace(settings, cutoffs=(), cutoff=cutoff)
    look = look_at(series, replace(settings, variants="c"), one.last_frame)
    return {
        "view": view_data(look.scene, look.axis),
        "view_title": _title(one, look.number),
        "facts": _facts(look, settings),
        "pictures": _pictures(one, series, settings),
    }


def picture_of(figure: Figure, kind: Literal["svg", "png"]) -> Picture:
    """A figure with its caption, as lines or as pixels."""
    with drawn_page([figure]) as page:
        data = figure_bytes(page, kind, DPI)
    url = f"data:{KINDS[kind]};base64,{base64.b64encode(data).decode('ascii')}"
    return Picture(url, figure.caption, round(PIXELS * figure.size[0]))


def _check_inputs(manifest: Mapping[str, Any]) -> None:
    """An error if a file has another size than when it was computed."""
    for one in manifest.get("inputs") or []:
        path = Path(str(one.get("path")))
        if path.exists() and path.stat().st_size != one.get("size"):
            raise SettingsError(f"{path} has changed since the table was computed")


def _title(one: Input, frame: int) -> str:
    source = str(one.rows[0]["source"])
    return ", ".join(filter(None, [source, f"frame {frame}", one.strain_of(frame)]))


def _facts(look: Look, settings: Settings) -> list[tuple[str, str]]:
    """The sample in numbers."""
    first, plan = look.first, look.plan
    if first is None:
        return []
    radii, boundary = first.packing.radius[first.grains], first.number(first.boundary)
    smallest = float(radii.min())
    facts = [
        ("grains", f"{first.number(first.grains)} in the first frame that has grains"),
        ("radii", f"smallest {smallest:.4g}, mean {radii.mean():.4g}, largest {radii.max():.4g}"),
        ("boundary", f"{boundary} particles" if boundary else "none"),
        ("cell", _cell(look)),
        ("loading axis", _axis(look.axis)),
    ]
    if plan is None:
        return facts
    facts.append(("cut-off", f"{plan.cutoff:.4g}, {plan.cutoff / smallest:.3g} smallest radii"))
    if plan.window is not None:
        facts.append(("centre of the RV", ", ".join(f"{one:.4g}" for one in plan.window.center)))
    for window in plan.windows:
        radius = window.radius
        if not window.shape.is_sphere:
            facts.append(("shape of the RV", str(window.shape)))
            continue
        size = f"{radius:.4g}, {_part_of_sample(first, look, radius)}"
        facts.append(("radius of the RV", f"{size}, {radius / radii.mean():.3g} mean radii"))
    return facts


def _part_of_sample(first: Sample, look: Look, radius: float) -> str:
    """The RV beside the sample that it was chosen for, and beside what became of that since."""
    then = f"{_fraction(first, radius)} of half the sample's smallest extent"
    if not look.sample.gathered.any() or _fraction(look.sample, radius) == _fraction(first, radius):
        return then
    now = f"{_fraction(look.sample, radius)} in frame {look.number}"
    return f"{then} in the first frame that has grains, {now}"


def _fraction(sample: Sample, radius: float) -> str:
    extent = SurfaceBox.of(sample.packing, sample.gathered).smallest_extent
    return f"{2 * radius / extent:.3g}"


def _cell(look: Look) -> str:
    cell = look.sample.packing.cell
    if cell is None or not look.sample.packing.is_periodic:
        return "not periodic"
    along = "".join(name for name, repeats in zip("xyz", cell.periodic, strict=True) if repeats)
    vectors = "; ".join(", ".join(f"{part:.4g}" for part in row) for row in cell.vectors)
    return f"periodic along {along}, vectors ({vectors})"


def _axis(axis: Vector) -> str:
    named = [name for name, part in zip("xyz", axis, strict=True) if part == 1.0]
    return named[0] if named else ", ".join(f"{part:.4g}" for part in axis)


def _pictures(one: Input, series: Series, settings: Settings) -> list[Picture]:
    """Of the first and the last frame, all from one scan."""
    rows = one.first_series
    if all(row["alpha_vs_axial"] is None for row in rows):
        return []
    drawn = replace(settings, tolerance=_affordable_tolerance(rows, settings))
    rougher = ""
    if drawn.tolerance > settings.tolerance:
        rougher = (
            f"Scanned to a standard error of {drawn.tolerance:.2g} instead of the table's "
            f"{settings.tolerance:.2g}, which would take too long for a picture."
        )
    frames = ScannedFrames(series, drawn, rows, rougher)
    # pixels, as the disks are pixels anyway, and few of them
    figures = [figure for figure in make_figures(frames, "frames") if not figure.slow]
    return [picture_of(figure, "png") for figure in figures]


def _affordable_tolerance(rows: list[dict[str, Any]], settings: Settings) -> float:
    """The table's, or as much more as makes the scan short enough to wait for."""
    most = max((number_of(row, "segments") or 0.0 for row in rows), default=0.0)
    is_fixed = settings.spacing is not None and settings.directions is not None
    return settings.tolerance * (1.0 if is_fixed else max(1.0, most / MOST_SEGMENTS) ** 0.5)
