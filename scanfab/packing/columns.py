"""The columns of a table that say what a frame holds, with their values: grains, contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scanfab.base.column import Column

# tables are read without what computes them
if TYPE_CHECKING:
    from scanfab.packing.sample import Sample, Variant
    from scanfab.packing.window import Window


SAMPLE_COLUMNS = (
    Column("grains", int, "", "solid in this variant, centre in the window; a clump is one"),
    Column("rattlers", int, "", "grains with too few neighbours, centre in the window"),
    Column("contacts", int, "", "contacts between grains that enter gc_*; of clumps, each point"),
    Column("contacts_from", str, "", "file or geometric"),
    Column(
        "coordination",
        float,
        "",
        "mean number of contacts of the grains counted in grains, boundary's included; of clumps, "
        "neighbours",
    ),
)
RV_COLUMN = Column(
    "rv", float, "", "size of the RV as a fraction of the sample's, where several are asked for"
)


def sample_values(
    sample: Sample, variant: Variant, window: Window | None, contacts: int
) -> dict[str, Any]:
    """
    The values of these columns but ``contacts_from``, which is that of the whole frame.

    ``contacts`` is the number of those that enter the contact fabric.
    """
    counted = sample.counted(variant, window)
    return {
        "grains": sample.number(counted & ~sample.removed(variant)),
        "rattlers": sample.number(counted & sample.rattlers),
        "contacts": contacts,
        "coordination": sample.coordination(variant, window),
    }
