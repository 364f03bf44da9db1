"""What a scan costs by its variants, edge rule and window, and in a periodic cell."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from scanfab.base.convex import Convex
from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
from scanfab.scan.directions import DirectionRule, direction_rule
from scanfab.scan.edges import EDGES
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import Solids
from tests.benchmarks.packings import PAPER, copied, dense, solids_near, tenth
from tests.benchmarks.timing import interleaved, over_first, table

CLOSE = 0.05
CUTOFF = 0.5
ONE_AXIS = DirectionRule("one", np.array([[0.36, 0.48, 0.8]]), np.ones(1), None, turned=False)
MANY_AXES = direction_rule("icosahedral:9")
# radii of the windows: mean radii
WINDOW, EDGE_WINDOWS = 18.0, (5.0, 10.0, 20.0)
# the RV of the periodic sample, of the cell's edge
RV = 0.35


def sweep(
    solids: Solids,
    variants: str = "c",
    directions: int = 1,
    spacing: float = CLOSE,
    rule: DirectionRule = ONE_AXIS,
    **options: Any,
) -> ScanSums:
    """A scan with one replicate for each direction."""
    options |= {"variants": variants, "replicates": range(directions)}
    return scan_lines(solids, rule, spacing=spacing, cutoff=CUTOFF, **options)


def per_chord(
    scans: Mapping[str, Callable[[], ScanSums]], repeats: int
) -> tuple[dict[str, float], dict[str, int]]:
    """Nanoseconds a chord of each scan in one thread, and how many chords it has."""
    chords = {name: int(scan().chords.sum()) for name, scan in scans.items()}
    seconds = interleaved(scans, repeats, clock=time.process_time)
    return {name: 1e9 * seconds[name] / chords[name] for name in scans}, chords


def variants(repeats: int) -> str:
    """All four variants in one pass beside one."""
    whole = Solids(*dense(PAPER), tenth(PAPER), sphere(WINDOW))
    ways = {name: partial(sweep, whole, name) for name in ("a", "abcd")}
    seconds = interleaved(ways, repeats, clock=time.process_time)
    return table(["variants in one pass", "time of a alone"], over_first(seconds))


def edges(repeats: int) -> str:
    """The rules at the window's surface, of which one needs the grains beyond it, too."""
    rows = []
    for size in EDGE_WINDOWS:
        solids = {edge: solids_near(sphere(size), edge) for edge in EDGES}
        for spacing, directions in ((CLOSE, int(400 / size**2)), (1.5, int(20_000 / size**1.5))):
            words: Any = {"spacing": spacing, "directions": directions}
            ways = {edge: partial(sweep, one, **words) for edge, one in solids.items()}
            seconds = interleaved(ways, repeats, clock=time.process_time)
            ratios = [ratio for _, ratio in over_first(seconds)[1:]]
            rows.append((f"{size:g}", f"{spacing:g}", *ratios))
    titles = [f"`{edge}` over `{EDGES[0]}`" for edge in EDGES[1:]]
    return table(["radius of the RV", "spacing of lines", *titles], rows)


def shapes() -> dict[str, Convex]:
    """Windows of the volume of the sphere."""
    corners = np.random.default_rng(0).normal(size=(20, 3))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    found = {
        "cube": box([1.0, 1.0, 1.0]),
        "box 1:1:2": box([1.0, 1.0, 2.0]),
        "cylinder, as high as wide": cylinder(1.0, 2.0),
        "cylinder, oblique, twice as high": cylinder(1.0, 4.0, [1, 2, 3]),
        "ellipsoid 1:1:2": ellipsoid([1.0, 1.0, 2.0]),
        "polyhedron of 36 faces": polyhedron(corners, ConvexHull(corners).simplices)[0],
    }
    ball = sphere(WINDOW)
    return {"sphere": ball} | {
        name: shape.deformed(np.cbrt(ball.volume / shape.volume) * np.eye(3))
        for name, shape in found.items()
    }


def windows(repeats: int) -> str:
    """Lines that are wide apart are scanned by lists of chords, close ones row by row."""
    solids = {name: solids_near(shape) for name, shape in shapes().items()}
    columns = {}
    for spacing, directions in ((0.5, 4), (0.1, 1)):
        words: Any = {"spacing": spacing, "directions": directions, "rule": MANY_AXES}
        ways = {name: partial(sweep, one, **words) for name, one in solids.items()}
        cost, _ = per_chord(ways, repeats)
        columns[spacing] = [f"{cost[name]:.2f} ({ratio})" for name, ratio in over_first(cost)]
    rows = list(zip(solids, *columns.values(), strict=True))
    return table(["window", *(f"ns a chord at spacing {s:g}" for s in columns)], rows)


def periodic(repeats: int) -> str:
    """The same grains in a cell that repeats, and alone."""
    position, radius, edge = copied(2)
    removed = tenth(len(radius))
    medium = CellGrains(position, radius, removed, np.diag([edge] * 3), np.ones(3, bool))
    rows = []
    for spacing in (1.0, 0.1):
        for which in ("a", "ab", "abcd"):
            reach = RV * edge if "c" in which else 0.0
            window = sphere(reach) if reach else None
            near = np.linalg.norm(position, axis=1) < reach + radius
            both = {
                "open": Solids(position, radius, removed, window),
                "periodic": Solids(position[near], radius[near], removed[near], window, medium),
            }
            words: Any = {"variants": which, "spacing": 0.5 * spacing, "rule": MANY_AXES}
            ways = {name: partial(sweep, one, **words) for name, one in both.items()}
            cost, chords = per_chord(ways, repeats)
            numbers = [*cost.values(), cost["periodic"] / cost["open"]]
            numbers.append(chords["periodic"] / chords["open"])
            rows.append((which, f"{spacing:g}", *(f"{one:.2f}" for one in numbers)))
    titles = ["variants", "spacing / r_min", "open, ns a chord", "periodic", "ratio", "chords"]
    return table(titles, rows)


SECTIONS = {
    "variants": variants,
    "edges": edges,
    "windows": windows,
    "periodic": periodic,
}
