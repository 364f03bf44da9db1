"""scanfab.read on large text files against general parsers, which are told where the rows are."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import scanfab
from tests.benchmarks.timing import interleaved, table
from tests.helpers.made import lf_dem, mfix
from tests.helpers.made.data_files import HEAD as DATA_HEAD


class Text(NamedTuple):
    """A kind of file: its name, what stands above the rows, and the row of a grain."""

    file: str
    head: str
    row: str
    separator: str = " "
    """Of several blanks in a row polars would make empty words, so that pandas reads these."""
    needed: Sequence[int] | None = None
    """Places of the words that a general parser makes arrays of; all if None."""


NAMES = "id,x,y,z,radius\n"
ROW = "{i},{x!r},{y!r},{z!r},{r!r}\n"
ITEMS = (
    "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n@\nITEM: BOX BOUNDS ff ff ff\n"
    "0 1\n0 1\n0 1\nITEM: ATOMS "
)
DUMP = Text(
    "large.dump",
    f"{ITEMS}id type x y z vx vy vz fx fy fz radius mass \n",
    "{i} 1 {x:g} {y:g} {z:g} {x:g} {y:g} {z:g} {z:g} {x:g} {y:g} {r:g} {x:g} \n",
    needed=(0, 1, 2, 3, 4, 11),
)
FORMATS = {
    "table, .csv": Text("table.csv", NAMES, ROW, ","),
    "table, .tsv": Text("table.tsv", NAMES.replace(",", "\t"), ROW.replace(",", "\t"), "\t"),
    "table, .txt": Text("table.txt", NAMES.replace(",", " "), ROW.replace(",", " ")),
    "table, aligned by blanks": Text(
        "aligned.txt",
        "# id x y z radius\n",
        " {i:8d} {x:14.7e} {y:14.7e} {z:14.7e} {r:14.7e}\n",
        r"\s+",
    ),
    "table, without names": Text("unnamed.txt", "", "{x:.9g} {y:.9g} {z:.9g} {r:.9g}\n"),
    "YADE `export.text`": Text("a.txt", "#format x_y_z_r\n", "{x:g}\t{y:g}\t{z:g}\t{r:g}\n", "\t"),
    "LAMMPS text dump": Text(
        "a.lammpstrj", f"{ITEMS}id type x y z radius\n", "{i} 1 {x:g} {y:g} {z:g} {r:g}\n"
    ),
    "LIGGGHTS data file": Text(
        "liggghts.data",
        DATA_HEAD.format(title="LIGGGHTS data file", style=" # sphere").replace(
            "3 atoms", "@ atoms"
        ),
        "{i} 1 {r:.17g} 2500 {x:.17g} {y:.17g} {z:.17g}\n",
    ),
    "extended XYZ": Text(
        "packing.xyz",
        '@\nLattice="9 0 0 0 9 0 0 0 9" Properties=id:I:1:pos:R:3:radius:R:1\n',
        ROW.replace(",", " "),
    ),
    "MercuryDPM, `.data`": Text(
        "a.data",
        "@ 0.5 0 0 0 1 1 1 \n",
        "{x:.10g} {y:.10g} {z:.10g} 0.1 0.2 0.3 {r:.10g} 1 0 0 0 0 0 0\n",
    ),
    "LF_DEM `par_*.dat`": Text(
        "par.dat",
        lf_dem.HEAD.replace("np 3", "np @") + lf_dem.GRAINS + "# 0.1 1 0.2 0 0 \n",
        "{i} {r:g} {x:g} {y:g} {z:g} 9.12345 9.12345 9.12345 \n",
    ),
    "MFiX version 1": Text(
        "particle_input.dat",
        "",
        "  {x:19.12E}  {y:19.12E}  {z:19.12E}  {r:19.12E}  2.65E+03  0.0E+00  0.0E+00  0.0E+00\n",
        r"\s+",
    ),
    "MFiX version 2": Text(
        "two.dat",
        mfix.HEADER.format(diameter="T  0.0017", dimension=3).replace(
            "Particles:    2", "Particles: @"
        ),
        "  {x:19.14E}  {y:19.14E}  {z:19.14E}  {r:19.14E}  2.65E+03  0.0E+00  0.0E+00  0.0E+00\n",
        r"\s+",
    ),
}


def write(text: Text, folder: Path, count: int) -> Path:
    """A file of spheres in rows that touch; its head says their number where it has an @."""
    place = np.indices((count // 10_000, 100, 100)).reshape(3, -1).T * 0.002
    place = place + 1e-6 * np.random.default_rng(0).random(place.shape)
    radius = 0.001 + 1e-7 * np.random.default_rng(1).random(count)
    # in a folder of its own: other files beside it might hold its contacts, and would be looked at
    path = Path(tempfile.mkdtemp(dir=folder)) / text.file
    with path.open("w") as file:
        file.write(text.head.replace("@", str(count)))
        rows = zip(place.tolist(), radius.tolist(), strict=True)
        file.writelines(
            text.row.format(i=i, x=x, y=y, z=z, r=r) for i, ((x, y, z), r) in enumerate(rows, 1)
        )
    return path


def parsers(path: Path, text: Text) -> dict[str, Callable[[], object]]:
    """Each makes arrays of the needed columns as numbers."""
    above = text.head.count("\n")
    separator = None if text.separator == r"\s+" else text.separator
    names = [str(place) for place in range(len(text.row.split(separator)))]
    # a separator at the end of a row
    ends = [names.pop()] if text.row.endswith(" \n") else []
    needed = names if text.needed is None else [names[k] for k in text.needed]

    def with_polars() -> object:
        import polars

        schema = {**dict.fromkeys(names, polars.Float64), **dict.fromkeys(ends, polars.String)}
        found = polars.scan_csv(
            path, has_header=False, separator=text.separator, quote_char=None,
            schema=schema, skip_lines=above,
        ).select(needed).collect()  # fmt: skip
        return [found[name].to_numpy() for name in needed]

    def with_pandas() -> object:
        import pandas

        found = pandas.read_csv(
            path, engine="c", sep=text.separator, header=None, names=[*names, *ends],
            usecols=needed, skiprows=above, dtype=np.float64,
        )  # fmt: skip
        return [found[name].to_numpy() for name in needed]

    ways = {"pandas": with_pandas, "polars": with_polars}
    if text.separator == r"\s+":
        del ways["polars"]
    return ways


def read(path: Path) -> object:
    """By scanfab, as if the file were new."""
    os.utime(path)
    return scanfab.read(path)


def reading(repeats: int, count: int = 2_000_000) -> str:
    """A dump as LIGGGHTS writes it, against general parsers."""
    with tempfile.TemporaryDirectory() as folder:
        path = write(DUMP, Path(folder), count)
        ways = parsers(path, DUMP)
        seconds = interleaved({"scanfab.read": partial(read, path), **ways}, repeats)
    best = min(value for name, value in seconds.items() if name in ways)
    rows = [
        (name, f"{value:.2f}", f"{best / value:.2f}")
        for name, value in sorted(seconds.items(), key=lambda item: item[1])
    ]
    return table(["reader", "seconds", "speed of the best parser"], rows)


def of_formats(repeats: int, count: int = 300_000) -> str:
    """Each format beside the best parser, in processor time: set POLARS_MAX_THREADS=1."""
    lines = []
    for title, text in FORMATS.items():
        with tempfile.TemporaryDirectory() as folder:
            path = write(text, Path(folder), count)
            ways = {"scanfab": partial(read, path), **parsers(path, text)}
            seconds = interleaved(ways, repeats, clock=time.process_time)
            size, ours = path.stat().st_size / 1e6, seconds.pop("scanfab")
            name, theirs = min(seconds.items(), key=lambda one: one[1])
        numbers = (f"{size:.0f}", f"{size / ours:.0f}", name, f"{theirs / ours:.2f}")
        lines.append((title, *numbers))
    return table(["file", "MB", "MB/s", "parser", "of its speed"], lines)


SECTIONS = {"reading": reading, "reading formats": of_formats}
