"""scanfab.read on large text files against general parsers, which are told where the rows are."""

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import scanfab
from tests.benchmarks.timing import interleaved, table


class Text(NamedTuple):
    """A kind of file: its name, the text above the rows (@ is the number of grains), and a row."""

    file: str
    head: str
    row: str
    separator: str = " "
    """``\\s+`` for several blanks in a row: pandas reads them, polars cannot."""


ITEMS = (
    "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n@\nITEM: BOX BOUNDS ff ff ff\n"
    "0 1\n0 1\n0 1\nITEM: ATOMS "
)
FORMATS = {
    "LIGGGHTS dump of 13 columns": Text(
        "large.dump",
        f"{ITEMS}id type x y z radius vx vy vz fx fy fz mass \n",
        "{i} 1 {x:g} {y:g} {z:g} {r:g} {x:g} {y:g} {z:g} {z:g} {x:g} {y:g} {x:g} \n",
    ),
    "table, .csv": Text("a.csv", "id,x,y,z,radius\n", "{i},{x!r},{y!r},{z!r},{r!r}\n", ","),
    "table, aligned by blanks": Text(
        "aligned.txt",
        "# id x y z radius\n",
        " {i:8d} {x:14.7e} {y:14.7e} {z:14.7e} {r:14.7e}\n",
        r"\s+",
    ),
    "YADE `export.text`": Text("a.txt", "#format x_y_z_r\n", "{x:g}\t{y:g}\t{z:g}\t{r:g}\n", "\t"),
    "extended XYZ": Text(
        "packing.xyz",
        '@\nLattice="9 0 0 0 9 0 0 0 9" Properties=id:I:1:pos:R:3:radius:R:1\n',
        "{i} {x!r} {y!r} {z!r} {r!r}\n",
    ),
    "MercuryDPM, `.data`": Text(
        "a.data",
        "@ 0.5 0 0 0 1 1 1 \n",
        "{x:.10g} {y:.10g} {z:.10g} 0.1 0.2 0.3 {r:.10g} 1 0 0 0 0 0 0\n",
    ),
}


def write(text: Text, folder: Path, count: int) -> Path:
    """A file of spheres in rows that touch."""
    place = np.indices((count // 10_000, 100, 100)).reshape(3, -1).T * 0.002
    place = place + 1e-6 * np.random.default_rng(0).random(place.shape)
    radius = 0.001 + 1e-7 * np.random.default_rng(1).random(count)
    path = folder / text.file
    with path.open("w") as file:
        file.write(text.head.replace("@", str(count)))
        rows = zip(place.tolist(), radius.tolist(), strict=True)
        file.writelines(
            text.row.format(i=i, x=x, y=y, z=z, r=r) for i, ((x, y, z), r) in enumerate(rows, 1)
        )
    return path


def parsers(path: Path, text: Text) -> dict[str, Callable[[], object]]:
    """General parsers; each makes arrays of all columns, as scanfab does."""
    above, sign = text.head.count("\n"), text.separator
    words = text.row.rstrip("\n").split(None if sign == r"\s+" else sign)
    names = [str(place) for place in range(len(words))]
    needed = [name for name, word in zip(names, words, strict=True) if word]

    def with_polars() -> object:
        import polars

        # a blank at the end of each row makes a column without values
        kinds = [polars.Float64 if word else polars.String for word in words]
        schema = dict(zip(names, kinds, strict=True))
        found = polars.scan_csv(
            path, has_header=False, separator=sign, quote_char=None, schema=schema, skip_lines=above
        )
        return [one.to_numpy() for one in found.select(needed).collect()]

    def with_pandas() -> object:
        import pandas

        found = pandas.read_csv(
            path, sep=sign, header=None, names=names, usecols=needed, skiprows=above, dtype=float
        )
        return [found[name].to_numpy() for name in needed]

    return {"pandas": with_pandas} | ({} if sign == r"\s+" else {"polars": with_polars})


def reading(repeats: int, count: int = 200_000) -> str:
    """Each format beside the fastest general parser, in processor time."""
    lines = []
    for title, text in FORMATS.items():
        # a folder of its own: other files beside it might hold its contacts
        with tempfile.TemporaryDirectory() as folder:
            path = write(text, Path(folder), count)

            def read(path: Path = path) -> object:
                os.utime(path)  # as if the file were new
                return scanfab.read(path)

            ways = {"scanfab": read, **parsers(path, text)}
            seconds = interleaved(ways, repeats, clock=time.process_time)
            size, ours = path.stat().st_size / 1e6, seconds.pop("scanfab")
            name, theirs = min(seconds.items(), key=lambda one: one[1])
        numbers = (f"{size / ours:.0f}", name, f"{theirs / ours:.2f}")
        lines.append((title, *numbers))
    return table(["file", "MB/s", "best parser", "of its speed"], lines)


SECTIONS = {"reading": reading}
