"""scanfab view: a frame in 3D."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import READING, SAMPLE, WINDOW, options, usage_errors
from scanfab.cli.sources import SourceCommand, checked, open_one, sources_argument
from scanfab.cli.talk import announce_compiling, talk_options

if TYPE_CHECKING:
    from scanfab.io.series import Series
    from scanfab.pipeline.settings import Settings


# letters of the source in a title, which has frame and strain behind it
LONGEST_SOURCE = 60


@click.command(cls=SourceCommand)
@sources_argument
@options(*READING, "frame", *SAMPLE, *WINDOW, "cutoff", "axis", "strain")
@click.option(
    "--cut", is_flag=True, help="Leave out the grains in front, and show scan lines in the section."
)
@options("screenshot")
@talk_options
def view(
    sources: tuple[str, ...], frame: int, cut: bool, screenshot: Path | None, **chosen: Any
) -> int:
    """
    Show a frame in 3D: grains, rattlers, and the representative volume (RV).

    SOURCE is as for scanfab compute; boundary particles are not drawn, and the loading axis is
    upright.
    """
    from scanfab.base.files import check_folder
    from scanfab.pipeline.settings import Settings

    reading, settings = checked({**chosen, "variants": "c"}, Settings)
    if screenshot is not None:
        if screenshot.suffix.lower() != ".png":
            raise click.UsageError(f"{screenshot}: screenshots are PNG files: name one .png")
        with usage_errors():
            check_folder(screenshot)
    series = open_one(sources, reading, "viewed")
    announce_compiling()
    _show(series, settings, frame, cut, screenshot)
    return 0


def _show(
    series: Series, settings: Settings, frame: int, cut: bool, screenshot: Path | None
) -> None:
    from dataclasses import replace

    from scanfab.table.curves import middle_out, spelt_strain
    from scanfab.viz.scene import look_at, section_lines
    from scanfab.viz.window3d import check_screen, show_scene

    if screenshot is None:
        check_screen()
    look = look_at(series, settings, frame)
    scene = look.scene
    if cut:
        scene = replace(scene, lines=section_lines(scene, look.axis))
    strain = spelt_strain(look.strains, look.strain_column)
    none = "" if look.sample.grains.any() else "no grains"
    source = middle_out(series.name, LONGEST_SOURCE)
    title = ", ".join(filter(None, [source, f"frame {look.number}", strain, none]))
    show_scene(scene, look.axis, title, screenshot)
