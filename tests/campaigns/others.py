"""
The void fabric of packings that nobody here made: hard spheres, a jammed packing, Finney's balls.

Usage, from the root of the repository, with the three repositories cloned into FOLDER
(docs/validation.md says how)::

    python -m tests.campaigns.others FOLDER

Writes sample_data/paper/others.csv. Ten minutes on two cores. The packings are not shipped, for
their licences: they are fetched by who wants them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import scanfab
from scanfab.table.row import total_error
from tests.campaigns.frame import SAMPLE_DATA, asked

TABLE = SAMPLE_DATA / "paper" / "others.csv"
HARD_SPHERES = "karambola/demo/hard_spheres/input_xyz"
JAMMED = "packing-generation/Docs/Examples/packing.xyzd"
FINNEY = "MPLBM-UT/domain_construction/create_geometry_from_XYZ/FinneyPack.txt"
AXES = "xyz"
COMMON = ("grains", "contacts", "coordination", "solid_fraction")
OF_A_CUTOFF = ("cutoff", "mean_length", "alpha_vs")
CUTOFFS = "0,0.5rmin,1rmin"


class Others(NamedTuple):
    """A packing of others, and how it is measured."""

    name: str
    packing: Any
    options: dict[str, Any]


def hard_spheres(folder: Path) -> Iterator[Others]:
    """Equilibrium and compressed hard spheres of radius 1 in periodic cubes."""
    for path in sorted(folder.glob("hs-*.xyz")):
        second = path.read_text(encoding="ascii").splitlines()[1]
        edge = float(re.search(r"boxsz = ([\d.]+)", second)[1])  # type: ignore[index]
        packing = scanfab.read(
            path, format="table", skip=2, columns="x=2,y=3,z=4", radius=1.0, cell=[edge] * 3
        )
        yield Others(path.stem, packing, {"variants": "a"})


def jammed(path: Path) -> Others:
    """10,000 equal spheres, compressed until they jam; the edge stands in packing.nfo."""
    information = path.with_suffix(".nfo").read_text(encoding="ascii")
    edge = float(information.split("Dimensions:")[1].split()[0])
    # nearest neighbours are up to 1e-3 diameters apart
    packing = scanfab.read(path, cell=[edge] * 3)
    return Others("jammed", packing, {"variants": "a", "contact_tolerance": 2e-3})


def finney(path: Path) -> Others:
    """Steel balls, measured one by one (Finney 1970): an open sample, in its RV."""
    packing = scanfab.read(path, columns="id=1,x=2,y=3,z=4", radius=1.0)
    return Others("finney", packing, {"variants": "c", "edge": "start", "contact_tolerance": 0.01})


def rounded(value: Any) -> Any:
    """Six digits, and nothing for what does not exist."""
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else value


def measured(others: Others) -> Iterator[dict[str, Any]]:
    """For each cut-off: the axial anisotropies about x, y and z with their errors."""
    tables = [
        scanfab.compute(others.packing, axis=axis, cutoffs=CUTOFFS, **others.options)
        for axis in AXES
    ]
    for rows in zip(*tables, strict=True):
        line = {"sample": others.name, **{name: rows[0][name] for name in COMMON + OF_A_CUTOFF}}
        for axis, row in zip(AXES, rows, strict=True):
            line[f"alpha_vs_{axis}"] = row["alpha_vs_axial"]
            line[f"alpha_vs_{axis}_se"] = total_error(row, "alpha_vs_axial")
            line[f"alpha_c_{axis}"] = row["alpha_c_axial"]
            line[f"alpha_c_{axis}_se"] = row["alpha_c_axial_se"]
        yield {name: rounded(value) for name, value in line.items()}


def main() -> None:
    """Measure all, and write the table."""
    folder = asked(__doc__, folder=Path).folder
    samples = [*hard_spheres(folder / HARD_SPHERES), jammed(folder / JAMMED)]
    samples.append(finney(folder / FINNEY))
    rows = [row for others in samples for row in measured(others)]
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
