"""Small dump files as the programs write them, for tests of readers and series."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.lattices import shaken_cubic

UNIT_BOX = ((0, 1), (0, 1), (0, 1))
NAMES = "id type x y z radius"
# three grains in a row; the first two touch, and the last two
ROWS = ((1, 1, 0.2, 0.5, 0.5, 0.1), (2, 1, 0.39, 0.5, 0.5, 0.1), (3, 2, 0.58, 0.5, 0.5, 0.1))
PAIRS = ((1, 2), (2, 3))


def dump_text(
    rows: Sequence[Sequence[object]] = ROWS,
    names: str = NAMES,
    *,
    step: int = 0,
    box: Sequence[Sequence[object]] = UNIT_BOX,
    flags: str = " ff ff ff",
    before: str = "",
    after: str = "",
    word: str = "ATOMS",
    separator: str = " ",
    end: str = " \n",
) -> str:
    """One snapshot of a text dump; ``before`` and ``after`` are items around TIMESTEP."""
    header = (
        f"{before}ITEM: TIMESTEP\n{step}\n{after}ITEM: NUMBER OF {word}\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS{flags}\n"
        + "".join(" ".join(map(str, bounds)) + "\n" for bounds in box)
        + f"ITEM: {word} {names} \n"
    )
    return header + "".join(separator.join(map(str, row)) + end for row in rows)


def cubic_rows(count: int = 4, squeeze: float = 1.0) -> list[tuple[object, ...]]:
    """Rows of count³ grains that nearly touch, in a cube with the edge ``count``."""
    packing = shaken_cubic(np.random.default_rng(0), count)
    position = packing.position * [1, 1, squeeze]
    numbers = zip(position.tolist(), packing.radius.tolist(), strict=True)
    return [(row, 1, *place, size) for row, (place, size) in enumerate(numbers, start=1)]


def local_text(rows: Sequence[Sequence[object]], *, step: int = 0, word: str = "ENTRIES") -> str:
    """One snapshot of a contact dump: the names of the columns say nothing."""
    width = len(rows[0]) if len(rows) else 3
    names = " ".join(f"c_con[{number}]" for number in range(1, width + 1))
    return dump_text(rows, names, step=step, word=word)


def pairs_text(pairs: Sequence[Sequence[int]] = PAIRS, *, step: int = 0) -> str:
    """A contact dump with ids, face flag and a force that pushes the first grain to -x."""
    return local_text([(*pair, 0, -1.5, 0, 0) for pair in pairs], step=step)


def write(path: Path, text: str) -> Path:
    """A text file, its line ends as they are."""
    path.write_bytes(text.encode())
    return path


def yade_spheres(path: Path, position, radius, **scalars) -> Path:
    """What YADE's VTKExporter writes for spheres, with all digits."""
    return write(
        path,
        "# vtk DataFile Version 3.0.\ncomment\nASCII\n\nDATASET POLYDATA\n"
        + _points(position)
        + f"\nPOINT_DATA {len(position)}\n"
        + _scalars({"radius": radius, **scalars}),
    )


def yade_lines(path: Path, ends, vectors=None, **scalars) -> Path:
    """What YADE's VTKExporter writes for interactions: both centres, shape (M, 2, 3)."""
    ends = np.asarray(ends, dtype=float)
    count = len(ends)
    lines = "".join(f"2 {2 * line} {2 * line + 1}\n" for line in range(count))
    data = f"\nCELL_DATA {count}\n" if scalars or vectors else ""
    named = "".join(
        f"\nVECTORS {name} double\n" + _rows(values) for name, values in (vectors or {}).items()
    )
    return write(
        path,
        "# vtk DataFile Version 3.0.\ncomment\nASCII\n\nDATASET POLYDATA\n"
        + _points(ends.reshape(-1, 3))
        + f"LINES {count} {3 * count}\n{lines}{data}"
        + _scalars(scalars)
        + named,
    )


def _points(position) -> str:
    return f"POINTS {len(position)} double\n" + _rows(position)


def _rows(values) -> str:
    return "".join(" ".join(repr(float(x)) for x in row) + "\n" for row in values)


def _scalars(arrays) -> str:
    return "".join(
        f"\nSCALARS {name} double 1\nLOOKUP_TABLE default\n"
        + "".join(f"{float(value)!r}\n" for value in values)
        for name, values in arrays.items()
    )
