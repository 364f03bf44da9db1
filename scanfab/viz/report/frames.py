"""What a report shows of the dumps: a view, the sample in numbers, and pictures of two frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import SettingsError
from scanfab.io.series import Series
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import SurfaceBox
from scanfab.pipeline.repeat import reopen, restored_settings
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Length
from scanfab.table.curves import spelt_strain, strain_column
from scanfab.table.row import numbers_of
from scanfab.viz.figures.page import make_figures
from scanfab.viz.report.page import Picture, picture_of, view_data
from scanfab.viz.scanned_frames import ScannedFrames
from scanfab.viz.scene import Look, look_at

# segments of a scan that takes about half a minute: pictures that would need more are rougher
MOST_SEGMENTS = 3e8


class Input(NamedTuple):
    """One table, its rows, and the manifest beside it."""

    path: Path
    rows: list[dict[str, Any]]
    manifest: dict[str, Any] | None
    cutoff: float | None
    """The cut-off whose rows were chosen from several."""


def show_frames(one: Input) -> dict[str, Any]:
    """
    Read the first source of a table again: its view, the sample in numbers, and pictures.

    Raises
    ------
    ScanfabError, OSError
        If it has changed, or cannot be read again.
    """
    manifest = one.manifest or {}
    for file in manifest.get("inputs") or []:
        path = Path(str(file.get("path")))
        if path.exists() and path.stat().st_size != file.get("size"):
            raise SettingsError(f"{path} has changed since the table was computed")
    asked = manifest["settings"]
    series, settings = reopen(asked), restored_settings(asked)
    if settings.cutoffs:
        # the one whose rows are reported
        cutoff = settings.cutoff if one.cutoff is None else Length(one.cutoff)
        settings = replace(settings, cutoffs=(), cutoff=cutoff)
    source = str(one.rows[0]["source"])
    rows = [row for row in one.rows if row["source"] == one.rows[0]["source"]]
    filled = [row for row in rows if row["alpha_vs_axial"] is not None]
    number = int(max(numbers_of(filled or rows, "frame"), default=0))
    look = look_at(series, replace(settings, variants="c"), number)
    of_frame = [row for row in rows if row["frame"] == look.number]
    strain = spelt_strain(of_frame[0], strain_column(rows)) if of_frame else ""
    return {
        "view": view_data(look.scene, look.axis),
        "view_title": ", ".join(filter(None, [source, f"frame {look.number}", strain])),
        "facts": _facts(look),
        "pictures": _pictures(rows, series, settings) if filled else [],
    }


def _facts(look: Look) -> list[tuple[str, str]]:
    """The sample in numbers."""
    first, plan = look.first, look.plan
    if first is None:
        return []
    radii, boundary = first.packing.radius[first.grains], first.number(first.boundary)
    smallest = float(radii.min())
    axis = [name for name, part in zip("xyz", look.axis, strict=True) if part == 1.0]
    facts = [
        ("grains", f"{first.number(first.grains)} in the first frame that has grains"),
        ("radii", f"smallest {smallest:.4g}, mean {radii.mean():.4g}, largest {radii.max():.4g}"),
        ("boundary", f"{boundary} particles" if boundary else "none"),
        ("cell", _cell(look.sample.packing.cell)),
        ("loading axis", axis[0] if axis else _numbers(look.axis)),
    ]
    if plan is None:
        return facts
    facts.append(("cut-off", f"{plan.cutoff:.4g}, {plan.cutoff / smallest:.3g} smallest radii"))
    if plan.window is not None:
        facts.append(("centre of the RV", _numbers(plan.window.center)))
    for window in plan.windows:
        radius = window.radius
        if not window.shape.is_sphere:
            facts.append(("shape of the RV", str(window.shape)))
            continue
        part, now = _fraction(first, radius), ""
        # beside the sample that the RV was chosen for, and beside what became of that since
        if look.sample.gathered.any() and _fraction(look.sample, radius) != part:
            now = f" in the first frame that has grains, {_fraction(look.sample, radius)} in frame "
            now += str(look.number)
        size = f"{radius:.4g}, {part} of half the sample's smallest extent{now}"
        facts.append(("radius of the RV", f"{size}, {radius / radii.mean():.3g} mean radii"))
    return facts


def _fraction(sample: Sample, radius: float) -> str:
    extent = SurfaceBox.of(sample.packing, sample.gathered).smallest_extent
    return f"{2 * radius / extent:.3g}"


def _cell(cell: Cell | None) -> str:
    if cell is None or not any(cell.periodic):
        return "not periodic"
    along = "".join(name for name, repeats in zip("xyz", cell.periodic, strict=True) if repeats)
    return f"periodic along {along}, vectors ({'; '.join(map(_numbers, cell.vectors))})"


def _numbers(vector: Any) -> str:
    return ", ".join(f"{part:.4g}" for part in vector)


def _pictures(rows: list[dict[str, Any]], series: Series, settings: Settings) -> list[Picture]:
    """Of the first and the last frame, all from one scan."""
    rougher, tolerance = "", settings.tolerance
    if settings.spacing is None or settings.directions is None:
        # as much rougher as makes the scan short enough to wait for
        most = max(numbers_of(rows, "segments"), default=0.0)
        tolerance *= max(1.0, most / MOST_SEGMENTS) ** 0.5
    if tolerance > settings.tolerance:
        rougher = (
            f"Scanned to a standard error of {tolerance:.2g} instead of the table's "
            f"{settings.tolerance:.2g}, which would take too long for a picture."
        )
    frames = ScannedFrames(series, replace(settings, tolerance=tolerance), rows, rougher)
    # pixels, as the disks are pixels anyway, and few of them
    figures = [figure for figure in make_figures(frames, "frames") if not figure.slow]
    return [picture_of(figure, "png") for figure in figures]
