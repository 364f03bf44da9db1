"""Draw the figures of the site: by the commands that its pages show, and from stored numbers."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stored_figures import STORED

from scanfab.cli.main import run

DOCS = Path(__file__).parents[1]
FIGURES = DOCS / "figures"
PAGES = ("gallery.md", "validation.md")


def shipped_samples() -> list[Path]:
    """The files below sample_data/ that a wheel holds, by the rules of pyproject.toml."""
    root = DOCS.parent
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    left_out = {path for rule in wheel["exclude"] for path in root.glob(rule)}
    included = [root / name for name in wheel["only-include"] if name.startswith("sample_data")]
    paths = [path for one in included for path in (one, *one.rglob("*")) if path.is_file()]
    return [path for path in paths if left_out.isdisjoint([path, *path.parents])]


@contextmanager
def workplace() -> Iterator[Path]:
    """A new folder with the samples that a wheel holds, as the current folder."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        for sample in shipped_samples():
            target = Path(folder) / sample.relative_to(DOCS.parent)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(sample, target)
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
