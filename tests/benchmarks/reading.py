"""scanfab.read on a text dump of two million grains against general parsers, same columns."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np

import scanfab
from tests.benchmarks.timing import interleaved, table

NAMES = ["id", "type", "x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz", "radius", "mass"]
NEEDED = ["id", "type", "x", "y", "z", "radius"]
PLACES = [NAMES.index(name) for name in NEEDED]
HEADER = 9


def write_dump(path: Path, count: int) -> None:
    """As LIGGGHTS writes it: %d and %g, and a blank at the end of a line."""
    random = np.random.default_rng(0)
    id = random.permutation(count) + 1
    row = "%d %d " + "%g " * 11 + "\n"
    with open(path, "w") as file:
        file.write(f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{count}\n")
        file.write(
            "ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS " + " ".join(NAMES) + " \n"
        )
        for start in range(0, count, 100_000):
            part = id[start : start + 100_000]
            values = random.random((len(part), 11))
            values[:, 3:9] = 1e-3 * random.standard_normal((len(part), 6))
            values[:, 9:] = 0.005 + 0.01 * values[:, 9:]
            file.writelines(
                row % (number, 1, *line)
                for number, line in zip(part.tolist(), values.tolist(), strict=True)
            )


def parsers(path: Path, count: int) -> dict[str, Callable[[], object]]:
    """Those that are installed; each makes arrays of the needed columns."""
    names = [*NAMES, "behind"]

    def with_polars() -> object:
        import polars

        schema = {**dict.fromkeys(NAMES, polars.Float64), "behind": polars.String}
        frame = polars.scan_csv(
            path,
            has_header=False,
            separator=" ",
            quote_char=None,
            schema=schema,
            skip_lines=HEADER,
        )
        found = frame.select(NEEDED).collect()
        return [found[name].to_numpy() for name in NEEDED]

    def with_pandas() -> object:
        import pandas

        found = pandas.read_csv(
            path,
            engine="c",
            sep=" ",
            header=None,
            names=names,
            usecols=NEEDED,
            skiprows=HEADER,
            dtype=np.float64,
        )
        return [found[name].to_numpy() for name in NEEDED]

    def with_pyarrow() -> object:
        from pyarrow import csv

        found = csv.read_csv(
            path,
            read_options=csv.ReadOptions(column_names=names, skip_rows=HEADER),
            parse_options=csv.ParseOptions(delimiter=" ", quote_char=False),
            convert_options=csv.ConvertOptions(
                include_columns=NEEDED, column_types=dict.fromkeys(NAMES, "float64")
            ),
        )
        return [found[name].to_numpy() for name in NEEDED]

    def with_numpy() -> object:
        return np.loadtxt(path, skiprows=HEADER, usecols=PLACES, comments=None, max_rows=count)

    def with_ovito() -> object:
        from ovito.io import import_file

        known = ["Particle Identifier", "Particle Type", *(f"Position.{x}" for x in "XYZ")]
        found = import_file(path, columns=[*known, *6 * [None], "Radius", None]).compute()
        return [
            found.particles[name][...] for name in ("Particle Identifier", "Position", "Radius")
        ]

    ways = {
        "polars": with_polars,
        "pandas": with_pandas,
        "pyarrow": with_pyarrow,
        "numpy": with_numpy,
        "ovito": with_ovito,
    }
    return {name: way for name, way in ways.items() if _is_installed(name)}


def _is_installed(name: str) -> bool:
    try:
        import_module("ovito.io" if name == "ovito" else name)
    except ImportError:
        return False
    return True


def run(repeats: int, count: int = 2_000_000) -> dict[str, str]:
    """The section ``reading``."""
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.dump"
        write_dump(path, count)
        ways = parsers(path, count)
        seconds = interleaved({"scanfab.read": lambda: scanfab.read(path), **ways}, repeats)
    best = min(value for name, value in seconds.items() if name in ways)
    rows = [
        (name, f"{value:.2f}", f"{best / value:.2f}")
        for name, value in sorted(seconds.items(), key=lambda item: item[1])
    ]
    missing = [
        name for name in ("polars", "pandas", "pyarrow", "numpy", "ovito") if name not in ways
    ]
    note = f"\n\nNot installed, so not measured: {', '.join(missing)}." if missing else ""
    return {"reading": table(["reader", "seconds", "speed of the best parser"], rows) + note}
