"""Another version of the program in an environment of its own, and what two versions read."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
BASE = "f055af2"
"""The commit that had every feature, and every number checked, before the code was halved."""


def installed_base(commit: str, kept: Path) -> tuple[Path, Path]:
    """Checkout of a commit, and the Python of an environment with it; made where they are not."""
    checkout, python = kept / commit, kept / f"{commit}-env" / "bin" / "python"
    if not checkout.is_dir():
        subprocess.run(["git", "clone", "--quiet", ROOT, checkout], check=True)
        subprocess.run(["git", "-C", checkout, "checkout", "--quiet", commit], check=True)
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", python.parents[1]], check=True)
        words = ["-m", "pip", "install", "--quiet", f"{checkout}[test]"]
        subprocess.run([python, *words], check=True)
    return checkout, python


def ask(python: Path, script: str, task: str, *words: Any, tree: Path = ROOT) -> Any:
    """What a script's task answers to some words, in another environment and a tree of its own."""
    done = subprocess.run(
        [python, script, "--task", task], input=json.dumps(words), text=True, cwd=tree,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


def digest(value: Any) -> Any:
    """An array by its kind, shape and bytes; anything else as it is written."""
    if isinstance(value, np.ndarray):
        value = value.astype(str) if value.dtype == object else value
        content = np.ascontiguousarray(value).tobytes()
        return f"{value.dtype} {value.shape} {hashlib.sha256(content).hexdigest()[:16]}"
    return repr(value)


def packed(packing: Any) -> dict[str, Any]:
    """All that a packing says, as digests."""
    contacts, cell = packing.contacts, packing.cell
    found = {
        name: digest(getattr(packing, name))
        for name in ("position", "radius", "id", "wall_contacts", "step", "time", "dimension")
    }
    found |= {f"column {name}": digest(packing.columns[name]) for name in sorted(packing.columns)}
    if contacts is not None:
        names = ("pairs", "image", "normal", "point", "force", "force_n", "source")
        found |= {f"contacts {name}": digest(getattr(contacts, name)) for name in names}
    if cell is not None:
        names = ("vectors", "origin", "periodic")
        found |= {f"cell {name}": digest(getattr(cell, name)) for name in names}
    return found
