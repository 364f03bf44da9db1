"""Figures inside the page of a report."""

from __future__ import annotations

import base64
from typing import Literal

from scanfab.viz.figures.figure import Figure
from scanfab.viz.figures.page import drawn_page
from scanfab.viz.figures.style import figure_bytes
from scanfab.viz.report.page import Picture

# CSS pixels an inch
PIXELS = 96
# of pictures that are pixels, an inch
DPI = 130
KINDS = {"svg": "image/svg+xml", "png": "image/png"}


def picture_of(figure: Figure, kind: Literal["svg", "png"]) -> Picture:
    """A figure with its caption, as lines or as pixels."""
    with drawn_page([figure]) as page:
        data = figure_bytes(page, kind, DPI)
    url = f"data:{KINDS[kind]};base64,{base64.b64encode(data).decode('ascii')}"
    return Picture(url, figure.caption, round(PIXELS * figure.size[0]))
