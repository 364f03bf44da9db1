"""The sweep of one direction against its floor and Embree, and what a scan's options cost."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.spatial import ConvexHull

from scanfab.base.convex import Convex
from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import EDGES
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import ScanSums, scan_lines
from scanfab.scan.solids import Solids
from tests.benchmarks.packings import PAPER, copied, dense, solids_near, tenth
from tests.benchmarks.timing import interleaved, table

HERE = Path(__file__).parent
# of a scan in threads: as many as an auto scan starts with
DIRECTIONS = 16
EMBREE = "Embree 3, 16 rays a packet, all hits"
FLOOR = "floor: only the square roots (Numba)"


CLOSE, CUTOFF = 0.05, 0.5
ONE_AXIS = DirectionRule("one", np.array([[0.36, 0.48, 0.8]]), np.ones(1), None, turned=False)


def sweep(solids: Solids, variants: str = "c", directions: int = 1, **options: Any) -> ScanSums:
    """A scan with one replicate for each direction."""
    options = {"spacing": CLOSE, "cutoff": CUTOFF, **options}
    return scan_lines(solids, ONE_AXIS, variants=variants, replicates=range(directions), **options)


def rv_solids() -> Solids:
    """The grains of the paper's sample that reach into the RV of 0.7."""
    position, radius = dense(PAPER)
    extent = (position + radius[:, None]).max(axis=0) - (position - radius[:, None]).min(axis=0)
    return solids_near(sphere(0.7 * 0.5 * float(extent.min())))


@njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
def chord_rows(v, radius, first, spacing, lines):
    """Rows that a sphere meets."""
    low = int(np.ceil((v - radius - first) / spacing))
    high = int(np.floor((v + radius - first) / spacing)) + 1
    return max(low, 0), min(high, lines)


@njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
def chord_span(u, v, radius, y, first, spacing, window):
    """Lines of a row that a sphere meets inside the window, and the square of its half chord."""
    reach2 = radius * radius - (y - v) * (y - v)
    reach = np.sqrt(max(reach2, 0.0))
    wide = np.sqrt(max(window * window - y * y, 0.0))
    left, right = max(u - reach, -wide), min(u + reach, wide)
    if left >= right:
        return 0, 0, reach2
    low = int(np.ceil((left - first) / spacing))
    return low, int(np.floor((right - first) / spacing)) + 1, reach2


@njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
def roots(u, reach2, first, spacing, low, high):
    """The floor of a row."""
    total = 0.0
    for i in range(np.uint64(low), np.uint64(high)):
        du = first - u + spacing * np.int64(i)
        total += np.sqrt(max(reach2 - du * du, 0.0))
    return total


@njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
def floor(u, v, radius, first, spacing, lines, window):
    """The square roots of all chords on the lines that meet the window, and how many there are."""
    total, count = 0.0, 0
    for k in range(u.size):
        low, high = chord_rows(v[k], radius[k], first, spacing, lines)
        for row in range(low, high):
            y = first + row * spacing
            start, stop, reach2 = chord_span(u[k], v[k], radius[k], y, first, spacing, window)
            if start < stop:
                total += roots(u[k], reach2, first, spacing, start, stop)
                count += stop - start
    return total, count


class Projected:
    """The spheres along the axis, and the grid over the window."""

    def __init__(self, solids: Solids) -> None:
        u, v, depth = line_triads(ONE_AXIS.axes)[0] @ solids.position.T
        order = np.argsort(depth)
        self.u, self.v, self.depth = u[order], v[order], depth[order]
        self.radius = solids.radius[order]
        self.lines = int(2 * solids.reach / CLOSE)
        self.grid = (-0.5 * self.lines * CLOSE, CLOSE, self.lines, solids.reach)

    def floor(self):
        return floor(self.u, self.v, self.radius, *self.grid)

    def floor_in_threads(self, threads: int):
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(lambda _: self.floor(), range(DIRECTIONS)))


def embree(projected: Projected, folder: Path):
    """A way that returns Embree's own seconds, without the time to load; None if there is none."""
    program = folder / "embree"
    flags = ["-O3", "-march=native", str(HERE / "embree.cpp"), "-o", str(program), "-lembree3"]
    if shutil.which("g++") is None:
        return None
    if subprocess.run(["g++", *flags], capture_output=True, check=False).returncode:
        return None
    spheres = np.column_stack([projected.u, projected.v, projected.depth, projected.radius])
    spheres.astype(np.float32).tofile(folder / "spheres")
    command = [program, folder / "spheres", *(str(one) for one in (*projected.grid, CUTOFF))]
    return lambda: float(subprocess.check_output(command, text=True).split()[0])


def chords(repeats: int) -> str:
    """One direction in one thread: the scan, its floor, and Embree."""
    solids = rv_solids()
    projected = Projected(solids)
    count = projected.floor()[1]
    ways = {
        "scanfab, variant c": partial(sweep, solids),
        FLOOR: projected.floor,
    }
    note = f"\n\n{len(solids.radius):,} grains reach into the RV; {count:,} chords."
    with tempfile.TemporaryDirectory() as name:
        seconds = interleaved(ways, repeats, clock=time.process_time)
        rays = embree(projected, Path(name))
        if rays is None:
            note += " Without g++ or Embree 3 (Debian: libembree-dev) that was not measured."
        else:
            seconds |= interleaved({EMBREE: rays}, repeats, clock=None)
    rows = [
        (name, f"{1e9 * value / count:.2f}", f"{value / seconds[FLOOR]:.2f}")
        for name, value in sorted(seconds.items(), key=lambda item: item[1])
    ]
    return table(["way", "ns a chord", "of the floor"], rows) + note


def threads(repeats: int) -> str:
    """What a second thread gives, for many directions."""
    solids = rv_solids()
    projected = Projected(solids)
    ways = {f"floor {n}": partial(projected.floor_in_threads, n) for n in (1, 2)}
    for n in (1, 2):
        ways[f"scanfab {n}"] = partial(sweep, solids, directions=DIRECTIONS, workers=n)
    seconds = interleaved(ways, repeats)
    gain = {name: seconds[f"{name} 1"] / seconds[f"{name} 2"] for name in ("scanfab", "floor")}
    gain["scanfab / floor"] = gain["scanfab"] / gain["floor"]
    return table(["two threads", "of one"], [(n, f"{one:.2f}") for n, one in gain.items()])


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


SECTIONS = {"chords": chords, "threads": threads, "scans": scans}
