"""A periodic frame beside an open one: the same grains in a cell that repeats, and alone."""

from __future__ import annotations

import time

import numpy as np

from scanfab.base.shapes import sphere
from scanfab.scan.directions import direction_rule
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.scan import scan_lines
from scanfab.scan.solids import Solids
from tests.benchmarks.packings import relaxed_cell
from tests.benchmarks.timing import interleaved, table

COPIES = 2
RULE = direction_rule("icosahedral:9")
CASES = (("a", 1.0), ("ab", 1.0), ("abcd", 1.0), ("a", 0.1), ("ab", 0.1), ("abcd", 0.1))
SMALLEST = 0.5
RV = 0.35


def samples(variants: str) -> dict[str, Solids]:
    """The grains of a few cells, alone and as a medium; and those that reach into the RV."""
    position, radius, edge = relaxed_cell()
    steps = edge * np.stack(np.meshgrid(*3 * [np.arange(COPIES)]), axis=-1).reshape(-1, 1, 3)
    edge *= COPIES
    position = (position % (edge / COPIES) + steps).reshape(-1, 3) - 0.5 * edge
    radius = np.tile(radius, COPIES**3)
    removed = np.random.default_rng(1).random(radius.size) < 0.1
    medium = CellGrains(position, radius, removed, np.diag([edge] * 3), np.ones(3, bool))
    reach = RV * edge if "c" in variants else 0.0
    window = sphere(reach) if reach else None
    near = np.linalg.norm(position, axis=1) < reach + radius
    return {
        "open": Solids(position, radius, removed, window),
        "periodic": Solids(position[near], radius[near], removed[near], window, medium),
    }


def run(repeats: int) -> dict[str, str]:
    """The section ``periodic``."""
    rows = []
    for variants, spacing in CASES:

        def scan(solids, variants=variants, spacing=spacing):
            return scan_lines(
                solids,
                RULE,
                spacing=spacing * SMALLEST,
                cutoff=SMALLEST,
                variants=variants,
                replicates=range(1),
            )

        both = samples(variants)
        chords = {name: int(scan(one).chords.sum()) for name, one in both.items()}
        seconds = interleaved(
            {name: lambda one=one: scan(one) for name, one in both.items()},
            repeats,
            clock=time.process_time,
        )
        cost = {name: seconds[name] / chords[name] for name in both}
        rows.append(
            (
                variants,
                f"{spacing:g}",
                *(f"{1e9 * one:.2f}" for one in cost.values()),
                f"{cost['periodic'] / cost['open']:.2f}",
                f"{chords['periodic'] / chords['open']:.2f}",
            )
        )
    titles = ["variants", "spacing / r_min", "open, ns a chord", "periodic", "ratio", "chords"]
    return {"periodic": table(titles, rows)}
