"""scanfab view: a frame in 3D."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from scanfab.cli.options import (
    SourceCommand,
    fill_from_file,
    open_series,
    reading_arguments,
    reading_options,
    sample_options,
)

if TYPE_CHECKING:
    from scanfab.series import Series
    from scanfab.settings import Settings

__all__ = ["view"]


@click.command(cls=SourceCommand)
@click.argument(
    "sources",
    metavar="SOURCE...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, allow_dash=True),
)
@reading_options
@sample_options
@click.option(
    "--frame",
    default=0,
    show_default=True,
    metavar="K",
    help="Which frame; negative: from the end.",
)
@click.option(
    "--rv",
    default=0.7,
    show_default=True,
    metavar="FRACTION",
    help="Radius of the sphere RV, as a fraction of half the smallest extent of the grains.",
)
@click.option("--rv-radius", type=float, metavar="L", help="The same in the dump's units.")
@click.option(
    "--rv-center", nargs=3, type=float, metavar="X Y Z", help="Centre of the RV (default: middle)."
)
@click.option(
    "--cutoff",
    default="1rmin",
    show_default=True,
    metavar="L",
    help="Shortest void segment kept: in the dump's units, or with rmin, rmean, rmax.",
)
@click.option("--axis", default="z", show_default=True, metavar="x|y|z|X,Y,Z", help="Is upright.")
@click.option(
    "--cut", is_flag=True, help="Leave out the grains in front, and show scan lines in the section."
)
@click.option(
    "--screenshot",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.png",
    help="Write a picture instead of opening a window; needs no screen.",
)
@click.pass_context
def view(
    ctx: click.Context,
    /,
    sources: tuple[str, ...],
    frame: int,
    cut: bool,
    screenshot: Path | None,
    **options: Any,
) -> int:
    """
    Show a frame in 3D: grains, rattlers, and the representative volume (RV).

    SOURCE is as for scanfab compute; boundary particles are not drawn.
    """
    from scanfab.cli.console import reported_warnings
    from scanfab.errors import SettingsError
    from scanfab.settings import Settings
    from scanfab.writers.plot import check_folder

    options = fill_from_file(ctx, sources, options)
    reading = reading_arguments(options)
    with reported_warnings():
        try:
            settings = Settings.make(variants="c", **options)
            if screenshot is not None:
                if screenshot.suffix.lower() != ".png":
                    raise SettingsError(f"{screenshot}: screenshots are PNG files: name one .png")
                check_folder(screenshot)
        except SettingsError as error:
            raise click.UsageError(str(error)) from None
        series = open_series(sources, reading)
        if len(series) > 1:
            names = ", ".join(one.name for one in series)
            raise click.UsageError(f"one series can be viewed at a time, found {names}")
        _show(series[0], settings, frame, cut, screenshot)
    return 0


def _show(
    series: Series, settings: Settings, frame: int, cut: bool, screenshot: Path | None
) -> None:
    from dataclasses import replace

    from scanfab.frame_view import scene_at
    from scanfab.scene import section_lines
    from scanfab.writers.view import check_screen, show_scene

    if screenshot is None:
        check_screen()
    scene = scene_at(series, settings, frame)
    if cut:
        scene = replace(scene, lines=section_lines(scene, settings.axis))
    show_scene(scene, settings.axis, f"{series.name}, frame {frame}", screenshot)
