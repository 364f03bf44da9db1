"""The report as one HTML page: everything inside, nothing fetched, all text escaped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.errors import SettingsError
from scanfab.scene import Scene
from scanfab.writers.files import check_folder, whole_file
from scanfab.writers.plot import COLOURS

__all__ = [
    "Content",
    "Part",
    "Picture",
    "Section",
    "check_page_file",
    "render_page",
    "save_page",
    "view_data",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

# spheres that a browser turns without effort
MOST_GRAINS = 4_000
MOST_PIECES = 1_000
KIND_COLOURS = (COLOURS["sky"], "#A9AFB5", COLOURS["orange"])


@dataclass(frozen=True)
class Picture:
    """A figure inside the page."""

    url: str
    """With the scheme ``data:``."""
    caption: str


@dataclass(frozen=True)
class Part:
    """A table to be shown."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


@dataclass(frozen=True)
class Section:
    """What is known of one computation."""

    title: str
    missing: str = ""
    """Why nothing is known."""
    command: str = ""
    settings: Sequence[tuple[str, str, str]] = ()
    versions: Sequence[tuple[str, str]] = ()
    inputs: Part = field(default_factory=lambda: Part((), ()))
    view: Mapping[str, Any] | None = None
    view_title: str = ""
    no_view: str = ""
    pictures: Sequence[Picture] = ()


@dataclass(frozen=True)
class Content:
    """All that the page tells."""

    summary: Sequence[str]
    results: Sequence[Sequence[str]]
    pictures: Sequence[Picture]
    warnings: Sequence[str]
    sections: Sequence[Section]
    frames: Part


def check_page_file(path: Path) -> None:
    """SettingsError if no page can be written to a file of this name."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise SettingsError(f"{path}: reports are HTML: name a file that ends in .html")
    check_folder(path)


def save_page(path: Path, page: str) -> None:
    """Write a page; the file is complete or untouched."""
    with whole_file(path) as part:
        part.write_text(page, encoding="utf-8", errors="backslashreplace")


def render_page(content: Content) -> str:
    """The page."""
    import jinja2

    # escapes everything, and JSON in scripts too (the filter tojson)
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    folder = files("scanfab.writers")
    template = environment.from_string((folder / "page.html").read_text("utf-8"))
    script = (folder / "page.js").read_text("utf-8")
    return template.render(content=content, script=script)


def view_data(scene: Scene, axis: npt.ArrayLike) -> dict[str, Any]:
    """
    A scene for the page's viewer: whole numbers, thousandths of the half size of the scene.

    Parameters
    ----------
    scene : Scene
        With ``lines``, if scan lines are to be shown.
    axis : array_like, shape (3,)
        Is upright.
    """
    grains = scene.grains
    shown = ~grains.boundary
    position = grains.position[shown] - scene.center
    radius = grains.radius[shown]
    nearest = np.argsort(np.linalg.norm(position, axis=1), kind="stable")[:MOST_GRAINS]
    reach = np.linalg.norm(position[nearest], axis=1) + radius[nearest]
    size = float(reach.max(initial=0.0))
    scale = 1000.0 / (size or scene.window_radius or 1.0)
    turn = _upright(np.asarray(axis, dtype=np.float64))
    kinds = np.where(grains.in_window[shown], 0, 1)
    kinds[grains.rattler[shown]] = 2
    names = ["grains in the RV", "grains outside", "rattlers"]
    if scene.window_radius is None:
        names[1] = "grains"
    numbers = np.column_stack([position @ turn.T, radius])[nearest] * scale
    return {
        "kinds": [
            {"name": name, "colour": colour}
            for name, colour in zip(names, KIND_COLOURS, strict=True)
        ],
        "spheres": [
            [*values, kind]
            for values, kind in zip(
                np.rint(numbers).astype(int).tolist(), kinds[nearest].tolist(), strict=True
            )
        ],
        "pieces": _pieces(scene, turn, scale),
        "rv": None if scene.window_radius is None else round(scene.window_radius * scale),
        "left_out": int(shown.sum() - len(nearest)),
    }


def _upright(axis: FloatArray) -> FloatArray:
    """The rotation (rows) after which the axis is z."""
    across = np.eye(3)[np.argmin(np.abs(axis))]
    first = across - (across @ axis) * axis
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def _pieces(scene: Scene, turn: FloatArray, scale: float) -> list[list[int]]:
    """Void segments: both ends, and whether they are kept."""
    if scene.lines is None:
        return []
    lines = scene.lines
    void = np.flatnonzero(lines.void)[:MOST_PIECES]
    ends = (lines.ends[void] - scene.center) @ turn.T * scale
    kept = lines.length[void] >= scene.cutoff
    return [
        [*values, int(keep)]
        for values, keep in zip(
            np.rint(ends.reshape(-1, 6)).astype(int).tolist(), kept.tolist(), strict=True
        )
    ]
