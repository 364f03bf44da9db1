"""One packing in formats of each kind gives one answer: the same segments, the same fabric."""

from __future__ import annotations

import numpy as np
import pyarrow
import pytest
import pyvista
from pyarrow import parquet

import scanfab
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing
from tests.helpers.dumps import dump_text, local_text, write, yade_lines
from tests.helpers.truth import COMPONENTS

EDGES = np.array([6.0, 6.6, 7.2])
SCAN = {"directions": 25, "spacing": 0.2, "rv": 0.7, "cutoff": "0.2rmin"}


def loose_lattice(cell=None):
    """216 spheres about the points of a lattice, most of them touching some neighbours."""
    random = np.random.default_rng(7)
    grid = np.stack(np.meshgrid(*[np.arange(6.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    position = (grid + 0.5 + random.uniform(-0.08, 0.08, grid.shape)) * EDGES / 6
    packing = Packing(
        position,
        random.uniform(0.47, 0.68, len(grid)),
        id=random.permutation(1000)[: len(grid)] + 1,
        columns={"type": random.integers(1, 3, len(grid))},
        cell=cell,
    )
    return scanfab.find_contacts(packing)


OPEN = loose_lattice()
PERIODIC = loose_lattice(Cell(EDGES))


class Source:
    """The arrays of a packing, as programs write them."""

    def __init__(self, packing):
        self.periodic, contacts = packing.is_periodic, packing.contacts
        self.position, self.radius, self.id = packing.position, packing.radius, packing.id
        self.type = packing.columns["type"]
        self.crossing = contacts.image.any(axis=1)
        self.id1, self.id2 = self.id[contacts.pairs].T
        # both centres: the second where it touches the first
        one, two = self.position[contacts.pairs.T]
        self.ends = np.stack([one, two + contacts.image @ np.diag(EDGES)], axis=1)
        self.box = {
            "box": [(0, edge) for edge in EDGES.tolist()],
            "flags": " pp pp pp" if self.periodic else " ff ff ff",
        }

    def place(self):
        return dict(zip("xyz", self.position.T, strict=True))


def liggghts(folder, source):
    names = "id type x y z radius"
    known = {**vars(source), **source.place()}
    rows = zip(*(known[name].tolist() for name in names.split()), strict=True)
    text = dump_text(list(rows), names, step=5, **source.box)
    pairs = np.column_stack([source.id1, source.id2, source.crossing]).tolist()
    local = write(folder / "pairs_5.txt", local_text(pairs, step=5))
    return write(folder / "dump_5.txt", text), {"contacts": local}


def yade_text(folder, source):
    rows = np.column_stack([source.position, source.radius])
    text = "".join("\t".join(map(repr, row)) + "\n" for row in rows.tolist())
    path = write(folder / "grains.txt", f"#format x_y_z_r\n{text}")
    return path, {"contacts": yade_lines(folder / "lines.vtk", source.ends)}


def vtk_of(ending, binary):
    """Grains and lines by VTK's own writers."""

    def save(folder, source):
        grains, lines = folder / f"grains{ending}", folder / f"lines{ending}"
        mesh = pyvista.PolyData(source.position)
        mesh["radius"] = source.radius
        mesh.save(grains, binary=binary)
        points, ends = source.ends.reshape(-1, 3), np.arange(2 * len(source.ends)).reshape(-1, 2)
        cells = np.insert(ends, 0, 2, axis=1).ravel()
        pyvista.PolyData(points, lines=cells).save(lines, binary=binary)
        return grains, {"contacts": lines}

    return save


def table(ending, put):
    """Two tables with names, each column under a name that says what it is."""

    def save(folder, source):
        grains, contacts = folder / f"grains_5{ending}", folder / f"pairs_5{ending}"
        put(grains, {"radius": source.radius, "id": source.id, **source.place()})
        put(contacts, {"id2": source.id2, "id1": source.id1})
        return grains, {"contacts": contacts}

    return save


def put_text(path, columns):
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    write(path, "".join(",".join(map(str, row)) + "\n" for row in [columns, *rows]))


def numbered_table(folder, source):
    """Without names: the user says which column is what."""
    rows = np.column_stack([source.id, 2 * source.radius, source.position])
    np.savetxt(folder / "grains_5.txt", rows, "%.17g")
    np.savetxt(folder / "pairs_5.txt", np.column_stack([source.id1, source.id2]), "%d")
    return folder / "grains_5.txt", {
        "columns": "id=1,diameter=2,x=3,y=4,z=5",
        "contacts": folder / "pairs_5.txt",
        "contact_columns": "id1=1,id2=2",
    }


FORMATS = {
    "CSV": table(".csv", put_text),
    "NPZ": table(".npz", lambda path, columns: np.savez(path, **columns)),
    "Parquet": table(
        ".parquet", lambda path, columns: parquet.write_table(pyarrow.table(columns), path)
    ),
    "table without names": numbered_table,
    "LIGGGHTS": liggghts,
    "YADE, text and lines": yade_text,
    "legacy VTK, ASCII": vtk_of(".vtk", binary=False),
    ".vtp, binary": vtk_of(".vtp", binary=True),
}


@pytest.fixture(scope="module")
def expected():
    return {one.is_periodic: scanfab.compute(one, **SCAN) for one in (OPEN, PERIODIC)}


@pytest.mark.parametrize("packing", [OPEN, PERIODIC], ids=["open", "periodic"])
@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_answer(tmp_path, expected, name, packing):
    path, options = FORMATS[name](tmp_path, Source(packing))
    if packing.is_periodic and not name.startswith("LIGGGHTS"):
        options["cell"] = tuple(EDGES.tolist())
    table = scanfab.compute(scanfab.read(path, **options), **SCAN)
    wanted = expected[packing.is_periodic]
    for column in ("grains", "rattlers", "contacts", "lines", "segments"):
        np.testing.assert_array_equal(table[column], wanted[column], err_msg=column)
    for column in ("alpha_vs", "alpha_vs_axial", "solid_fraction", "mean_length"):
        np.testing.assert_allclose(table[column], wanted[column], atol=1e-5, err_msg=column)
    # VTK's own text has 11 digits
    digits = 1e-11 if name == "legacy VTK, ASCII" else 1e-12
    for part in COMPONENTS:
        np.testing.assert_allclose(table[f"gc_{part}"], wanted[f"gc_{part}"], rtol=0, atol=digits)
    # and it is worth comparing
    assert min(wanted["contacts"]) > 30
    assert min(wanted["segments"]) > 1000
    assert np.any(wanted["segments"] != wanted["segments"][0])
    assert (packing.contacts.image.any(axis=1).sum() > 30) == packing.is_periodic
