"""
Draw all pictures of the documentation: those of docs/figures.md and docs/picture.png.

Each picture carries, as text in its PNG file, the words and numbers that it was drawn from. A test
makes these again, without drawing, and says which pictures are no longer what the code draws.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyvista
from matplotlib.collections import Collection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from stored_figures import STORED

from scanfab.cli.main import run
from scanfab.viz import window3d as view

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "figures"
COVER = ROOT / "docs" / "picture.png"
SAMPLE = ["sample_data/yade_triaxial", "--boundary", "mask=3"]
# less than the sample's own error of 1e-3 by enough for a picture, and the test is fast
SCAN = ["--tolerance", "2e-4"]
TABLE_FIGURES = ("evolution", "normalised", "correlation")
FRAME_FIGURES = ("rose", "projection", "histogram", "cutoffs")
VIEWS: dict[str, list[str]] = {"view": [], "cut": ["--cut"]}
# those of the paper's experiment in docs/validation.md
PAPER = ROOT / "sample_data" / "paper" / "yade_1_default.csv"
PAPER_FIGURES = {f"paper-{name}": name for name in TABLE_FIGURES}
COVER_HEIGHT = 480
COLOURS = 200
KEY = "drawn from"

Content = list[str | float]
"""Words and numbers, in the order in which they were drawn."""


def made(folder: Path, draw: bool = True) -> dict[str, Content]:
    """Run the commands of all pictures, into a folder, and tell what each was drawn from."""
    found: dict[str, Content] = {}
    table = folder / "fabric.csv"
    scanfab("compute", *SAMPLE, *SCAN, "-o", table)
    for name in TABLE_FIGURES:
        words = ["-o", folder / "x.csv", "--plot", folder / f"{name}.png", "--figure", name]
        with watched(draw) as found[name]:
            scanfab("compare", table, *words)
    for picture, name in PAPER_FIGURES.items():
        words = ["-o", folder / "x.csv", "--plot", folder / f"{picture}.png", "--figure", name]
        with watched(draw) as found[picture]:
            scanfab("compare", PAPER, *words)
    for name in FRAME_FIGURES:
        words = ["-o", folder / "x.csv", "--plot", folder / f"{name}.png", "--figure", name]
        with watched(draw) as found[name]:
            # its first and last frame
            chosen = ["--variants", "c", "--frames", "::6"]
            scanfab("compute", *SAMPLE, *SCAN, *chosen, *words)
    for name, more in VIEWS.items():
        words = ["--frame", "-1", *more, "--screenshot", folder / f"{name}.png"]
        with watched(draw) as found[name]:
            scanfab("view", *SAMPLE, *words)
    for name, draw_stored in STORED.items():
        with watched(draw) as found[name]:
            draw_stored(folder / f"{name}.png")
    return {**found, "picture": [*found["cut"], *found["evolution"]]}


def scanfab(*words: str | Path) -> None:
    """Run a command, which must succeed."""
    if run(list(map(str, words))) != 0:
        raise SystemExit(f"scanfab {' '.join(map(str, words))} failed")


@contextmanager
def watched(draw: bool) -> Iterator[Content]:
    """What a figure or a view holds when it is saved; if not drawn, it saves an empty file."""
    content: Content = []
    save, shoot = Figure.savefig, pyvista.Plotter.screenshot

    def savefig(figure: Figure, path: Path, **rest: Any) -> None:
        content.extend(of_figure(figure))
        if draw:
            save(figure, path, **rest)

    def screenshot(plotter: Any, path: str, **rest: Any) -> None:
        content.extend(of_view(plotter))
        shoot(plotter, path, **rest) if draw else Path(path).touch()

    with ExitStack() as stack:
        stack.enter_context(patch.object(Figure, "savefig", savefig))
        stack.enter_context(patch.object(pyvista.Plotter, "screenshot", screenshot))
        if not draw:
            stack.enter_context(patch.object(view, "check_drawing", lambda: None))
        yield content


def of_figure(figure: Figure) -> Content:
    """Its size, words and data, without what matplotlib adds by itself, such as ticks."""
    content: Content = [*map(float, figure.get_size_inches())]
    for legend in of_all_parts(figure, "legends"):
        content.extend(words_of([legend.get_title(), *legend.get_texts()]))
    for axes in figure.axes:
        titles = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label]
        content.extend(words_of([*titles, *axes.texts]))
        if axes.get_legend() is not None:
            content.extend(words_of(axes.get_legend().get_texts()))
        for line in axes.lines:
            data = np.asarray([line.get_xdata(), line.get_ydata()], np.float64)
            content.extend([to_hex(line.get_color()), *spread(data)])
        for collection in axes.collections:
            content.extend(of_collection(collection))
    return content


def of_all_parts(figure: Any, name: str) -> list[Any]:
    """What a figure and the figures within it have of one kind."""
    parts = [figure, *figure.subfigs]
    return [one for part in parts for one in getattr(part, name)]


def words_of(texts: Iterable[Text]) -> list[str]:
    return [text.get_text() for text in texts if text.get_text()]


def of_collection(collection: Collection) -> Content:
    """Areas, bars and coloured meshes: how their corners and their values are spread."""
    paths = [path.vertices for path in collection.get_paths()]
    content: Content = [*spread(np.concatenate(paths).T)] if paths else []
    values = collection.get_array()
    return content if values is None else [*content, *spread(np.ravel(values)[None])]


def of_view(plotter: Any) -> Content:
    """Where the camera is, and what stands where in which colour, with which words."""
    content: Content = [*map(float, plotter.window_size)]
    content.extend(float(x) for place in plotter.camera_position for x in place)
    for actor in plotter.renderer.actors.values():
        content.append(type(actor).__name__)
        words = getattr(actor, "GetInput", lambda: None)()
        content.extend([words] if isinstance(words, str) else [])
        if hasattr(actor, "GetNumberOfEntries"):
            content.extend(actor.GetEntryString(k) for k in range(actor.GetNumberOfEntries()))
        if isinstance(actor, pyvista.Actor):
            content.extend([to_hex(actor.prop.color.float_rgb), *map(float, actor.bounds)])
    return content


def spread(data: Any) -> list[float]:
    """Length, smallest, largest, mean and deviation of each coordinate."""
    numbers = [float(data.shape[1])]
    for row in np.ma.filled(np.ma.asarray(data, np.float64), np.nan):
        known = row[np.isfinite(row)]
        if len(known):
            numbers += [known.min(), known.max(), known.mean(), known.std()]
    return [float(f"{number:.6g}") for number in numbers]


def differences(stored: Content, now: Content) -> list[str]:
    """What two contents differ in; last digits depend on the machine."""
    if len(stored) != len(now):
        return [f"{len(stored)} words and numbers, now {len(now)}"]
    pairs = zip(stored, now, strict=True)
    return [f"{one!r}, now {two!r}" for one, two in pairs if not _same(one, two)]


def _same(one: str | float, two: str | float) -> bool:
    if isinstance(one, str) or isinstance(two, str):
        return one == two
    return math.isclose(one, two, rel_tol=1e-3, abs_tol=1e-6)


def content_of(picture: Path) -> Content:
    """What a picture of the documentation says that it was drawn from; nothing if it does not."""
    with Image.open(picture) as image:
        content: Content = json.loads(image.info.get(KEY, "[]"))
    return content


def shrink(image: Image.Image, target: Path, content: Content, factor: float = 1.0) -> None:
    """A smaller picture of few colours, and what it was drawn from."""
    size = (round(factor * image.width), round(factor * image.height))
    small = image.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    info = PngInfo()
    info.add_text(KEY, json.dumps(content), zip=True)
    few = small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    few.save(target, optimize=True, pnginfo=info)


def side_by_side(parts: Iterable[Image.Image], height: int) -> Image.Image:
    """Pictures in one row."""
    scaled = [
        part.convert("RGB").resize(
            (round(part.width * height / part.height), height), Image.Resampling.LANCZOS
        )
        for part in parts
    ]
    strip = Image.new("RGB", (sum(part.width for part in scaled), height), "white")
    left = 0
    for part in scaled:
        strip.paste(part, (left, 0))
        left += part.width
    return strip


def main() -> None:
    """All pictures, in the folder of the page."""
    os.chdir(ROOT)
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        contents = made(Path(folder))
        for name in (*TABLE_FIGURES, *PAPER_FIGURES, *FRAME_FIGURES, *VIEWS, *STORED):
            factor = 0.6 if name in VIEWS else 0.5
            image = Image.open(Path(folder) / f"{name}.png")
            shrink(image, PICTURES / f"{name}.png", contents[name], factor)
        parts = [Image.open(Path(folder) / f"{name}.png") for name in ("cut", "evolution")]
        shrink(side_by_side(parts, COVER_HEIGHT), COVER, contents["picture"])


if __name__ == "__main__":
    main()
