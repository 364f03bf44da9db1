"""Windows of other shapes against the sphere: nanoseconds a chord, all of one volume."""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
from scanfab.scan.directions import direction_rule
from scanfab.scan.scan import scan_lines
from scanfab.scan.solids import Solids
from tests.benchmarks.packings import PAPER, dense
from tests.benchmarks.timing import interleaved, table

RADIUS, CUTOFF = 18.0, 0.5
RULE = direction_rule("icosahedral:9")


def shapes() -> dict[str, Convex]:
    """All of the volume of the sphere."""
    from scipy.spatial import ConvexHull

    corners = np.random.default_rng(0).normal(size=(20, 3))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    found = {
        "sphere": sphere(RADIUS),
        "cube": box([1.0, 1.0, 1.0]),
        "box 1:1:2": box([1.0, 1.0, 2.0]),
        "cylinder, as high as wide": cylinder(1.0, 2.0),
        "cylinder, oblique, twice as high": cylinder(1.0, 4.0, [1, 2, 3]),
        "ellipsoid 1:1:2": ellipsoid([1.0, 1.0, 2.0]),
        "polyhedron of 36 faces": polyhedron(corners, ConvexHull(corners).simplices)[0],
    }
    volume = found["sphere"].volume
    return {
        name: shape.deformed(np.cbrt(volume / shape.volume) * np.eye(3))
        if name != "sphere"
        else shape
        for name, shape in found.items()
    }


def run(repeats: int) -> dict[str, str]:
    """Processor time of one thread; by lists of chords (wide lines) and row by row (close ones)."""
    position, radius = dense(PAPER)
    rows = []
    medians: dict[float, dict[str, float]] = {}
    for spacing in (0.5, 0.1):
        ways, chords = {}, {}
        for name, shape in shapes().items():
            near = shape.may_meet(position, radius)
            none = np.zeros(int(near.sum()), bool)
            solids = Solids(position[near], radius[near], none, shape)
            ways[name] = partial(
                scan_lines, solids, RULE, spacing=spacing, cutoff=CUTOFF, variants="c",
                replicates=range(4 if spacing > 0.2 else 1),
            )  # fmt: skip
            chords[name] = int(ways[name]().chords.sum())
        seconds = interleaved(ways, repeats, clock=time.process_time)
        medians[spacing] = {name: 1e9 * seconds[name] / chords[name] for name in ways}
    for name in medians[0.5]:
        cells = [f"{one[name]:.2f} ({one[name] / one['sphere']:.2f})" for one in medians.values()]
        rows.append([name, *cells])
    titles = ["window", *(f"ns a chord at spacing {s:g}" for s in medians)]
    return {"windows": table(titles, rows)}


if __name__ == "__main__":
    print(run(10)["windows"])
