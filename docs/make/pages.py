"""What scripts put into the pages: text in the places that pages name, figures and tables."""

from __future__ import annotations

import re
from collections.abc import Callable

import figures
import reference
import validation

PARTS: dict[str, Callable[[], str]] = {
    "commands": reference.commands,
    "options": reference.options,
    "taken": reference.taken,
    "columns": reference.columns,
    **validation.PARTS,
}


def filled(text: str) -> str:
    """A page with its parts: `{{options}}` stands for what the function of that name returns."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: PARTS[match[1]]().rstrip("\n"), text)


def make_files() -> None:
    """Draw all figures into docs/figures, and write the long tables into docs/tables."""
    figures.draw()
    validation.write_tables()
