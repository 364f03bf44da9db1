"""The columns of a table that say what a frame holds: grains, rattlers, contacts."""

from __future__ import annotations

from scanfab.base.column import Column

__all__ = ["SAMPLE_COLUMNS"]

SAMPLE_COLUMNS = (
    Column("grains", int, "", "solid in this variant, centre in the window"),
    Column("rattlers", int, "", "grains with too few contacts, centre in the window"),
    Column("contacts", int, "", "contacts between grains that enter gc_*"),
    Column("contacts_from", str, "", "file or geometric"),
    Column(
        "coordination",
        float,
        "",
        "mean number of contacts of the grains counted in grains, boundary's included",
    ),
)
