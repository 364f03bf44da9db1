"""One packing in every format gives one answer: the same segments, the same fabric."""

from __future__ import annotations

import gzip
from functools import partial

import meshio
import numpy as np
import pytest
import pyvista

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


def liggghts(folder, source):
    write(folder / "dump_5.txt", source.dump(step=5))
    return folder / "dump_5.txt", {"contacts": write(folder / "pairs_5.txt", source.local(5))}


def liggghts_shuffled(folder, source):
    path, options = liggghts(folder, source)
    *header, body = path.read_text().split("radius \n")
    lines = body.splitlines(keepends=True)
    np.random.default_rng(1).shuffle(lines)
    write(path, "radius \n".join([*header, "".join(lines)]))
    return path, options


def liggghts_several_snapshots(folder, source):
    empty = dump_text([], "id type x y z radius", box=source.box, flags=source.flags)
    path = write(folder / "dump.txt", empty + source.dump(step=5))
    local = write(folder / "pairs.txt", local_text([]) + source.local(5))
    return path, {"contacts": local, "frame": 1}


def liggghts_scaled(folder, source):
    fractions = dict(zip(("xs", "ys", "zs"), (source.position / EDGES).T, strict=True))
    path = write(folder / "dump_5.txt", source.dump("id type xs ys zs radius", 5, **fractions))
    return path, {"contacts": write(folder / "pairs_5.txt", source.local(5))}


def liggghts_unwrapped(folder, source):
    turns = np.random.default_rng(2).integers(-2, 3, source.position.shape)
    moved = source.position + (turns * EDGES if source.periodic else 0)
    columns = dict(zip(("xu", "yu", "zu"), moved.T, strict=True))
    path = write(folder / "dump_5.txt", source.dump("xu yu zu id radius type", 5, **columns))
    return path, {"contacts": write(folder / "pairs_5.txt", source.local(5))}


def liggghts_diameter(folder, source):
    text = source.dump("diameter z y x type id", 5, diameter=2 * source.radius)
    path = write(folder / "dump_5.txt", text)
    return path, {"contacts": write(folder / "pairs_5.txt", source.local(5))}


def liggghts_packed(folder, source):
    path, options = liggghts(folder, source)
    for file in (path, options["contacts"]):
        file.with_name(file.name + ".gz").write_bytes(gzip.compress(file.read_bytes()))
        file.unlink()
    packed = options["contacts"].with_name("pairs_5.txt.gz")
    return path.with_name("dump_5.txt.gz"), {"contacts": packed}


def yade_exporter(folder, source):
    path = yade_spheres(folder / "a-spheres-0.vtk", source.position, source.radius)
    return path, {"contacts": yade_lines(folder / "a-intrs-0.vtk", source.ends), **source.cell}


def yade_exporter_with_ids(folder, source):
    path = yade_spheres(folder / "a-spheres-0.vtk", source.position, source.radius, id=source.id)
    lines = yade_lines(folder / "a-intrs-0.vtk", source.ends, id1=source.id1, id2=source.id2)
    return path, {"contacts": lines, **source.cell}


def yade_text(folder, source, names="x_y_z_r", columns=()):
    rows = np.column_stack([*columns, source.position, source.radius])
    lines = ["\t".join(map(repr, row)) + "\n" for row in rows.tolist()]
    path = write(folder / "grains.txt", f"#format {names}\n" + "".join(lines))
    return path, {"contacts": "geometric", **source.cell}


def yade_text_with_ids(folder, source):
    return yade_text(folder, source, "id_x_y_z_r", [source.id])


def yade_text_and_lines(folder, source):
    path, options = yade_text(folder, source)
    return path, {**options, "contacts": yade_lines(folder / "lines.vtk", source.ends)}


def cloud(source):
    mesh = pyvista.PolyData(source.position)
    mesh["radius"] = source.radius
    return mesh


def line_mesh(source):
    count = len(source.ends)
    ends = np.arange(2 * count).reshape(-1, 2)
    return pyvista.PolyData(
        source.ends.reshape(-1, 3), lines=np.column_stack([np.full(count, 2), ends]).ravel()
    )


def vtk_of(ending, binary):
    def save(folder, source):
        cloud(source).save(folder / f"grains{ending}", binary=binary)
        line_mesh(source).save(folder / f"lines{ending}", binary=binary)
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


def table(folder, source, write_table=None):
    """Two tables with names, each column under a name that says what it is."""
    grains = dict(zip(("x", "y", "z"), source.position.T, strict=True))
    grains = {"radius": source.radius, "id": source.id, **grains}
    contacts = {"id2": source.id2, "id1": source.id1}
    write_table(folder / "grains_5", grains)
    write_table(folder / "pairs_5", contacts)
    (grains_path,) = folder.glob("grains_5.*")
    (contacts_path,) = folder.glob("pairs_5.*")
    return grains_path, {"contacts": contacts_path, **source.cell}


def text_table(ending, separator, opener=open):
    def save(path, columns):
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        lines = [list(columns), *(map(repr, row) for row in rows)]
        with opener(f"{path}{ending}", "wt") as stream:
            stream.writelines(separator.join(line) + "\n" for line in lines)

    return partial(table, write_table=save)


def comma_table(folder, source):
    def save(path, columns):
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        lines = [";".join(map(repr, row)).replace(".", ",") for row in rows]
        write(path.with_suffix(".csv"), ";".join(columns) + "\n" + "\n".join(lines) + "\n")

    return table(folder, source, save)


def npz_table(folder, source):
    return table(folder, source, lambda path, columns: np.savez(f"{path}.npz", **columns))


def parquet_table(folder, source):
    import pyarrow
    from pyarrow import parquet

    def save(path, columns):
        parquet.write_table(pyarrow.table(columns), f"{path}.parquet")

    return table(folder, source, save)


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
    "CSV": text_table(".csv", ","),
    "CSV, gzip": text_table(".csv.gz", ",", gzip.open),
    "table with tabs": text_table(".tsv", "\t"),
    "table with blanks": text_table(".txt", "   "),
    "table with semicolons and decimal commas": comma_table,
    "NPZ": npz_table,
    "Parquet": parquet_table,
    "table without names": numbered_table,
    "LIGGGHTS": liggghts,
    "LIGGGHTS, rows in any order": liggghts_shuffled,
    "LIGGGHTS, several snapshots": liggghts_several_snapshots,
    "LIGGGHTS, scaled": liggghts_scaled,
    "LIGGGHTS, unwrapped": liggghts_unwrapped,
    "LIGGGHTS, diameter": liggghts_diameter,
    "LIGGGHTS, gzip": liggghts_packed,
    "YADE, VTKExporter": yade_exporter,
    "YADE, VTKExporter with ids": yade_exporter_with_ids,
    "YADE, text": yade_text,
    "YADE, textExt with ids": yade_text_with_ids,
    "YADE, text and lines": yade_text_and_lines,
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
