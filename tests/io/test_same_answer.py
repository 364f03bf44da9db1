"""One packing in every format gives one answer: the same segments, the same fabric."""

from __future__ import annotations

import gzip

import meshio
import numpy as np
import pyarrow
import pytest
import pyvista
from pyarrow import parquet

import scanfab
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing
from tests.helpers.dumps import dump_text, local_text, write, yade_lines, yade_spheres
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
        self.packing, self.periodic = packing, packing.is_periodic
        self.position, self.radius, self.id = packing.position, packing.radius, packing.id
        self.pairs = packing.contacts.pairs
        self.id1, self.id2 = self.id[self.pairs].T
        image = packing.contacts.image @ np.diag(EDGES)
        # both centres: the second where it touches the first
        self.ends = np.stack(
            [self.position[self.pairs[:, 0]], self.position[self.pairs[:, 1]] + image], 1
        )
        self.cell = {"cell": tuple(EDGES.tolist())} if self.periodic else {}
        self.flags = " pp pp pp" if self.periodic else " ff ff ff"
        self.box = [(0, edge) for edge in EDGES.tolist()]

    def dump(self, names="id type x y z radius", step=0, **columns):
        known = {
            "id": self.id,
            "type": self.packing.columns["type"],
            **dict(zip(("x", "y", "z"), self.position.T, strict=True)),
            "radius": self.radius,
            **columns,
        }
        rows = zip(*(known[name].tolist() for name in names.split()), strict=True)
        return dump_text(list(rows), names, step=step, box=self.box, flags=self.flags)

    def local(self, step=0):
        crossing = np.any(self.packing.contacts.image != 0, axis=1).astype(int)
        rows = zip(self.id1.tolist(), self.id2.tolist(), crossing.tolist(), strict=True)
        return local_text(list(rows), step=step)


def liggghts(names="id type x y z radius", columns=lambda source: {}, change=lambda text: text):
    """A dump with other columns, or with another text."""

    def save(folder, source):
        text = change(source.dump(names, 5, **columns(source)))
        local = write(folder / "pairs_5.txt", source.local(5))
        return write(folder / "dump_5.txt", text), {"contacts": local}

    return save


def coordinates(names, values):
    return lambda source: dict(zip(names.split(), values(source).T, strict=True))


def unwrapped(source):
    turns = np.random.default_rng(2).integers(-2, 3, source.position.shape)
    return source.position + (turns * EDGES if source.periodic else 0)


def shuffled(text):
    *header, body = text.split("radius \n")
    lines = body.splitlines(keepends=True)
    np.random.default_rng(1).shuffle(lines)
    return "radius \n".join([*header, "".join(lines)])


def liggghts_several_snapshots(folder, source):
    empty = dump_text([], "id type x y z radius", box=source.box, flags=source.flags)
    path = write(folder / "dump.txt", empty + source.dump(step=5))
    local = write(folder / "pairs.txt", local_text([]) + source.local(5))
    return path, {"contacts": local, "frame": 1}


def liggghts_packed(folder, source):
    path, options = liggghts()(folder, source)
    packed = [file.with_name(f"{file.name}.gz") for file in (path, options["contacts"])]
    for file in packed:
        file.write_bytes(gzip.compress(file.with_suffix("").read_bytes()))
        file.with_suffix("").unlink()
    return packed[0], {"contacts": packed[1]}


def yade_exporter(folder, source):
    path = yade_spheres(folder / "a-spheres-0.vtk", source.position, source.radius)
    return path, {"contacts": yade_lines(folder / "a-intrs-0.vtk", source.ends), **source.cell}


def yade_exporter_with_ids(folder, source):
    path = yade_spheres(folder / "a-spheres-0.vtk", source.position, source.radius, id=source.id)
    lines = yade_lines(folder / "a-intrs-0.vtk", source.ends, id1=source.id1, id2=source.id2)
    return path, {"contacts": lines, **source.cell}


def yade_text(names, lines):
    """Text of spheres, with contacts by geometry or as lines."""

    def save(folder, source):
        ids = [source.id] if names.startswith("id") else []
        rows = np.column_stack([*ids, source.position, source.radius])
        text = "".join("\t".join(map(repr, row)) + "\n" for row in rows.tolist())
        path = write(folder / "grains.txt", f"#format {names}\n{text}")
        contacts = yade_lines(folder / "lines.vtk", source.ends) if lines else "geometric"
        return path, {"contacts": contacts, **source.cell}

    return save


def vtk_of(ending, binary):
    def save(folder, source):
        ends = np.arange(2 * len(source.ends)).reshape(-1, 2)
        cells = np.insert(ends, 0, 2, axis=1).ravel()
        grains = pyvista.PolyData(source.position)
        grains["radius"] = source.radius
        grains.save(folder / f"grains{ending}", binary=binary)
        lines = pyvista.PolyData(source.ends.reshape(-1, 3), lines=cells)
        lines.save(folder / f"lines{ending}", binary=binary)
        return folder / f"grains{ending}", {"contacts": folder / f"lines{ending}", **source.cell}

    return save


def grid_of(ending, **options):
    def save(folder, source):
        vertices = [("vertex", np.arange(len(source.position))[:, None])]
        mesh = meshio.Mesh(source.position, vertices, point_data={"radii": source.radius})
        mesh.write(folder / f"grains{ending}", **options)
        ends = np.arange(2 * len(source.ends)).reshape(-1, 2)
        lines = meshio.Mesh(source.ends.reshape(-1, 3), [("line", ends)])
        lines.write(folder / f"lines{ending}", **options)
        return folder / f"grains{ending}", {"contacts": folder / f"lines{ending}", **source.cell}

    return save


