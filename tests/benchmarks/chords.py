"""The sweep of one direction against its floor, a list per line, and Embree."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import njit

from scanfab.base.shapes import sphere
from scanfab.scan.blocks import Blocks
from scanfab.scan.directions import DirectionRule
from scanfab.scan.edges import EDGES, START
from scanfab.scan.gaps import scan_gaps
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import scan_lines
from scanfab.scan.solids import Solids, margin_of
from tests.benchmarks.packings import PAPER, dense
from tests.benchmarks.timing import interleaved, table

HERE = Path(__file__).parent
SPACING = 0.05
CUTOFF = 0.5
AXIS = np.array([[0.36, 0.48, 0.8]])
RULE = DirectionRule("one", AXIS, np.ones(1), None, turned=False)
# of a scan in threads: as many as an auto scan starts with
DIRECTIONS = 16
EMBREE_LIMIT = 110.0
# of RVs for which the rules at their surface are compared, in mean radii
EDGE_RADII = (5.0, 10.0, 20.0)


def rv_solids() -> Solids:
    """The grains of the paper's sample that reach into the RV of 0.7."""
    position, radius = dense(PAPER)
    extent = (position + radius[:, None]).max(axis=0) - (position - radius[:, None]).min(axis=0)
    window = 0.7 * 0.5 * extent.min()
    near = np.linalg.norm(position, axis=1) < window + radius
    removed = np.random.default_rng(1).random(near.sum()) < 0.1
    return Solids(position[near], radius[near], removed, sphere(float(window)))


def sweep(solids, variants="c", directions=1, workers=1, spacing=SPACING):
    """One replicate a direction."""
    return scan_lines(
        solids,
        RULE,
        spacing=spacing,
        cutoff=CUTOFF,
        variants=variants,
        replicates=range(directions),
        workers=workers,
    )


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


@njit(nogil=True, cache=True, error_model="numpy")
def list_chords(u, v, depth, radius, first, spacing, lines, window, filled, starts, ends):
    """Put each line's chords behind one another; with no room for them, only count."""
    for k in range(u.size):
        low, high = chord_rows(v[k], radius[k], first, spacing, lines)
        for row in range(low, high):
            y = first + row * spacing
            left, right, reach2 = chord_span(u[k], v[k], radius[k], y, first, spacing, window)
            for line in range(row * lines + left, row * lines + right):
                if starts.size > 0:
                    du = first - u[k] + spacing * (line - row * lines)
                    half = np.sqrt(max(reach2 - du * du, 0.0))
                    starts[filled[line]] = depth[k] - half
                    ends[filled[line]] = depth[k] + half
                filled[line] += 1


@njit(nogil=True, cache=True, error_model="numpy")
def merge(starts, ends, half, cutoff):
    """Length and number of the kept gaps of a line."""
    length, kept, solid = 0.0, 0, -half
    for k in np.argsort(starts):
        gap = min(starts[k], half) - solid
        if gap >= cutoff:
            length, kept = length + gap, kept + 1
        solid = max(solid, ends[k])
    if half - solid >= cutoff:
        length, kept = length + half - solid, kept + 1
    return length, kept


@njit(nogil=True, cache=True, error_model="numpy")
def list_per_line(u, v, depth, radius, first, spacing, lines, window, cutoff):
    """Lists of the chords of every line, sorted and merged; length and number of kept gaps."""
    filled, none = np.zeros(lines * lines, np.int64), np.empty(0)
    list_chords(u, v, depth, radius, first, spacing, lines, window, filled, none, none)
    stops = np.cumsum(filled)
    filled = stops - filled
    starts, ends = np.empty(stops[-1]), np.empty(stops[-1])
    list_chords(u, v, depth, radius, first, spacing, lines, window, filled, starts, ends)
    length, kept, begin = 0.0, 0, 0
    for line in range(lines * lines):
        x, y = first + line % lines * spacing, first + line // lines * spacing
        half2 = window * window - x * x - y * y
        if half2 > 0.0:
            part = slice(begin, stops[line])
            found = merge(starts[part], ends[part], np.sqrt(half2), cutoff)
            length, kept = length + found[0], kept + found[1]
        begin = stops[line]
    return length, kept


