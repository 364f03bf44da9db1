"""Draw the figures of the site: by the commands that its pages show, and from stored numbers."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stored_figures import STORED

from scanfab.cli.main import run

DOCS = Path(__file__).parents[1]
FIGURES = DOCS / "figures"
PAGES = ("gallery.md", "validation.md")


@contextmanager
def workplace() -> Iterator[Path]:
    """A new folder with the sample data, as the current folder."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(DOCS.parent / "sample_data", Path(folder) / "sample_data")
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(before)


def commands(page: str) -> list[str]:
    """The commands of a page in its blocks that are marked sh."""
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.replace("\\\n", "").splitlines()]


def draw() -> None:
    """Draw all figures; views in 3D need a graphics library and are kept in docs/figures."""
    FIGURES.mkdir(exist_ok=True)
    for name, draw_stored in STORED.items():
        draw_stored(FIGURES / f"{name}.png")
    with workplace() as folder:
        (folder / "figures").symlink_to(FIGURES)
        for line in (line for page in PAGES for line in commands(page)):
            _, command, *words = shlex.split(line, comments=True)
            if command != "view" and run([command, *words, "--quiet"]) != 0:
                raise SystemExit(f"{line}: failed")