def table(ending, put):
    """Two tables with names, each column under a name that says what it is."""

    def save(folder, source):
        place = dict(zip(("x", "y", "z"), source.position.T, strict=True))
        grains, contacts = folder / f"grains_5{ending}", folder / f"pairs_5{ending}"
        put(grains, {"radius": source.radius, "id": source.id, **place})
        put(contacts, {"id2": source.id2, "id1": source.id1})
        return grains, {"contacts": contacts, **source.cell}

    return save


def text(separator, opener=open, comma="."):
    def put(path, columns):
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        lines = [separator.join(columns), *(separator.join(map(repr, row)) for row in rows)]
        with opener(path, "wt") as stream:
            stream.write("\n".join(lines).replace(".", comma) + "\n")

    return put


def put_parquet(path, columns):
    parquet.write_table(pyarrow.table(columns), path)


def numbered_table(folder, source):
    """Without names: the user says which column is what."""
    rows = np.column_stack([source.id, 2 * source.radius, source.position])
    np.savetxt(folder / "grains_5.txt", rows, "%.17g")
    np.savetxt(folder / "pairs_5.txt", np.column_stack([source.id1, source.id2]), "%d")
    return folder / "grains_5.txt", {
        "columns": "id=1,diameter=2,x=3,y=4,z=5",
        "contacts": folder / "pairs_5.txt",
        "contact_columns": "id1=1,id2=2",
        **source.cell,
    }


FORMATS = {
    "CSV": table(".csv", text(",")),
    "CSV, gzip": table(".csv.gz", text(",", gzip.open)),
    "table with tabs": table(".tsv", text("\t")),
    "table with blanks": table(".txt", text("   ")),
    "table with semicolons and decimal commas": table(".csv", text(";", comma=",")),
    "NPZ": table(".npz", lambda path, columns: np.savez(path, **columns)),
    "Parquet": table(".parquet", put_parquet),
    "table without names": numbered_table,
    "LIGGGHTS": liggghts(),
    "LIGGGHTS, rows in any order": liggghts(change=shuffled),
    "LIGGGHTS, several snapshots": liggghts_several_snapshots,
    "LIGGGHTS, scaled": liggghts(
        "id type xs ys zs radius", coordinates("xs ys zs", lambda source: source.position / EDGES)
    ),
    "LIGGGHTS, unwrapped": liggghts("xu yu zu id radius type", coordinates("xu yu zu", unwrapped)),
    "LIGGGHTS, diameter": liggghts(
        "diameter z y x type id", lambda source: {"diameter": 2 * source.radius}
    ),
    "LIGGGHTS, gzip": liggghts_packed,
    "YADE, VTKExporter": yade_exporter,
    "YADE, VTKExporter with ids": yade_exporter_with_ids,
    "YADE, text": yade_text("x_y_z_r", lines=False),
    "YADE, textExt with ids": yade_text("id_x_y_z_r", lines=False),
    "YADE, text and lines": yade_text("x_y_z_r", lines=True),
    "legacy VTK, ASCII": vtk_of(".vtk", binary=False),
    "legacy VTK, binary": vtk_of(".vtk", binary=True),
    ".vtp, ASCII": vtk_of(".vtp", binary=False),
    ".vtp, binary": vtk_of(".vtp", binary=True),
    ".vtu": grid_of(".vtu"),
    ".vtu, not compressed": grid_of(".vtu", compression=None),
    "legacy grid": grid_of(".vtk", file_format="vtk51"),
    ".xdmf": grid_of(".xdmf", data_format="XML"),
}


def answer(packing):
    return scanfab.compute(packing, **SCAN)


@pytest.fixture(scope="module")
def expected():
    return {packing.is_periodic: answer(packing) for packing in (OPEN, PERIODIC)}


@pytest.mark.parametrize("packing", [OPEN, PERIODIC], ids=["open", "periodic"])
@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_answer(tmp_path, expected, name, packing):
    path, options = FORMATS[name](tmp_path, Source(packing))
    table = answer(scanfab.read(path, **options))
    wanted = expected[packing.is_periodic]
    for column in ("grains", "rattlers", "contacts", "lines", "segments"):
        np.testing.assert_array_equal(table[column], wanted[column], err_msg=column)
    for column in ("alpha_vs", "alpha_vs_axial", "solid_fraction", "mean_length"):
        np.testing.assert_allclose(table[column], wanted[column], atol=1e-5, err_msg=column)
    # VTK's own text has 11 digits
    digits = 1e-11 if name == "legacy VTK, ASCII" else 1e-12
    for part in COMPONENTS:
        np.testing.assert_allclose(table[f"gc_{part}"], wanted[f"gc_{part}"], rtol=0, atol=digits)


@pytest.mark.parametrize("packing", [OPEN, PERIODIC], ids=["open", "periodic"])
def test_the_packing_is_worth_comparing(expected, packing):
    table = expected[packing.is_periodic]
    assert len(packing.contacts) > 200
    assert np.all(table["contacts"] > 30)
    assert np.all(table["segments"] > 1000)
    crossing = np.any(packing.contacts.image != 0, axis=1).sum()
    assert (crossing > 30) == packing.is_periodic
    assert np.any(table["segments"] != table["segments"][0])
