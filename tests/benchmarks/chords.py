"""The sweep of one direction against its floor and Embree, and what a scan's options cost."""

import shutil
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from scanfab.base.shapes import sphere
from scanfab.scan import tallies
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import EDGES
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


def scans(repeats: int) -> str:
    """What a chord costs by each edge rule."""
    window = sphere(10.0)
    solids = {rule: solids_near(window, rule) for rule in EDGES}
    columns = []
    for spacing, directions in ((CLOSE, 2), (1.5, 800)):
        words: Any = {"spacing": spacing, "directions": directions}
        ways = {rule: partial(sweep, one, **words) for rule, one in solids.items()}
        # `start` has chords beyond the window as well, which count as its cost
        chords = int(ways[EDGES[0]]().chords.sum())
        seconds = interleaved(ways, repeats, clock=time.process_time)
        columns.append([f"{1e9 * value / chords:.2f}" for value in seconds.values()])
    titles = ["edge", f"ns a chord, lines {CLOSE} mean radii apart", "1.5 mean radii apart"]
    return table(titles, list(zip(EDGES, *columns, strict=True)))


def swept(by_lists: bool, *words: Any, **options: Any) -> ScanSums:
    """A scan by one of the two engines, whichever scanfab would choose."""
    usual, tallies.FEW_LINES = tallies.FEW_LINES, np.inf if by_lists else 0.0
    try:
        return sweep(*words, **options)
    finally:
        tallies.FEW_LINES = usual


def engines(repeats: int) -> str:
    """What lists of chords take of the time of the dense sweep, by the processor's clock."""
    position, radius, _ = copied(2)
    solids = Solids(position, radius, tenth(len(radius)))
    rows = []
    for spacing, directions in ((CLOSE, 1), (0.2, 16), (0.5, 50), (1, 100), (2, 200), (4, 400)):
        words: Any = {"spacing": spacing, "directions": directions}
        ways = {
            name: partial(swept, name == "lists", solids, "ab", **words)
            for name in ("dense", "lists")
        }
        seconds = interleaved(ways, repeats, clock=time.process_time)
        rows.append((f"{spacing:g}", f"{seconds['lists'] / seconds['dense']:.2f}"))
    return table(["lines apart, mean radii", "lists over dense sweep"], rows)


SECTIONS = {"chords": chords, "scans": scans, "engines": engines}
