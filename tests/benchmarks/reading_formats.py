"""
scanfab.read on tables, dumps of YADE and the small formats, against general parsers.

These are told where the rows begin and how many there are, and make arrays of all columns.
Processor time, which is best compared in one thread: POLARS_MAX_THREADS=1.
"""

from __future__ import annotations

import os
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import scanfab
from tests.benchmarks.timing import interleaved, table
from tests.helpers.made import esys, lf_dem, mfix, musen
from tests.helpers.made.data_files import HEAD as DATA_HEAD
from tests.helpers.made.lammps import YAML

Rows = list[tuple[float, ...]]


@dataclass(frozen=True)
class Made:
    """A file, and how a general parser that was told everything reads the rows of its tables."""

    path: Path
    separator: str
    """Between words; of several blanks in a row polars makes empty words, so pandas reads them."""
    tables: Sequence[tuple[int, int, int, Sequence[int]]]
    """Lines above, rows, words in each with those that are no numbers; the places of the latter."""


def grains(count: int) -> Rows:
    """Id, centre and radius of spheres in rows that touch, so that a guess can be proved."""
    place = np.indices((count // 10_000, 100, 100)).reshape(3, -1).T * 0.002
    place = place + 1e-6 * np.random.default_rng(0).random(place.shape)
    radius = 0.001 + 1e-7 * np.random.default_rng(1).random(len(place))
    return [
        (id, *xyz, r)
        for id, (xyz, r) in enumerate(zip(place.tolist(), radius.tolist(), strict=True), start=1)
    ]


def make_tables(folder: Path, rows: Rows) -> dict[str, Made]:
    """Tables with names and without."""
    made = {}
    for name, sign in (("csv", ","), ("tsv", "\t"), ("txt", " ")):
        path = folder / name / f"table.{name}"
        lines = (sign.join(map(repr, row)) + "\n" for row in rows)
        _write(path, sign.join(("id", "x", "y", "z", "radius")) + "\n", lines)
        made[f"table, .{name}"] = Made(path, sign, [(1, len(rows), 5, ())])
    path = folder / "aligned.txts" / "aligned.txt"
    lines = (" %8d %14.7e %14.7e %14.7e %14.7e\n" % row for row in rows)  # noqa: UP031
    _write(path, "# id x y z radius\n", lines)
    made["table, aligned by blanks"] = Made(path, r"\s+", [(1, len(rows), 5, ())])
    path = folder / "unnamed.txts" / "unnamed.txt"
    _write(path, "", ("%.9g %.9g %.9g %.9g\n" % row[1:] for row in rows))  # noqa: UP031
    made["table, without names"] = Made(path, " ", [(0, len(rows), 4, ())])
    return made


def make_dumps(folder: Path, rows: Rows) -> dict[str, Made]:
    """YADE's text, LAMMPS' dumps and its data file."""
    made = {}
    path = folder / "yade.txts" / "yade.txt"
    _write(path, "#format x_y_z_r\n", ("%g\t%g\t%g\t%g\n" % row[1:] for row in rows))  # noqa: UP031
    made["YADE `export.text`"] = Made(path, "\t", [(1, len(rows), 4, ())])
    path = folder / "lammps.texts" / "dump.lammpstrj"
    bounds = "0.0000000000000000e+00 1.0000000000000000e+00\n" * 3
    head = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS ff ff ff\n"
    head += bounds + "ITEM: ATOMS id type x y z radius\n"
    _write(path, head, ("%d 1 %g %g %g %g\n" % row for row in rows))  # noqa: UP031
    made["LAMMPS text dump"] = Made(path, " ", [(9, len(rows), 6, ())])
    path = folder / "lammps.yamls" / "lammps.yaml"
    text = (
        YAML.format(step=0, rows="@")
        .replace("natoms: 3", f"natoms: {len(rows)}")
        .replace("p, p", "f, f")
    )
    lines = ("  - [ %d, 1, %g, %g, %g, %g, 7, ]\n" % row for row in rows)  # noqa: UP031
    _write(path, text.partition("@")[0], lines, "...\n")
    above = text.partition("@")[0].count("\n")
    made["LAMMPS `dump yaml`"] = Made(path, ",", [(above, len(rows), 8, (0, 7))])
    path = folder / "liggghts.datas" / "liggghts.data"
    head = DATA_HEAD.format(title="LIGGGHTS data file", style=" # sphere")
    head = head.replace("3 atoms", f"{len(rows)} atoms")
    lines = ("%d 1 %.17g 2500 %.17g %.17g %.17g\n" % (i, 2 * r, *xyz) for i, *xyz, r in rows)  # noqa: UP031
    _write(path, head, lines)
    made["LIGGGHTS data file"] = Made(path, " ", [(head.count("\n"), len(rows), 7, ())])
    path = folder / "packing.xyzs" / "packing.xyz"
    head = f'{len(rows)}\nLattice="9 0 0 0 9 0 0 0 9" Properties=id:I:1:pos:R:3:radius:R:1\n'
    _write(path, head, (" ".join(map(repr, row)) + "\n" for row in rows))
    made["extended XYZ"] = Made(path, " ", [(2, len(rows), 5, ())])
    return made


def make_small(folder: Path, rows: Rows) -> dict[str, Made]:
    """What the small plugins read, as the programs write it."""
    made, count = {}, len(rows)

    def put(name: str, title: str, head: str, lines, width: int, sign=" ", words=(), tail=""):
        path = folder / title / name
        _write(path, head, lines, tail)
        made[title] = Made(path, sign, [(head.count("\n"), count, width, words)])

    mercury = "%.10g %.10g %.10g 0.1 0.2 0.3 %.10g 1 0 0 0 0 0 0\n"
    head = f"{count} 0.5 0 0 0 1 1 1 \n"
    put("a.data", "MercuryDPM, `.data`", head, (mercury % row[1:] for row in rows), 14)
    head = lf_dem.HEAD.replace("np 3", f"np {count}") + lf_dem.GRAINS + "# 0.1 1 0.2 0 0 \n"
    par = "%d %g %g %g %g 9.12345 9.12345 9.12345 \n"
    put("par.dat", "LF_DEM `par_*.dat`", head, (par % (i, r, *x) for i, *x, r in rows), 8)
    one = "  %19.12E  %19.12E  %19.12E  %19.12E  2.65E+03  0.0E+00  0.0E+00  0.0E+00\n"
    lines = (one % row[1:] for row in rows)
    put("particle_input.dat", "MFiX version 1", "", lines, 8, r"\s+")
    head = mfix.HEADER.format(diameter="T  0.0017", dimension=3)
    head = head.replace("Particles:    2", f"Particles:    {count}")
    two = "  %19.14E  %19.14E  %19.14E  %19.14E  2.65E+03  0.0E+00  0.0E+00  0.0E+00\n"
    put("two.dat", "MFiX version 2", head, (two % row[1:] for row in rows), 8, r"\s+")
    state = musen.STATE.format(time=0, x="%.6g %.6g %.6g").replace(" 0.5 0.5", "", 1)
    lines = (
        f"0 {i} 1 1 5 {r:.6g} 0.4 23 KEYKEYKEY 24 0 1e+300 {state % tuple(x)}\n"
        for i, *x, r in rows
    )
    put("musen.txt", "MUSEN's export", "", lines, 44, words=(8,), tail="28 0 0 0 0 0 0 0 0 0 0\n")
    (folder / "esys").mkdir()
    path = esys.run(folder / "esys", prefix="")
    lines = (f"{x} {y} {z} {r} {i} 77{esys.OTHERS}\n" for i, x, y, z, r in rows)
    _write(path.with_name("snap_t=30_1.txt"), f"{count}\n", lines, "TMIG 1\nBonded 0\n")
    _write(path.with_name("snap_t=30_2.txt"), "0\n", (), "TMIG 1\nBonded 0\n")
    made["ESyS-Particle"] = Made(path.with_name("snap_t=30_1.txt"), " ", [(1, count, 22, ())])
    return made | make_mdpa(folder, rows)


def make_mdpa(folder: Path, rows: Rows) -> dict[str, Made]:
    """Three tables in one file."""
    path, count = folder / "a.mdpas" / "a.mdpa", len(rows)
    path.parent.mkdir()
    with open(path, "w") as file:
        file.write("Begin ModelPartData\nEnd ModelPartData\nBegin Nodes\n")
        file.writelines(f"{i} {x!r} {y!r} {z!r}\n" for i, x, y, z, _ in rows)
        file.write("End Nodes\nBegin Elements SphericParticle3D\n")
        file.writelines(f"{i} 0 {i}\n" for i, *_ in rows)
        file.write("End Elements\nBegin NodalData RADIUS\n")
        file.writelines(f"{i} 0 {row[4]!r}\n" for i, row in enumerate(rows, start=1))
        file.write("End NodalData\n")
    places = [3, count + 5, 2 * count + 7]
    widths = [(count, width, ()) for width in (4, 3, 3)]
    tables = [(above, *one) for above, one in zip(places, widths, strict=True)]
    return {"Kratos `.mdpa`": Made(path, " ", tables)}


def _write(path: Path, head: str, lines, tail: str = "") -> None:
    # in a folder of its own: other files beside it might hold its contacts, and would be looked at
    path.parent.mkdir(exist_ok=True, parents=True)
    with open(path, "w") as file:
        file.write(head)
        file.writelines(lines)
        file.write(tail)


def parsers(made: Made) -> dict[str, Callable[[], object]]:
    """All columns of all tables, as numbers."""
    with open(made.path) as file:
        head = file.readlines(1 << 16)

    def with_polars() -> object:
        import polars

        found = []
        for above, count, width, words in made.tables:
            names = [f"{place}" for place in range(width)]
            schema = dict.fromkeys(names, polars.Float64)
            schema |= {f"{place}": polars.String for place in words}
            if made.separator == " " and (above >= len(head) or head[above].endswith(" \n")):
                schema |= {"behind": polars.String} if head[-1].endswith(" \n") else {}
            # what stands behind the rows is parsed as well, in spite of n_rows
            frame = polars.read_csv(
                made.path,
                has_header=False,
                separator=made.separator,
                quote_char=None,
                schema=schema,
                skip_lines=above,
                n_rows=count,
                truncate_ragged_lines=True,
                extra_columns="ignore",
                ignore_errors=True,
            )
            found += [frame[name].to_numpy() for name in names if int(name) not in words]
        return found

    def with_pandas() -> object:
        import pandas

        found = []
        for above, count, width, words in made.tables:
            numbers = [place for place in range(width) if place not in words]
            frame = pandas.read_csv(
                made.path,
                engine="c",
                sep=made.separator,
                header=None,
                skiprows=above,
                nrows=count,
                usecols=numbers,
                dtype=dict.fromkeys(numbers, np.float64),
            )
            found += [frame[name].to_numpy() for name in numbers]
        return found

    return {"pandas": with_pandas} if made.separator == r"\s+" else {"polars": with_polars}


def read(made: Made) -> object:
    """By scanfab; of ESyS-Particle by the header of the file."""
    path = made.path
    if path.parent.name == "esys":
        path = path.with_name("snap_t=30_0.txt")
    # what is kept of a file that did not change would not be read again
    os.utime(path)
    return scanfab.read(path)


def run(repeats: int, count: int = 300_000) -> dict[str, str]:
    """The section ``reading formats``."""
    warnings.simplefilter("ignore")
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder, rows = Path(name), grains(count)
        files = {
            **make_tables(folder, rows),
            **make_dumps(folder, rows),
            **make_small(folder, rows),
        }
        for title, made in files.items():
            ways = {"scanfab": lambda made=made: read(made), **parsers(made)}
            seconds = interleaved(ways, repeats, clock=time.process_time)
            best = min((value, name) for name, value in seconds.items() if name != "scanfab")
            speed = made.path.stat().st_size / seconds["scanfab"] / 1e6
            lines.append((title, f"{speed:.0f}", best[1], f"{best[0] / seconds['scanfab']:.2f}"))
    return {"reading formats": table(["file", "MB/s", "best parser", "of its speed"], lines)}
