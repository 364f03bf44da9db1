"""The report as one HTML page: everything inside, nothing fetched, all text escaped."""

from __future__ import annotations

import base64
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.base.convex import Convex
from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder
from scanfab.base.typing import FloatArray
from scanfab.viz.figures.figure import Figure, drawn_page
from scanfab.viz.figures.style import COLOURS, figure_bytes
from scanfab.viz.scene import SHADES, Scene, towards_viewer

# A browser turns so many spheres without effort.
MOST_GRAINS = 4_000
# Kinds of grains with their colours; the paler ones are for cut grains.
KINDS = (
    {"name": "grains in the RV", "colour": COLOURS["sky"], "pale": "#B4DDF5"},
    {"name": "grains outside", "colour": "#C9CED3", "pale": "#E8EAEC"},
    {"name": "rattlers", "colour": COLOURS["orange"], "pale": "#F5DB9F"},
)

# CSS pixels an inch, and pixels an inch of pictures that are no vectors.
PIXELS, DPI = 96, 130


class Picture(NamedTuple):
    """A figure inside the page."""

    url: str
    """URL with the scheme ``data:``."""
    caption: str
    width: int
    """Width in CSS pixels, at which its letters are as large as those of the page."""


def picture_of(figure: Figure, kind: Literal["svg", "png"]) -> Picture:
    """A figure with its caption, as vectors or as pixels."""
    with drawn_page([figure]) as page:
        data = base64.b64encode(figure_bytes(page, kind, DPI)).decode("ascii")
    url = f"data:image/{'svg+xml' if kind == 'svg' else kind};base64,{data}"
    return Picture(url, figure.caption, round(PIXELS * figure.size[0]))


def check_page_file(path: Path) -> None:
    """SettingsError if no page can be written to a file of this name."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise SettingsError(f"{path}: reports are HTML: name a file that ends in .html")
    check_folder(path)


def render_page(**content: Any) -> str:
    """
    Render the template ``page.html`` with its content.

    ``sections`` has a dictionary for each table. Its ``shown`` is None if the source could not be
    read again.
    """
    import jinja2

    # escapes everything, and JSON in scripts too (the filter tojson)
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.undefined = jinja2.StrictUndefined
    environment.filters["symbols"] = _symbols
    folder = files("scanfab.viz.report")
    template = environment.from_string((folder / "page.html").read_text("utf-8"))
    script = (folder / "page.js").read_text("utf-8")
    return template.render(content=content, script=script)


def _symbols(text: str) -> Any:
    """Escape a text, and make the indices of α subscripts."""
    from markupsafe import Markup, escape

    marked = str(escape(text)).replace("α_vs", "α<sub>vs</sub>")
    return Markup(marked.replace("α_c", "α<sub>c</sub>"))


def view_data(scene: Scene, axis: npt.ArrayLike) -> dict[str, Any]:
    """
    A scene for the page's viewer, in thousandths of half its size; those of grains are whole.

    Parameters
    ----------
    scene : Scene
        One frame.
    axis : array_like, shape (3,)
        Is upright.
    """
    grains = scene.grains
    shown = ~grains.boundary
    position, radius = grains.position[shown] - scene.center, grains.radius[shown]
    distance = np.linalg.norm(grains.places[shown] - scene.center, axis=1)
    nearest = np.argsort(distance, kind="stable")[:MOST_GRAINS]
    reach = np.linalg.norm(position[nearest], axis=1) + radius[nearest]
    size = float(reach.max(initial=0.0)) or scene.window.reach
    scale = 1000.0 / size
    up = np.asarray(axis, dtype=np.float64)
    # the rotation (rows) after which the axis is z; y leads away from the viewer
    away = -towards_viewer(up, scene.space)
    turn = np.stack([np.cross(away, up), away, up])
    shades = [] if grains.body is None else [grains.shade[shown]]
    numbers = np.rint(np.column_stack([position @ turn.T, radius]) * scale)
    spheres = np.column_stack([numbers, grains.kind[shown], *shades]).astype(int)[nearest]
    return {
        "kinds": KINDS,
        "spheres": spheres.tolist(),
        "shades": SHADES if shades else [1.0],
        "axes": _axes(up, turn),
        "rv": scene.window.reach * scale,
        "window": _window_data(scene.window, turn, scale),
        "cutoff": scene.cutoff * scale,
        "size": size,
        "left_out": int(shown.sum() - len(nearest)),
        # the view of discs begins from in front
        **({"start": {"turn": 0, "tilt": 0}} if scene.space.is_plane else {}),
    }


def _window_data(window: Convex, turn: FloatArray, scale: float) -> dict[str, Any]:
    """Planes [x, y, z, distance], quadric (xx yy zz xy xz yz) and level, as the viewer has them."""
    form = turn @ window.quadric.form @ turn.T
    planes = np.column_stack([window.planes[:, :3] @ turn.T, window.planes[:, 3] * scale])
    return {
        "planes": planes.tolist(),
        "form": form[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist(),
        "level": window.quadric.level * scale**2,
    }


def _axes(up: FloatArray, turn: FloatArray) -> list[list[Any]]:
    """Names and unit vectors of x, y, z and the loading axis, as the viewer sees them."""
    axes = [
        [f"{name} (loading)" if one @ up > 1.0 - 1e-9 else name, *(turn @ one).tolist()]
        for name, one in zip("xyz", np.eye(3), strict=True)
    ]
    if up.max() < 1.0 - 1e-9:
        axes.append(["loading", *(turn @ up).tolist()])
    return axes
