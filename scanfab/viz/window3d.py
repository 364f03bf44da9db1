"""The 3D view of a frame, in a window or as a picture file."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import ScanfabError
from scanfab.base.files import whole_file
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.viz.figures.style import COLOURS
from scanfab.viz.overlay import SIZE, Framing, add_scale, add_words
from scanfab.viz.scene import SHADES, Grains, Scene, towards_viewer
from scanfab.viz.vtk_files import window_mesh

ADVICE = (
    "install one of them: on Debian or Ubuntu apt-get install libegl1 libgl1 libosmesa6, or "
    "apt-get install xvfb and run the command under xvfb-run"
)


def check_screen() -> None:
    """
    Make sure that there is a screen for a window.

    Raises
    ------
    ScanfabError
        If there is none.
    """
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise ScanfabError(
            "this machine has no screen for a window (DISPLAY is not set): "
            'write a picture instead: `screenshot="FILE.png"`'
        )


def show_scene(
    scene: Scene, axis: npt.ArrayLike, title: str = "", screenshot: Path | None = None
) -> None:
    """
    Show the grains of a frame, its RV, and scan lines in a section if the scene has lines.

    Parameters
    ----------
    scene : Scene
        With ``lines``, the grains in front of the RV's centre are left out, so that they are seen.
    axis : array_like, shape (3,)
        Is upright.
    title : str, optional
        Of the window.
    screenshot : Path, optional
        Write a PNG file instead of opening a window.

    Raises
    ------
    ScanfabError
        If nothing can be drawn on this machine.
    """
    if screenshot is not None:
        check_drawing()
    from vtkmodules.vtkCommonCore import vtkLogger

    # VTK would write to standard error; errors tell what is wrong
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        _show(scene, np.asarray(axis, dtype=np.float64), title, screenshot)
    finally:
        vtkLogger.SetStderrVerbosity(before)


def _show(scene: Scene, up: FloatArray, title: str, screenshot: Path | None) -> None:
    import pyvista

    plotter: Any = pyvista.Plotter(
        off_screen=screenshot is not None, window_size=list(SIZE), title=title or "scanfab"
    )
    toward = towards_viewer(up, scene.space)
    is_section = scene.lines is not None or scene.space.is_plane
    look = toward if is_section else toward + 0.45 * np.cross(up, toward) + 0.35 * up
    drawn = _drawn(scene, toward, look)
    _add_grains(plotter, scene, drawn, toward)
    for window in (scene.window, *scene.smaller):
        if window is not None:
            _add_window(plotter, scene, window, toward)
    if scene.lines is not None:
        _add_lines(plotter, scene)
    _framing(scene, drawn, up, look).aim(plotter)
    add_words(plotter, title, _words(scene))
    add_scale(plotter)
    plotter.enable_anti_aliasing("ssaa")
    plotter.add_axes(line_width=3, color="black", viewport=(0.0, 0.0, 0.16, 0.2))
    if screenshot is None:
        plotter.show()
        return
    try:
        with whole_file(screenshot) as part:
            plotter.screenshot(str(part))
    finally:
        plotter.close()


def check_drawing() -> None:
    """
    Make sure that VTK can draw without a screen, in a process of its own: where it cannot, it may
    crash instead of saying so.

    Raises
    ------
    ScanfabError
        If it cannot; says what to install.
    """
    code = (
        "from vtkmodules.vtkRenderingCore import vtkRenderWindow; "
        "import vtkmodules.vtkRenderingOpenGL2; "
        "w = vtkRenderWindow(); w.SetOffScreenRendering(1); w.SetSize(8, 8); "
        "w.Render()"
    )
    command = [sys.executable, "-c", code]
    if subprocess.run(command, capture_output=True, check=False).returncode != 0:
        raise ScanfabError(f"VTK finds no OpenGL, EGL or OSMesa library to draw with: {ADVICE}")


def classes(grains: Grains, has_window: bool) -> dict[str, tuple[str, BoolArray]]:
    """What is told apart by colour: name, colour, and which grains."""
    grain = ~grains.boundary
    held = grain & ~grains.rattler
    if not has_window:
        found = {"grain": (COLOURS["sky"], held)}
    else:
        found = {
            "grain in the RV": (COLOURS["sky"], held & grains.in_window),
            "grain outside": ("#D2D7DB", held & ~grains.in_window),
        }
    found["rattler"] = (COLOURS["orange"], grain & grains.rattler)
    return {name: value for name, value in found.items() if value[1].any()}


def shades(
    grains: Grains, kinds: dict[str, tuple[str, BoolArray]]
) -> Iterator[tuple[str, BoolArray]]:
    """The colours of these classes, each in some shades that tell neighbouring clumps apart."""
    from pyvista import Color

    for colour, kind in kinds.values():
        if grains.body is None:
            yield colour, kind
            continue
        for number, shade in enumerate(SHADES):
            mixed = Color([part * shade for part in Color(colour).float_rgb])
            yield mixed.hex_rgb, kind & (grains.shade == number)


def _drawn(scene: Scene, toward: FloatArray, look: FloatArray) -> BoolArray:
    """
    Which grains are drawn.

    Of a section those that reach behind its plane; else those in the RV, and of those outside,
    which would hide it in front, the half behind its centre.
    """
    grains = scene.grains
    branch = grains.position - scene.center
    if scene.lines is not None or scene.space.is_plane:
        shown = branch @ toward < grains.radius
    elif scene.window is not None:
        shown = grains.in_window | ((grains.places - scene.center) @ look <= 0.0)
    else:
        shown = np.ones(len(branch), bool)
    return np.asarray(shown & ~grains.boundary)


def _framing(scene: Scene, drawn: BoolArray, up: FloatArray, look: FloatArray) -> Framing:
    """About all that is drawn."""
    points, radius = scene.grains.position[drawn], scene.grains.radius[drawn]
    if scene.window is not None:
        points = np.vstack([points, scene.center])
        radius = np.append(radius, scene.window.reach)
    return Framing.about(points, radius, up, look)


def _add_grains(plotter: Any, scene: Scene, drawn: BoolArray, toward: FloatArray) -> None:
    """Balls; if the scene has lines, cut by the plane through the centre."""
    grains = scene.grains
    height = (grains.position - scene.center) @ toward
    is_section = scene.lines is not None or scene.space.is_plane
    for colour, kind in shades(grains, classes(grains, scene.window is not None)):
        chosen = kind & drawn
        if not chosen.any():
            continue
        if is_section:
            _add_section(
                plotter,
                grains,
                chosen & (height > -grains.radius),
                height,
                toward,
                colour if scene.space.is_plane and scene.lines is None else _pale(colour),
            )
        if scene.space.is_plane:
            continue
        balls = _balls(grains.position[chosen], grains.radius[chosen])
        if is_section:
            balls = balls.clip(normal=toward, origin=scene.center)
        plotter.add_mesh(balls, color=colour, smooth_shading=True, ambient=0.2, specular=0.2)


def _pale(colour: str) -> str:
    """Of a section, paler than the balls behind it."""
    import pyvista

    light = 0.45 * np.array(pyvista.Color(colour).float_rgb) + 0.55
    return str(pyvista.Color(light.tolist()).hex_rgb)


def _balls(position: FloatArray, radius: FloatArray) -> Any:
    import pyvista

    cloud = pyvista.PolyData(position)
    cloud.point_data["diameter"] = 2.0 * radius
    # fewer triangles for large samples
    fineness = 24 if len(radius) < 5_000 else 12
    ball = pyvista.Sphere(radius=0.5, theta_resolution=fineness, phi_resolution=fineness)
    return cloud.glyph(geom=ball, scale="diameter", orient=False)


def _add_section(
    plotter: Any,
    grains: Grains,
    chosen: BoolArray,
    height: FloatArray,
    toward: FloatArray,
    colour: str,
) -> None:
    """The disks in which a plane cuts grains; of discs themselves."""
    import pyvista

    if not chosen.any():
        return
    cloud = pyvista.PolyData(grains.position[chosen] - height[chosen, None] * toward)
    cloud.point_data["diameter"] = 2.0 * np.sqrt(grains.radius[chosen] ** 2 - height[chosen] ** 2)
    disk = pyvista.Disc(inner=0.0, outer=0.5, normal=toward, c_res=48)
    disks = cloud.glyph(geom=disk, scale="diameter", orient=False)
    plotter.add_mesh(disks, color=colour, lighting=False)


def _add_window(plotter: Any, scene: Scene, window: Convex, toward: FloatArray) -> None:
    """An RV's surface; in a section its outline."""
    import pyvista

    center = tuple(scene.center)
    if scene.lines is None and not window.is_flat:
        surface = window_mesh(scene.center, window, nsub=5)
        smooth = not len(window.planes)
        plotter.add_mesh(surface, color=COLOURS["blue"], opacity=0.12, smooth_shading=smooth)
        return
    if window.is_sphere:
        radius = window.reach
        outline = pyvista.Disc(
            center=center, inner=radius, outer=1.008 * radius, normal=toward, c_res=180
        )
    else:
        mesh = window_mesh(scene.center, window)
        cut = mesh if window.is_flat else mesh.slice(normal=toward, origin=center)
        outline = cut.tube(radius=0.004 * window.reach)
    plotter.add_mesh(outline, color=COLOURS["blue"], lighting=False)


def _add_lines(plotter: Any, scene: Scene) -> None:
    """Void segments as tubes: kept and dropped."""
    import pyvista

    lines = scene.lines
    assert lines is not None
    kept = lines.void & (lines.length >= scene.cutoff)
    thickness = 0.14 * float(scene.grains.radius[~scene.grains.boundary].mean())
    for chosen, colour in ((kept, "black"), (lines.void & ~kept, "vermilion")):
        if chosen.any():
            segments = pyvista.line_segments_from_points(lines.ends[chosen].reshape(-1, 3))
            tubes = segments.tube(radius=thickness)
            plotter.add_mesh(tubes, color=COLOURS[colour], lighting=False)


def _words(scene: Scene) -> dict[str, str]:
    """Names of the legend, each with its colour."""
    found = classes(scene.grains, scene.window is not None)
    names = {name: colour for name, (colour, _) in found.items()}
    if scene.lines is not None:
        names |= {"void segment kept": COLOURS["black"], "dropped": COLOURS["vermilion"]}
    return names
