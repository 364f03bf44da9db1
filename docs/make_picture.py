"""Draw docs/picture.png: a section with scan lines, and what a triaxial test gives."""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

from scanfab.cli.main import run

ROOT = Path(__file__).parents[1]
SAMPLE = [str(ROOT / "sample_data" / "yade_triaxial"), "--boundary", "mask=3"]
HEIGHT = 480


def main() -> None:
    """Both parts by the command line, side by side."""
    with tempfile.TemporaryDirectory() as folder:
        view, curves = f"{folder}/view.png", f"{folder}/curves.png"
        run(["view", *SAMPLE, "--frame", "-1", "--cut", "--screenshot", view])
        words = ["-o", f"{folder}/fabric.csv", "--plot", curves, "--figure", "evolution"]
        run(["compute", *SAMPLE, *words])
        parts = [Image.open(path).convert("RGB") for path in (view, curves)]
    scaled = [
        part.resize((round(part.width * HEIGHT / part.height), HEIGHT), Image.Resampling.LANCZOS)
        for part in parts
    ]
    strip = Image.new("RGB", (sum(part.width for part in scaled), HEIGHT), "white")
    strip.paste(scaled[0], (0, 0))
    strip.paste(scaled[1], (scaled[0].width, 0))
    strip.quantize(200, Image.Quantize.MAXCOVERAGE).save(
        ROOT / "docs" / "picture.png", optimize=True
    )


if __name__ == "__main__":
    main()
