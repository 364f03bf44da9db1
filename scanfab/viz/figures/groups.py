"""Which curves share a panel, and how each of them looks there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.table.curves import Curve, curves_of
from scanfab.viz.figures.style import COLOURS, LOOKS, plain

Look = dict[str, Any]

# of curves that are told apart by their sources, or by the sizes of their RVs
MANY_LOOKS: tuple[Look, ...] = tuple(
    {"color": COLOURS[colour], "marker": marker, "ls": line}
    for colour, marker, line in zip(
        ("blue", "vermilion", "green", "purple", "orange", "sky", "black"),
        "o^DsvPX",
        ("-", "--", "-.", ":", "-", "--", "-."),
        strict=True,
    )
)
# of as many more, likewise but open
MANY_LOOKS += tuple(
    {**look, "ls": line, "mfc": "white", "ms": 5.5}
    for look, line in zip(MANY_LOOKS, ("--", "-.", ":", "-", "--", "-.", ":"), strict=True)
)
OTHER: Look = {"color": "0.3", "marker": "v", "ls": "-"}
MEANINGS = {"a": "whole", "b": "whole, rattlers void", "c": "RV", "d": "RV, rattlers void"}


@dataclass(frozen=True, eq=False)
class Drawn:
    """A curve, its place among all of the table, its look and its name in the legend."""

    curve: Curve
    place: int
    look: Look
    name: str


@dataclass(frozen=True, eq=False)
class Group:
    """The curves of one panel; the title is empty if there is one group alone."""

    title: str
    drawn: list[Drawn]


def grouped(curves: Sequence[Curve]) -> list[Group]:
    """
    One source, or one variant of all sources, a panel: whichever makes fewer panels.

    Several curves of several sources in one panel could not be told apart.
    """
    sources = list(dict.fromkeys(curve.source for curve in curves))
    variants = sorted({curve.variant for curve in curves})
    # several RVs of a variant cannot all have the one look of the variant
    several_rvs = len({variant[0] for variant in variants}) < len(variants)

    def by_variant(curve: Curve) -> tuple[Look, str]:
        name = _spelt(curve.variant) if len(sources) == 1 else f"variant {curve.variant}"
        place = variants.index(curve.variant) % len(MANY_LOOKS)
        return MANY_LOOKS[place] if several_rvs else LOOKS.get(curve.variant, OTHER), name

    def by_source(curve: Curve) -> tuple[Look, str]:
        before = f"variant {variants[0]}, " if len(variants) == 1 else ""
        place = sources.index(curve.source) % len(MANY_LOOKS)
        return MANY_LOOKS[place], f"{before}{plain(curve.source)}"

    if len(sources) == 1 or 1 < len(variants) >= len(sources):
        look = by_variant
        panels = [
            (plain(one), [curve for curve in curves if curve.source == one]) for one in sources
        ]
    else:
        look = by_source
        panels = [
            (_spelt(name), [one for one in curves if one.variant == name]) for name in variants
        ]
    return [
        Group(
            title if len(panels) > 1 else "",
            [Drawn(one, curves.index(one), *look(one)) for one in chosen],
        )
        for title, chosen in panels
    ]


def groups_of(rows: Sequence[Mapping[str, Any]]) -> list[Group]:
    """The groups of a table; SettingsError if it has nothing to draw."""
    curves = curves_of(rows)
    if not any(np.isfinite(curve.values("alpha_vs_axial")).any() for curve in curves):
        raise SettingsError("there is nothing to draw: no row of the table has a void fabric")
    return grouped(curves)


def group_of(groups: Sequence[Group]) -> Group:
    """The only group; SettingsError if there are several, which one Axes cannot hold."""
    if len(groups) > 1:
        raise SettingsError(
            "several variants of several sources are too many for one Axes: choose some, "
            'for instance by table.select(variant="c")'
        )
    return groups[0]


def _spelt(variant: str) -> str:
    meaning = MEANINGS.get(variant)
    return f"variant {variant}" if meaning is None else f"variant {variant}: {meaning}"
