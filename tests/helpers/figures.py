"""Figures drawn for tests, and what is read off them."""

from __future__ import annotations

from scanfab.viz.figures.figure import make_figures, save_figures

BYTES = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


def save_rows(path, rows, name=None, **offered):
    """A figure of a table, or the page of all, as a file."""
    save_figures(path, make_figures(rows, "table", name, **offered))


def fitted(axes):
    return [line for line in axes.lines if line.get_gid() == "fit"]


def legend_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def titles_of(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def with_samples(rows):
    return [
        {**row, "alpha_vs_axial_sample_se": 2e-3, "alpha_c_axial_sample_se": 1e-2} for row in rows
    ]


def row_of(computed, frame):
    return next(r for r in computed.rows if (r["frame"], r["variant"]) == (frame, "c"))
