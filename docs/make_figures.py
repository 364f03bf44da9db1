"""Draw the pictures of docs/figures.md by the command line, small enough for a page."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from PIL import Image

from scanfab.cli.main import run

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "figures"
SAMPLE = ["sample_data/yade_triaxial", "--boundary", "mask=3"]
TABLE_FIGURES = ("evolution", "normalised", "correlation")
FRAME_FIGURES = ("rose", "projection", "histogram", "cutoffs")
COLOURS = 200


def scanfab(*words: str | Path) -> None:
    """Run a command, which must succeed."""
    if run(list(map(str, words))) != 0:
        raise SystemExit(f"scanfab {' '.join(map(str, words))} failed")


def shrink(picture: Path, target: Path, factor: float = 0.5) -> None:
    """A smaller picture of few colours."""
    image = Image.open(picture).convert("RGB")
    size = (round(factor * image.width), round(factor * image.height))
    small = image.resize(size, Image.Resampling.LANCZOS)
    small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(target, optimize=True)


def main() -> None:
    """All pictures, in the folder of the page."""
    os.chdir(ROOT)
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        table, picture = Path(folder) / "fabric.csv", Path(folder) / "picture.png"
        scanfab("compute", *SAMPLE, "-o", table)
        for name in TABLE_FIGURES:
            scanfab("compare", table, "-o", f"{folder}/x.csv", "--plot", picture, "--figure", name)
            shrink(picture, PICTURES / f"{name}.png")
        for name in FRAME_FIGURES:
            words = ["--variants", "c", "-o", f"{folder}/x.csv", "--plot", picture]
            scanfab("compute", *SAMPLE, *words, "--figure", name)
            shrink(picture, PICTURES / f"{name}.png")
        for name, words in (("view", []), ("cut", ["--cut"])):
            scanfab("view", *SAMPLE, "--frame", "-1", *words, "--screenshot", picture)
            shrink(picture, PICTURES / f"{name}.png", 0.6)


if __name__ == "__main__":
    main()
