"""scanfab view: a frame in 3D."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

import scanfab
from scanfab.cli.console import announce
from scanfab.cli.options import SourceCommand, checked, open_one, options, usage_errors

# letters of the source in the title, which also names frame and strain
LONGEST_SOURCE = 40


@click.command(cls=SourceCommand)
@options("READING", "frame", "SAMPLE", "WINDOW", "cutoff", "axis", "strain")
@click.option(
    "--cut", is_flag=True, help="Cut away the grains in front, and show scan lines in the section."
)
@options("screenshot")
def view(
    sources: tuple[str, ...], frame: int, cut: bool, screenshot: Path | None, **chosen: Any
) -> int:
    """
    Show a frame in 3D: grains, rattlers, and the representative volume (RV).

    SOURCE is the same as for scanfab compute. Boundary particles are not drawn. The loading axis
    points up.
    """
    from scanfab.base.files import check_folder
    from scanfab.table.curves import middle_out
    from scanfab.viz.scene import look_at, section_lines
    from scanfab.viz.window3d import check_screen, show_scene

    reading, settings = checked({**chosen, "variants": "c"}, scanfab.Settings)
    if screenshot is None:
        check_screen()
    elif screenshot.suffix.lower() != ".png":
        raise click.UsageError(f"{screenshot}: screenshots are PNG files: name one .png")
    else:
        with usage_errors():
            check_folder(screenshot)
    series = open_one(sources, reading, "viewed")
    announce([series], settings.workers)
    look = look_at(series, settings, frame)
    scene = look.scene
    if cut:
        scene = replace(scene, lines=section_lines(scene, look.axis))
    none = "" if look.sample.grains.any() else "no grains"
    source = middle_out(series.name, LONGEST_SOURCE)
    title = ", ".join(filter(None, [source, f"frame {look.number}", look.strain, none]))
    show_scene(scene, look.axis, title, screenshot)
    return 0
