"""scanfab formats: the formats that can be read and written."""

from __future__ import annotations

import click

from scanfab.cli.console import Command, print_rows


@click.command(cls=Command)
def formats() -> None:
    """List every reader and writer, its extensions, and the package it comes from."""
    from scanfab.io.reader import installed_readers, lacking
    from scanfab.io.writer import installed_writers
    from scanfab.table.formats import known_formats

    lines = []
    for kind, offers in (("reader", installed_readers()), ("writer", installed_writers())):
        for name, offer in offers.items():
            plugin, advice = offer.plugin, lacking(offer.plugin)
            about = plugin.description + (f" (not installed: {advice})" if advice else "")
            lines.append((kind, name, " ".join(plugin.extensions), offer.package, about))
    for suffix, form in known_formats().items():
        package = type(form).__module__.split(".")[0]
        lines.append(("table", suffix.lstrip("."), suffix, package, form.description))
    titles = ("kind", "name", "extensions", "package", "description")
    rows = [dict(zip(titles, line, strict=True)) for line in lines]
    print_rows(rows, titles, len(titles))
