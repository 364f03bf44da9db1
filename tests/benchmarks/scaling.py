"""Time to a tolerance, contacts by geometry, and growth with the number of grains."""

import json
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np

import scanfab
from tests.benchmarks.packings import PAPER, dense, dense_packing
from tests.benchmarks.timing import interleaved, table

ROOT = Path(__file__).parents[2]
SIZES = (10_000, 100_000, 1_000_000)
LARGEST = 10_000_000


def tolerance(repeats: int) -> str:
    """Seconds of ``compute`` at the default tolerance."""
    packing = dense_packing(PAPER)
    ways = {f"{n}": partial(scanfab.compute, packing, workers=n) for n in (1, 2)}
    seconds = interleaved(ways, repeats)
    found = ways["2"]()
    error = max(found["alpha_vs_axial_se"])
    rows = [(n, f"{value:.3f}") for n, value in seconds.items()]
    note = f"\n\n{sum(found['segments']):,} segments; the largest standard error is {error:.1e}."
    return table(["threads", "seconds"], rows) + note


def neighbours(repeats: int) -> str:
    """Contacts by geometry."""
    packing = scanfab.Packing(*dense(200_000))
    ways = {"": partial(scanfab.find_contacts, packing)}
    speed = len(packing) / interleaved(ways, repeats, clock=time.process_time)[""] / 1e6
    return table(["grains", "million grains a second"], [(f"{len(packing):,}", f"{speed:.2f}")])


def growth(repeats: int, largest: bool = False) -> str:
    """Each size once, in a process of its own."""
    rows = []
    for count in (*SIZES, LARGEST) if largest else SIZES:
        with tempfile.TemporaryDirectory() as folder:
            packing = dense_packing(count)
            np.savez(
                Path(folder) / "grains.npz",
                position=packing.position,
                radius=packing.radius,
                pairs=packing.contacts.pairs,
            )
            del packing
            code = f"from tests.benchmarks.scaling import one_size; one_size({folder!r})"
            answer = subprocess.run(
                [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, check=True
            )
        found = json.loads(answer.stdout)
        numbers = [f"{found['seconds']:.2f}", f"{1e6 * found['seconds'] / count:.2f}"]
        numbers += [f"{found[name] / 2**20:.0f}" for name in ("table", "peak")]
        numbers.append(f"{(found['peak'] - found['table']) / count:.0f}")
        rows.append((f"{count:,}", *numbers))
    sizes = ["MiB with the table", "peak MiB", "more, B a grain"]
    return table(["grains", "seconds", "µs a grain", *sizes], rows)


def one_size(folder: str) -> None:
    """In a process of its own: seconds of the scan, and the peak of memory before and after."""
    warnings.simplefilter("ignore")
    scanfab.compute(dense_packing(1_000), tolerance=0.1)  # loads what has to be loaded
    with np.load(Path(folder) / "grains.npz") as data:
        packing = scanfab.Packing(data["position"], data["radius"], contacts=data["pairs"])
    before = _peak()
    start = time.perf_counter()
    scanfab.compute(packing, workers=2)
    seconds = time.perf_counter() - start
    print(json.dumps({"seconds": seconds, "table": before, "peak": _peak()}))


def _peak() -> int:
    """Bytes; macOS counts bytes, Linux kilobytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


SECTIONS = {"tolerance": tolerance, "neighbours": neighbours, "growth": growth}
