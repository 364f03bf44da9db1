"""What a command costs before it computes: compiled code absent, and in the cache."""

import gzip
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.timing import interleaved, table

DUMP = Path(__file__).parents[2] / "sample_data" / "liggghts_box" / "dump_120000.txt.gz"
PROGRAM = [sys.executable, "-c", "from scanfab.cli.main import main; main()"]


def startup(repeats: int) -> str:
    """Whole processes, until their end."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dump = folder / "dump.txt"
        dump.write_bytes(gzip.decompress(DUMP.read_bytes()))

        def command(*words: str) -> None:
            environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
            subprocess.run([*PROGRAM, *words], env=environment, capture_output=True, check=True)

        compute = ("compute", str(dump), "--workers", "2")
        cold = interleaved({"": lambda: command(*compute)}, 1, warm=False)[""]
        seconds = interleaved(
            {
                "python -c 'import numba, polars'": lambda: subprocess.run(
                    [sys.executable, "-c", "import numba, polars"], check=True
                ),
                "scanfab --help": lambda: command("--help"),
                "compute, 800 grains, four variants, tolerance 0.1": lambda: command(
                    *compute, "--tolerance", "0.1"
                ),
                "compute, 800 grains, four variants, tolerance 1e-4": lambda: command(*compute),
            },
            repeats,
        )
    rows = [(name, f"{value:.2f}") for name, value in seconds.items()]
    rows.append(("the last one, compiled first", f"{cold:.1f}"))
    return table(["command", "seconds in all"], rows)


SECTIONS = {"startup": startup}
