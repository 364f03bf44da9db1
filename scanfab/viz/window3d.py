"""The 3D view of a frame, in a window or as a picture file."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista

from scanfab.base.errors import ScanfabError
from scanfab.base.files import whole_file
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.viz.figures.style import COLOURS
from scanfab.viz.meshes import lines_mesh, window_mesh
from scanfab.viz.scene import SHADES, Scene, towards_viewer

ADVICE = (
    "install one of them: on Debian or Ubuntu apt-get install libegl1 libgl1 libosmesa6, or "
    "apt-get install xvfb and run the command under xvfb-run"
)
# Size of the picture, pixels.
SIZE = (1200, 900)
# Shares of the picture's height for the words above the sample, and for the scale below it.
TOP, BOTTOM = 0.13, 0.07
MARGIN = 0.02


def check_screen() -> None:
    """
    Make sure that there is a screen for a window.

    Raises
    ------
    ScanfabError
        If there is none.
    """
    has_screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform.startswith("linux") and not has_screen:
        problem = "this machine has no screen for a window (DISPLAY is not set)"
        raise ScanfabError(f'{problem}: write a picture instead: `screenshot="FILE.png"`')


def check_drawing() -> None:
    """
    Make sure that VTK can draw without a screen.

    This is tried in a process of its own, as VTK may crash instead of raising an error.

    Raises
    ------
    ScanfabError
        If it cannot. The message says what to install.
    """
    code = "import pyvista; pyvista.Plotter(off_screen=True, window_size=[8, 8]).show()"
    tried = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    if tried.returncode != 0:
        raise ScanfabError(f"VTK finds no OpenGL, EGL or OSMesa library to draw with: {ADVICE}")


def show_scene(scene: Scene, axis: npt.ArrayLike, title: str, screenshot: Path | None) -> None:
    """
    Show the grains of a frame, its RV, and scan lines in a section if the scene has lines.

    Parameters
    ----------
    scene : Scene
        If it has ``lines``, the grains in front of them are left out.
    axis : array_like, shape (3,)
        This axis is upright.
    title : str
        Title of the window.
    screenshot : Path or None
        Write a PNG file instead of opening a window.

    Raises
    ------
    ScanfabError
        If nothing can be drawn on this machine.
    """
    if screenshot is not None:
        check_drawing()
    # VTK would write to standard error; exceptions report what is wrong
    with pyvista.vtk_verbosity("off"):
        is_file = screenshot is not None
        plotter: Any = pyvista.Plotter(off_screen=is_file, window_size=list(SIZE), title=title)
        _draw(plotter, scene, np.asarray(axis, dtype=np.float64), title)
        if screenshot is None:
            plotter.show()
            return
        with whole_file(screenshot) as part:
            plotter.screenshot(str(part))
        plotter.close()


def _draw(plotter: Any, scene: Scene, up: FloatArray, title: str) -> None:
    """Draw the scene, and place the camera."""
    grains, window, toward = scene.grains, scene.window, towards_viewer(up, scene.space)
    look = toward if scene.is_section else toward + 0.45 * np.cross(up, toward) + 0.35 * up
    shown = ~grains.boundary
    if scene.is_section:
        shown &= (grains.position - scene.center) @ toward < grains.radius
    else:
        # grains outside the RV and in front of its centre would hide it
        shown &= grains.in_window | ((grains.places - scene.center) @ look <= 0.0)
    names = _add_grains(plotter, scene, shown, toward)
    for one in reversed(scene.windows):
        mesh, smooth = window_mesh(scene.center, one, nsub=5), not len(one.planes)
        style: dict[str, Any] = {"opacity": 0.12, "smooth_shading": smooth}
        if scene.is_section:
            # its outline
            cut = mesh if one.is_flat else mesh.slice(normal=toward, origin=scene.center)
            mesh, style = cut.tube(radius=0.004 * one.reach), {"lighting": False}
        plotter.add_mesh(mesh, color=COLOURS["blue"], **style)
    if scene.lines is not None:
        names |= _add_lines(plotter, scene)
    points = np.vstack([grains.position[shown], scene.center])
    radius = np.append(grains.radius[shown], window.reach)
    aim(plotter, points, radius, up, look)
    add_words(plotter, title, names)
    plotter.enable_anti_aliasing("ssaa")
    plotter.add_axes(line_width=3, color="black", viewport=(0.0, 0.0, 0.16, 0.2))


def _add_grains(plotter: Any, scene: Scene, shown: BoolArray, toward: FloatArray) -> dict[str, str]:
    """
    Draw grains as balls, in a section cut by the plane through the centre; discs as disks.

    Gives back the names of the legend with their colours.
    """
    grains, is_flat = scene.grains, scene.space.is_plane
    kinds = [
        ("grain in the RV", COLOURS["sky"]),
        ("grain outside", "#D2D7DB"),
        ("rattler", COLOURS["orange"]),
    ]
    colours = np.array([pyvista.Color(colour).float_rgb for _, colour in kinds])[grains.kind]
    colours *= np.array(SHADES)[grains.shade][:, None]
    position, radius = grains.position, grains.radius
    height = (position - scene.center) @ toward
    cut = shown & (height > -radius)
    if scene.is_section and cut.any():
        places = position[cut] - height[cut, None] * toward
        # paler than the balls behind them
        pale = colours if is_flat and scene.lines is None else 0.45 * colours + 0.55
        disk = pyvista.Disc(inner=0.0, outer=0.5, normal=toward, c_res=48)
        disks = _glyphs(places, np.sqrt(radius[cut] ** 2 - height[cut] ** 2), disk, pale[cut])
        plotter.add_mesh(disks, scalars="colour", rgb=True, lighting=False)
    if shown.any() and not is_flat:
        # fewer triangles for large samples
        fine = 24 if shown.sum() < 5_000 else 12
        ball = pyvista.Sphere(radius=0.5, theta_resolution=fine, phi_resolution=fine)
        balls = _glyphs(position[shown], radius[shown], ball, colours[shown])
        if scene.is_section:
            balls = balls.clip(normal=toward, origin=scene.center)
        look = {"smooth_shading": True, "ambient": 0.2, "specular": 0.2}
        plotter.add_mesh(balls, scalars="colour", rgb=True, **look)
    found = set(grains.kind[~grains.boundary])
    return dict(kind for number, kind in enumerate(kinds) if number in found)


def _glyphs(places: FloatArray, radius: FloatArray, shape: Any, colours: FloatArray) -> Any:
    """Copies of a shape of diameter 1 at places, scaled to radii."""
    cloud = pyvista.PolyData(places)
    cloud.point_data["diameter"] = 2.0 * radius
    cloud.point_data["colour"] = np.rint(255.0 * colours).astype(np.uint8)
    return cloud.glyph(geom=shape, scale="diameter", orient=False)


def _add_lines(plotter: Any, scene: Scene) -> dict[str, str]:
    """Draw void segments as tubes; gives back names of the legend with their colours."""
    lines, names = scene.lines, dict[str, str]()
    assert lines is not None
    kept = lines.void & (lines.length >= scene.cutoff)
    thickness = 0.14 * float(scene.grains.radius[~scene.grains.boundary].mean())
    for name, chosen, colour in (
        ("void segment kept", kept, COLOURS["black"]),
        ("dropped", lines.void & ~kept, COLOURS["vermilion"]),
    ):
        if chosen.any():
            tubes = lines_mesh(lines.ends[chosen]).tube(radius=thickness)
            plotter.add_mesh(tubes, color=colour, lighting=False)
            names[name] = colour
    return names


def aim(
    plotter: Any, points: FloatArray, radius: FloatArray, up: FloatArray, look: FloatArray
) -> None:
    """
    Place the camera of a parallel view, so that balls fill the picture between words and scale.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Its camera is placed.
    points, radius : ndarray, shapes (N, 3) and (N,)
        Centres and radii of the balls, at least one, dump's unit.
    up, look : ndarray, shape (3,)
        Vectors upwards and towards the camera, at any angle.
    """
    toward = look / np.linalg.norm(look)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    upright = np.cross(toward, right)
    frame = np.stack([right, upright, toward])
    at = points @ frame.T
    low, high = (at - radius[:, None]).min(axis=0), (at + radius[:, None]).max(axis=0)
    width, height, _ = high - low
    # half the picture's height holds the sample, the words above and the scale below it
    half = 0.5 * max(height / (1.0 - TOP - BOTTOM), width * SIZE[1] / SIZE[0] / 0.96)
    middle = 0.5 * (low + high) + np.array([0.0, (TOP - BOTTOM) * half, 0.0])
    middle[2] = at[:, 2].mean()
    middle = middle @ frame
    plotter.enable_parallel_projection()
    plotter.camera_position = [middle + 10.0 * half * toward, middle, upright]
    plotter.camera.parallel_scale = half
    plotter.reset_camera_clipping_range()


def add_words(plotter: Any, title: str, names: Mapping[str, str]) -> None:
    """Write title and legend above the sample, and a ruler in the dump's unit below it."""
    look: Any = {"viewport": True, "font": "arial"}
    plotter.add_text(title, (MARGIN, 1.0 - 0.055), font_size=12, color="black", **look)
    place = MARGIN
    for name, colour in names.items():
        plotter.add_text("\u2022", (place, 1.0 - 0.112), font_size=22, color=colour, **look)
        plotter.add_text(name, (place + 0.022, 1.0 - 0.1), font_size=10, color="black", **look)
        place += 0.045 + 0.0118 * len(name)
    hidden = {f"{side}_axis_visibility": False for side in ("top", "left", "right")}
    plotter.add_legend_scale(color="black", legend_visibility=False, **hidden)
