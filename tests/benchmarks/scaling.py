"""Time to a tolerance, contacts by geometry, and growth with the number of grains."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import scanfab
from tests.benchmarks.packings import PAPER, dense, dense_packing
from tests.benchmarks.timing import interleaved, table

ROOT = Path(__file__).parents[2]
SIZES = (10_000, 100_000, 1_000_000)
LARGEST = 10_000_000


def run(repeats: int, largest: bool) -> dict[str, str]:
    """The sections ``tolerance``, ``neighbours`` and ``growth``."""
    warnings.simplefilter("ignore")
    return {
        "tolerance": _tolerance(repeats),
        "neighbours": _neighbours(repeats),
        "growth": _growth((*SIZES, LARGEST) if largest else SIZES),
    }


def _tolerance(repeats: int, tolerance: float = 1e-4) -> str:
    packing = dense_packing(PAPER)

    def compute(workers: int):
        return scanfab.compute(packing, tolerance=tolerance, workers=workers)

    seconds = interleaved({f"{n}": lambda n=n: compute(n) for n in (1, 2)}, repeats)
    found = compute(2)
    error = max(found["alpha_vs_axial_se"])
    rows = [(n, f"{value:.3f}") for n, value in seconds.items()]
    note = f"\n\n{sum(found['segments']):,} segments; the largest standard error is {error:.1e}."
    return table(["threads", "seconds"], rows) + note


def _neighbours(repeats: int) -> str:
    packing = scanfab.Packing(*dense(200_000))
    seconds = interleaved(
        {"": lambda: scanfab.find_contacts(packing)}, repeats, clock=time.process_time
    )[""]
    return table(
        ["grains", "million grains a second"],
        [(f"{len(packing):,}", f"{len(packing) / seconds / 1e6:.2f}")],
    )


def _growth(sizes: tuple[int, ...]) -> str:
    rows = []
    for count in sizes:
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
        rows.append(
            (
                f"{count:,}",
                f"{found['seconds']:.2f}",
                f"{1e6 * found['seconds'] / count:.2f}",
                f"{found['table'] / 2**20:.0f}",
                f"{found['peak'] / 2**20:.0f}",
                f"{(found['peak'] - found['table']) / count:.0f}",
            )
        )
    titles = [
        "grains",
        "seconds",
        "µs a grain",
        "MiB with the table",
        "peak MiB",
        "more, B a grain",
    ]
    return table(titles, rows)


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
