"""scanfab formats: what can be read and written."""

from __future__ import annotations

from typing import Any

import click


@click.command()
def formats() -> None:
    """List every reader and writer, its extensions, and the package it comes from."""
    from scanfab.cli.console import reported_warnings
    from scanfab.io.reader import installed_readers
    from scanfab.io.writer import installed_writers
    from scanfab.table.formats import known_formats
    from scanfab.viz.figures.style import PLOT_FORMATS

    with reported_warnings():
        lines = [
            (kind, name, " ".join(one.plugin.extensions), one.package, _described(one.plugin))
            for kind, offers in (("reader", installed_readers()), ("writer", installed_writers()))
            for name, one in offers.items()
        ]
        written = known_formats()
    lines += [
        ("table", suffix.lstrip("."), suffix, type(one).__module__.split(".")[0], one.description)
        for suffix, one in written.items()
    ]
    lines += [
        ("figure", suffix.lstrip("."), suffix, "scanfab", description)
        for suffix, description in PLOT_FORMATS.items()
    ]
    lines += [
        ("folder", "paraview", ".vtp .pvd", "scanfab", "what compute --vtk writes"),
        ("page", "html", ".html", "scanfab", "what report writes"),
    ]
    titles = ("kind", "name", "extensions", "package", "description")
    widths = [max(len(line[k]) for line in [titles, *lines]) for k in range(4)]
    for line in [titles, *lines]:
        padded = [word.ljust(width) for word, width in zip(line, widths, strict=False)]
        click.echo("  ".join([*padded, line[4]]))


def _described(plugin: Any) -> str:
    """What it is, and how to get the package that it needs."""
    from scanfab.io.reader import lacking

    advice = lacking(plugin)
    return f"{plugin.description}{'' if advice is None else f' (not installed: {advice})'}"
