"""Around the sample in a 3D view: where the camera stands, title, legend and scale."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.viz.figures.style import rounded_down

# of the picture, pixels
SIZE = (1200, 900)
# of the picture's height: above the sample words, below it the scale
TOP, BOTTOM = 0.13, 0.07
MARGIN = 0.02
# size of letters that can still be read
SMALLEST = 12
# in shares of the picture: a disk of the legend, and the bar of the scale
AROUND = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
DISK = 0.0075 * np.column_stack([np.cos(AROUND), SIZE[0] / SIZE[1] * np.sin(AROUND)])
BAR = np.array([[0.0, 0.03], [1.0, 0.03], [1.0, 0.036], [0.0, 0.036]])


@dataclass(frozen=True)
class Framing:
    """A parallel view that the sample fills, below the words and above the scale."""

    middle: FloatArray
    """What the camera looks at, dump's unit."""
    look: FloatArray
    """From there towards the camera, a unit vector."""
    up: FloatArray
    half: float
    """Half the height of the picture, dump's unit."""

    @classmethod
    def about(
        cls, points: FloatArray, radius: FloatArray, up: FloatArray, look: FloatArray
    ) -> Framing:
        """
        About balls.

        Parameters
        ----------
        points, radius : ndarray, shapes (N, 3) and (N,)
            Their centres and radii, dump's unit; without any the picture is of the origin.
        up, look : ndarray, shape (3,)
            Upwards, and towards the camera; need not be at right angles.
        """
        toward = look / np.linalg.norm(look)
        right = np.cross(up, toward)
        right /= np.linalg.norm(right)
        upright = np.cross(toward, right)
        if len(points) == 0:
            points, radius = np.zeros((1, 3)), np.ones(1)
        sides = [
            ((points @ one - radius).min(), (points @ one + radius).max())
            for one in (right, upright)
        ]
        (left, far_right), (low, high) = sides
        width, height = far_right - left, high - low
        # of the picture's height: the sample, with the words above and the scale below it
        half = 0.5 * max(height / (1.0 - TOP - BOTTOM), width * SIZE[1] / SIZE[0] / 0.96)
        middle = (
            0.5 * (left + far_right) * right
            + (0.5 * (low + high) + (TOP - BOTTOM) * half) * upright
            + (points.mean(axis=0) @ toward) * toward
        )
        return cls(middle, toward, upright, float(half))

    def aim(self, plotter: Any) -> None:
        """Place the camera."""
        plotter.enable_parallel_projection()
        plotter.camera_position = [
            self.middle + 10.0 * self.half * self.look,
            self.middle,
            self.up,
        ]
        plotter.camera.parallel_scale = self.half
        plotter.reset_camera_clipping_range()


def add_words(plotter: Any, title: str, names: Mapping[str, str]) -> None:
    """Title and legend above the sample: dark words, each name beside a disk of its colour."""
    _shrink(plotter, _write(plotter, title, MARGIN, 1.0 - 0.055, 12))
    place = MARGIN
    for name, colour in names.items():
        _draw(plotter, DISK + np.array([place + 0.008, 1.0 - 0.088]), colour)
        _write(plotter, name, place + 0.022, 1.0 - 0.1, 10)
        place += 0.045 + 0.0118 * len(name)


def add_scale(plotter: Any) -> None:
    """A bar with its length in the dump's unit; it follows the zoom of a window."""
    words = _write(plotter, "", 0.0, 0.055, 10)
    bar = _draw(plotter, BAR, "black")

    def update(*_: object) -> None:
        across = 2.0 * plotter.camera.parallel_scale * SIZE[0] / SIZE[1]
        length = rounded_down(0.2 * across)
        left = 1.0 - MARGIN - length / across
        bar.points[:, 0] = np.where(BAR[:, 0] > 0.5, 1.0 - MARGIN, left)
        bar.points[:, 1] = BAR[:, 1]
        bar.Modified()
        words.SetInput(f"{length:g}")
        words.SetPosition(left, 0.045)

    update()
    plotter.camera.AddObserver("ModifiedEvent", update)


def _write(plotter: Any, text: str, x: float, y: float, size: int) -> Any:
    """Words at a place in shares of the window, from the lower left."""
    return plotter.add_text(
        text, position=(x, y), viewport=True, font_size=size, color="black", font="arial"
    )


def _shrink(plotter: Any, words: Any) -> None:
    """Make words smaller until they fit the width of the picture."""
    font, box = words.GetTextProperty(), [0.0] * 4
    words.GetBoundingBox(plotter.renderer, box)
    while box[1] - box[0] > (1.0 - 2.0 * MARGIN) * SIZE[0] and font.GetFontSize() > SMALLEST:
        font.SetFontSize(font.GetFontSize() - 1)
        words.GetBoundingBox(plotter.renderer, box)


def _draw(plotter: Any, corners: FloatArray, colour: str) -> Any:
    """A polygon, in the same shares; returned, so that it can be moved."""
    import pyvista
    from vtkmodules.vtkRenderingCore import vtkActor2D, vtkCoordinate, vtkPolyDataMapper2D

    shape = pyvista.PolyData(
        np.column_stack([corners, np.zeros(len(corners))]),
        faces=[len(corners), *range(len(corners))],
    )
    shares = vtkCoordinate()
    shares.SetCoordinateSystemToNormalizedViewport()
    mapper = vtkPolyDataMapper2D()
    mapper.SetInputData(shape)
    mapper.SetTransformCoordinate(shares)
    actor = vtkActor2D()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*pyvista.Color(colour).float_rgb)
    plotter.renderer.AddActor(actor)
    return shape
