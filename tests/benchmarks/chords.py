"""The sweep of one direction against its floor and Embree, and what a scan's options cost."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.spatial import ConvexHull

from scanfab.base.convex import Convex
from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
from scanfab.scan import tallies
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import EDGES
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import Solids
from tests.benchmarks.packings import PAPER, copied, dense, solids_near, tenth
from tests.benchmarks.timing import interleaved, table

HERE = Path(__file__).parent
EMBREE = "Embree 3, 16 rays a packet, all hits"
FLOOR = "floor: only the square roots (Numba)"


CLOSE, CUTOFF = 0.05, 0.5
ONE_AXIS = DirectionRule("one", np.array([[0.36, 0.48, 0.8]]), np.ones(1), None, turned=False)


def sweep(solids: Solids, variants: str = "c", directions: int = 1, **options: Any) -> ScanSums:
    """A scan with one replicate for each direction."""
    options = {"spacing": CLOSE, "cutoff": CUTOFF, **options}
    return scan_lines(solids, ONE_AXIS, variants=variants, replicates=range(directions), **options)


@njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
def floor(u, v, radius, first, spacing, lines, window):
    """Sum of the half chords on all lines that meet the window, and the number of these chords."""
    total, count = 0.0, 0
    for k in range(u.size):
        low = max(int(np.ceil((v[k] - radius[k] - first) / spacing)), 0)
        high = min(int(np.floor((v[k] + radius[k] - first) / spacing)) + 1, lines)
        for row in range(low, high):
            y = first + row * spacing
            reach2 = radius[k] ** 2 - (y - v[k]) ** 2
            reach, wide = np.sqrt(max(reach2, 0.0)), np.sqrt(max(window * window - y * y, 0.0))
            left, right = max(u[k] - reach, -wide), min(u[k] + reach, wide)
            if left < right:
                start = int(np.ceil((left - first) / spacing))
                stop = int(np.floor((right - first) / spacing)) + 1
                for i in range(np.uint64(start), np.uint64(stop)):
                    du = first - u[k] + spacing * np.int64(i)
                    total += np.sqrt(max(reach2 - du * du, 0.0))
                count += stop - start
    return total, count


def embree(spheres: np.ndarray, grid: tuple[float, ...], folder: Path) -> Any:
    """A function that returns the seconds that Embree measures; None without Embree."""
    program = folder / "embree"
    flags = ["-O3", "-march=native", str(HERE / "embree.cpp"), "-o", str(program), "-lembree3"]
    if (
        shutil.which("g++") is None
        or subprocess.run(["g++", *flags], capture_output=True).returncode
    ):
        return None
    spheres.astype(np.float32).tofile(folder / "spheres")
    command = [program, folder / "spheres", *map(str, (*grid, CUTOFF))]
    return lambda: float(subprocess.check_output(command, text=True).split()[0])


def chords(repeats: int) -> str:
    """Time of one direction in one thread: the scan, its floor, and Embree."""
    position, radius = dense(PAPER)
    extent = (position + radius[:, None]).max(axis=0) - (position - radius[:, None]).min(axis=0)
    solids = solids_near(sphere(0.7 * 0.5 * float(extent.min())))
    spheres = np.column_stack([solids.position @ line_triads(ONE_AXIS.axes)[0].T, solids.radius])
    u, v, _, radii = spheres[np.argsort(spheres[:, 2])].T.copy()
    lines = int(2 * solids.reach / CLOSE)
    grid = (-0.5 * lines * CLOSE, CLOSE, lines, solids.reach)
    ways = {"scanfab, variant c": partial(sweep, solids), FLOOR: partial(floor, u, v, radii, *grid)}
    count = ways[FLOOR]()[1]
    note = f"\n\n{len(radii):,} grains reach into the RV; {count:,} chords."
    seconds = interleaved(ways, repeats, clock=time.process_time)
    with tempfile.TemporaryDirectory() as name:
        rays = embree(spheres, grid, Path(name))
        if rays is None:
            note += " Embree was not measured: that needs g++ and Embree 3 (Debian: libembree-dev)."
        else:
            seconds |= interleaved({EMBREE: rays}, repeats, clock=None)
    rows = [
        (name, f"{1e9 * value / count:.2f}", f"{value / seconds[FLOOR]:.2f}")
        for name, value in sorted(seconds.items(), key=lambda item: item[1])
    ]
    return table(["way", "ns a chord", "of the floor"], rows) + note


def shapes() -> dict[str, Convex]:
    """Windows of one volume, that of a sphere of ten mean radii."""
    corners = np.random.default_rng(0).normal(size=(20, 3))
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    found = {
        "cube": box([1.0, 1.0, 1.0]),
        "cylinder, oblique": cylinder(1.0, 4.0, [1, 2, 3]),
        "ellipsoid": ellipsoid([1.0, 1.0, 2.0]),
        "polyhedron of 36 faces": polyhedron(corners, ConvexHull(corners).simplices)[0],
    }
    volume = sphere(10.0).volume
    return {
        name: shape.deformed(np.cbrt(volume / shape.volume) * np.eye(3))
        for name, shape in found.items()
    }


def scans(repeats: int) -> str:
    """What a chord costs by variants, edge rule and window, and in a cell that repeats."""
    position, radius, edge = copied(2)
    removed = tenth(len(radius))
    medium = CellGrains(position, radius, removed, np.diag([edge] * 3), np.ones(3, bool))
    ball, rules = sphere(10.0), [f"RV of 10 mean radii, `{rule}`" for rule in EDGES]
    solids = {
        "all grains, a": (Solids(position, radius, removed), "a"),
        "all grains, ab": (Solids(position, radius, removed), "ab"),
        "the same in a cell that repeats, ab": (
            Solids(position, radius, removed, None, medium), "ab",
        ),
        **{name: (solids_near(ball, rule), "c") for name, rule in zip(rules, EDGES, strict=True)},
        **{f"{name} of its volume": (solids_near(one), "c") for name, one in shapes().items()},
    }  # fmt: skip
    columns = []
    for spacing, directions in ((CLOSE, 2), (1.5, 800)):
        words: Any = {"spacing": spacing, "directions": directions}
        ways = {name: partial(sweep, *one, **words) for name, one in solids.items()}
        chords = {name: int(way().chords.sum()) for name, way in ways.items()}
        # `start` has chords beyond the window as well, which count as its cost
        chords |= dict.fromkeys(rules, chords[rules[0]])
        seconds = interleaved(ways, repeats, clock=time.process_time)
        columns.append([f"{1e9 * seconds[name] / chords[name]:.2f}" for name in ways])
    titles = ["scan", f"ns a chord, lines {CLOSE} mean radii apart", "1.5 mean radii apart"]
    return table(titles, list(zip(solids, *columns, strict=True)))


def swept(by_lists: bool, *words: Any, **options: Any) -> ScanSums:
    """A scan by one of the two engines, whichever scanfab would choose."""
    usual, tallies.FEW_LINES = tallies.FEW_LINES, np.inf if by_lists else 0.0
    try:
        return sweep(*words, **options)
    finally:
        tallies.FEW_LINES = usual


def engines(repeats: int) -> str:
    """What each kernel wins over the other that could do its work, in processor time."""
    position, radius, _ = copied(2)
    solids = Solids(position, radius, tenth(len(radius)))
    rows = []
    for spacing, directions in (
        (CLOSE, 1),
        (0.2, 16),
        (0.5, 50),
        (1.0, 100),
        (2.0, 200),
        (4.0, 400),
    ):
        words: Any = {"spacing": spacing, "directions": directions}
        ways = {
            "dense": partial(swept, False, solids, "ab", **words),
            "lists": partial(swept, True, solids, "ab", **words),
            "window": partial(sweep, solids, "ab", quick=True, **words),
            "whole": partial(sweep, solids, "ab", **words),
        }
        seconds = interleaved(ways, repeats, clock=time.process_time)
        ratios = seconds["lists"] / seconds["dense"], seconds["window"] / seconds["whole"]
        rows.append((f"{spacing:g}", *(f"{ratio:.2f}" for ratio in ratios)))
    titles = ["lines apart, mean radii", "lists over dense sweep", "window's kernel over whole's"]
    return table(titles, rows)


SECTIONS = {"chords": chords, "scans": scans, "engines": engines}
