"""Figures drawn for tests, and what is read off them."""

from scanfab.viz.figures.figure import make_figures, save_figures

BYTES = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


def save_rows(path, rows, name=None, **offered):
    """A figure of a table, or the page of all, as a file."""
    save_figures(path, make_figures(rows, "table", name, **offered))


def fitted(axes):
    return [line for line in axes.lines if line.get_gid() == "fit"]


def row_of(computed, frame):
    return next(r for r in computed.rows if (r["frame"], r["variant"]) == (frame, "c"))