class Projected:
    """The spheres along the axis, and the grid over the window."""

    def __init__(self, solids: Solids) -> None:
        u, v, depth = line_triads(AXIS)[0] @ solids.position.T
        order = np.argsort(depth)
        self.u, self.v, self.depth = u[order], v[order], depth[order]
        self.radius = solids.radius[order]
        self.lines = int(2 * solids.reach / SPACING)
        self.grid = (-0.5 * self.lines * SPACING, SPACING, self.lines, solids.reach)

    def floor(self, part: slice = slice(None)):
        return floor(self.u[part], self.v[part], self.radius[part], *self.grid)

    def floor_in_threads(self, threads: int):
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(lambda _: self.floor(), range(DIRECTIONS)))

    def list_per_line(self):
        return list_per_line(self.u, self.v, self.depth, self.radius, *self.grid, CUTOFF)


def floor_in_c(projected: Projected, folder: Path):
    """The same loop compiled by gcc; None if there is none."""
    if shutil.which("gcc") is None:
        return None
    library = folder / "floor.so"
    # the order of a sum may be any, as for Numba
    flags = ["-O3", "-march=native", "-fno-math-errno", "-fassociative-math", "-fno-signed-zeros"]
    flags += ["-fno-trapping-math", "-ffinite-math-only", "-shared", "-fPIC"]
    command = ["gcc", *flags, str(HERE / "floor.c"), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    function = ctypes.CDLL(str(library)).floor_c
    double = ctypes.c_double
    function.restype = double
    arrays = [a.ctypes.data_as(ctypes.c_void_p) for a in (projected.u, projected.v)]
    arrays.append(projected.radius.ctypes.data_as(ctypes.c_void_p))
    first, spacing, lines, window = projected.grid
    rest = (double(first), double(spacing), ctypes.c_long(lines), double(window))
    return lambda: function(ctypes.c_long(projected.u.size), *arrays, *rest)


def embree(projected: Projected, folder: Path):
    """Nanoseconds a chord of Embree, or why it was not measured."""
    program = folder / "embree"
    source = str(HERE / "embree.cpp")
    flags = ["-O3", "-march=native", source, "-o", str(program), "-lembree3"]
    if shutil.which("g++") is None:
        return "no g++"
    if subprocess.run(["g++", *flags], capture_output=True, check=False).returncode:
        return "Embree 3 is not installed (Debian: libembree-dev)"
    spheres = np.column_stack([projected.u, projected.v, projected.depth, projected.radius])
    spheres.astype(np.float32).tofile(folder / "spheres")
    words = [str(word) for word in (*projected.grid, CUTOFF)]
    done = subprocess.run(
        [str(program), str(folder / "spheres"), *words], capture_output=True, text=True, check=True
    )
    seconds, hits, kept = (float(word) for word in done.stdout.split())
    return seconds, int(hits), int(kept)


def run(repeats: int) -> dict[str, str]:
    """The sections ``chords``, ``variants``, ``edges``, ``maps`` and ``threads``."""
    solids = rv_solids()
    projected = Projected(solids)
    count = projected.floor()[1]
    with tempfile.TemporaryDirectory() as name:
        return {
            "chords": _chords(solids, projected, count, Path(name), repeats),
            "variants": _variants(solids, repeats),
            "edges": _edges(repeats),
            "maps": _maps(repeats),
            "threads": _threads(solids, projected, repeats),
        }


def _chords(solids, projected, count, folder, repeats):
    ways = {
        "scanfab, variant c": lambda: sweep(solids),
        "floor: only the square roots (Numba)": projected.floor,
        "list per line, sorted and merged (Numba)": projected.list_per_line,
    }
    in_c = floor_in_c(projected, folder)
    if in_c is not None:
        ways["the same floor in C, gcc -O3 -march=native"] = in_c
    rays: list[tuple[float, int, int]] = []
    said = embree(projected, folder)
    if not isinstance(said, str):
        ways["Embree 3, 16 rays a packet, all hits"] = lambda: rays.append(
            embree(projected, folder)
        )
    seconds = interleaved(ways, repeats, clock=time.process_time)
    if rays:  # without the time to load and build
        seconds["Embree 3, 16 rays a packet, all hits"] = float(np.median([r[0] for r in rays]))
    base = seconds["floor: only the square roots (Numba)"]
    rows = [
        (name, f"{1e9 * value / count:.2f}", f"{value / base:.2f}")
        for name, value in sorted(seconds.items(), key=lambda item: item[1])
    ]
    if isinstance(said, str):
        rows.append(("Embree 3", f"skipped: {said}", "-"))
    elif 1e9 * seconds["Embree 3, 16 rays a packet, all hits"] / count > EMBREE_LIMIT:
        rows.append((f"(Embree is badly used above {EMBREE_LIMIT:.0f} ns)", "", ""))
    note = f"\n\n{len(solids.radius):,} grains reach into the RV; {count:,} chords."
    return table(["way", "ns a chord", "of the floor"], rows) + note


def _variants(solids, repeats):
    position, radius = dense(PAPER)
    removed = np.random.default_rng(1).random(PAPER) < 0.1
    whole = Solids(position, radius, removed, solids.window)
    seconds = interleaved(
        {variants: lambda v=variants: sweep(whole, v) for variants in ("a", "abcd")},
        repeats,
        clock=time.process_time,
    )
    rows = [(name, f"{value / seconds['a']:.2f}") for name, value in seconds.items()]
    return table(["variants in one pass", "time of a alone"], rows)


def _edges(repeats):
    """The rules at the window's surface, of which one needs the grains beyond it, too."""
    position, radius = dense(PAPER)
    removed = np.zeros(PAPER, bool)
    around = CellGrains(position, radius, removed, np.eye(3), np.zeros(3, bool))
    rows = []
    for size in EDGE_RADII:
        window, ways = sphere(size * float(radius.mean())), {}
        for edge in EDGES:
            every = around if edge == START else None
            near = window.may_meet(position, radius + (margin_of(every) if every else 0.0))
            chosen = position[near], radius[near], removed[near], window
            ways[edge] = Solids(*chosen, edge=edge, around=every)
        for spacing, directions in ((SPACING, int(400 / size**2)), (1.5, int(20_000 / size**1.5))):
            words = {"spacing": spacing, "directions": directions}
            seconds = interleaved(
                {edge: lambda s=of, w=words: sweep(s, **w) for edge, of in ways.items()},
                repeats,
                clock=time.process_time,
            )
            ratios = [f"{seconds[edge] / seconds['clip']:.2f}" for edge in EDGES[1:]]
            rows.append((f"{size:g}", f"{spacing:g}", *ratios))
    titles = [
        "radius of the RV",
        "spacing of lines",
        *(f"`{edge}` over `clip`" for edge in EDGES[1:]),
    ]
    return table(titles, rows)


def _maps(repeats):
    """Blocks of all grains beside the same lines without any."""
    position, radius = dense(PAPER)
    solids = Solids(position, radius, np.zeros(PAPER, bool))
    reach = float(np.abs(position).max() + radius.max())
    box = Blocks(np.full(3, -reach), 2 * reach * np.eye(3), (10, 10, 10))
    kinds = {
        "octants": Blocks.about(np.zeros(3), 2 * reach),
        "a grid of 1,000 blocks": box,
        "10 shells": replace(box, parts=(1, 1, 1), radius=reach, shells=10),
    }
    rows = []
    for spacing, directions in ((0.3, 16), (1.0, 100), (1.5, 200)):
        words = {"spacing": spacing, "variants": "a", "replicates": range(directions)}
        ways = {"none": lambda w=words: scan_lines(solids, RULE, cutoff=CUTOFF, **w)}
        for name, one in kinds.items():
            ways[name] = lambda b=one, w=words: scan_gaps(
                solids, RULE, cutoffs=[CUTOFF], blocks=(b, b), **w
            )
        seconds = interleaved(ways, repeats, clock=time.process_time)
        rows += [
            (f"{name}, lines {spacing:g} mean radii apart", f"{value / seconds['none']:.2f}")
            for name, value in seconds.items()
        ]
    return table(["blocks", "of none"], rows)


def _threads(solids, projected, repeats):
    ways = {
        "scanfab 1": lambda: sweep(solids, directions=DIRECTIONS),
        "scanfab 2": lambda: sweep(solids, directions=DIRECTIONS, workers=2),
        "floor 1": lambda: projected.floor_in_threads(1),
        "floor 2": lambda: projected.floor_in_threads(2),
    }
    seconds = interleaved(ways, repeats)
    gain = {name: seconds[f"{name} 1"] / seconds[f"{name} 2"] for name in ("scanfab", "floor")}
    rows = [(name, f"{value:.2f}") for name, value in gain.items()]
    rows.append(("scanfab / floor", f"{gain['scanfab'] / gain['floor']:.2f}"))
    return table(["two threads", "of one"], rows)
