"""LIGGGHTS' dumps: its own files against their truth, and the layouts of contact columns."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from tests.helpers import truth
from tests.helpers.dumps import refuses
from tests.helpers.truth import FLOOR, PERIODIC, SIX_DIGITS, assert_true_contacts, csv_rows

FLOOR_CELL = {"cell": (0.014, 0.013, 0.04), "periodic": "xy"}
TEXT = ["tutorial.txt", "tutorial.txt.gz", "shuffled.txt", "scaled.txt", "unwrapped.txt"]
TEXT += ["diameter.txt", "blanks.txt", "label.txt", "padded_000030000.txt", "precise.txt"]
VTK = [f"grains_{kind}30000.{end}" for kind in ("", "binary_") for end in ("vtk", "vtp", "vtu")]
OTHERS = ["dump.txt", "scaled.txt", "unwrapped.txt", "precise.txt", "grains_30000.vtk"]
KEYWORDS = {
    "pairs_all.txt.gz": "pos vel id force torque history contactArea",
    "pairs_pos_id_force.txt": "force id pos",
    "pairs_id_force.txt": "id force",
    "pairs_contactpoint.txt": "pos id force delta contactPoint",
    "pairs_pos_id_force_30000.vtk": None,
    "pairs_all_30000.vtk.gz": None,
    "pairs_contactpoint_30000.vtk.gz": None,
}


# the file with the fewest columns has the force on the first grain: from the second to the first
NAMES = "id2,id1,crosses,fx,fy,fz"
FORCES = np.genfromtxt(FLOOR / "pairs_id_force.txt", skip_header=9, names=NAMES)


def assert_true_grains(packing, folder, digits=SIX_DIGITS):
    """Ids and radii exactly, positions to the digits of the file."""
    grains = csv_rows(folder / "truth_grains.csv")
    order = np.argsort(packing.id)
    np.testing.assert_array_equal(packing.id[order], grains["id"])
    np.testing.assert_allclose(packing.radius[order], grains["radius"], rtol=1e-14)
    expected = truth.centres(grains)[np.argsort(order)]
    assert truth.off_by(packing, expected).max() < digits * 0.04


FORMS = [
    *((FLOOR, name, {}) for name in TEXT),
    *((FLOOR, name, {"periodic": "xy"}) for name in VTK),
    (FLOOR, "atom_30000.vtu", FLOOR_CELL),
    *((PERIODIC, name, {"periodic": "xyz"}) for name in OTHERS),
]


@pytest.mark.parametrize(("folder", "name", "options"), FORMS)
def test_every_form_gives_the_same_grains(folder, name, options):
    packing = scanfab.read(folder / name, **options)
    # VTK files have no step, and single ones none by their names
    assert (packing.step is None) == (".vt" in name)
    assert packing.cell.periodic == (True, True, folder is PERIODIC)
    assert_true_grains(packing, folder, 1e-12 if name == "precise.txt" else SIX_DIGITS)
    if name == "shuffled.txt":
        assert packing.step == 30000
        assert sorted(packing.columns) == ["c_ca", "mass", "type", "vx"]


@pytest.mark.parametrize("name", KEYWORDS)
@pytest.mark.parametrize("grains", ["tutorial.txt", "unwrapped.txt", "grains_30000.vtk"])
def test_every_contact_form_gives_the_same_contacts(grains, name):
    for keywords in {KEYWORDS[name], None}:
        options = {"contacts": FLOOR / name, "contact_columns": keywords}
        packing = scanfab.read(FLOOR / grains, periodic="xy", **options)
        assert_true_contacts(packing, csv_rows(FLOOR / "truth_contacts.csv"), normals=1e-4)
        assert_true_contacts(packing, FORCES, forces=1e-5)
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.mean(push > 0) > 0.9


@pytest.mark.parametrize("name", ["pairs.txt", "pairs_30000.vtk.gz"])
def test_contacts_across_periodic_faces_are_true(name):
    packing = scanfab.read(PERIODIC / "dump.txt", contacts=PERIODIC / name)
    contacts = csv_rows(PERIODIC / "truth_contacts.csv")
    assert_true_contacts(packing, contacts, normals=1e-4)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    assert crossing.sum() == contacts["crossing"].sum() == 114


@pytest.mark.parametrize("folder", [FLOOR, PERIODIC])
def test_geometry_finds_the_contacts_of_the_program(folder):
    packing = scanfab.find_contacts(scanfab.read(folder / "precise.txt"))
    assert truth.id_pairs(packing) == truth.true_pairs(csv_rows(folder / "truth_contacts.csv"))


def test_wall_contacts_count_for_their_grains():
    names = ("tutorial.txt", "pairs_all.txt.gz", "walls_all.txt")
    packing = scanfab.read_series([FLOOR / name for name in names])[0].read()
    assert_true_contacts(packing, csv_rows(FLOOR / "truth_contacts.csv"), normals=1e-4)
    assert packing.wall_contacts.sum() == 25
    ids = np.loadtxt(FLOOR / "walls_all.txt", skiprows=9)[:, 14].astype(int)
    assert set(packing.id[packing.wall_contacts > 0].tolist()) == set(ids.tolist())


@pytest.mark.parametrize("columns", [None, "pos id force", "id1=c_a[1],id2=c_a[2]"])
@pytest.mark.parametrize("grains", ["tutorial.txt", "shuffled.txt", "precise.txt"])
def test_wall_contacts_alone_leave_the_contacts_to_geometry(grains, columns):
    walls = FLOOR / "walls_all.txt"
    with pytest.warns(scanfab.ScanfabWarning, match=r"walls_all.txt: lists contacts with walls on"):
        packing = scanfab.read(FLOOR / grains, contacts=walls, contact_columns=columns)
    assert (packing.contacts, packing.wall_contacts.sum()) == (None, 25)


NO_GRAINS = ["mesh_30000.vtk", "decomposition_30000.vtk", "grains_boundingBox_30000.vtk"]
NO_GRAINS += ["grains_binary_boundingBox_30000.vtk", "grains_boundingBox_30000.vtr"]


WITHOUT_GRAINS = [
    *((name, "no grains: expected points with a radius") for name in NO_GRAINS),
    ("mesh_30000.stl", "no reader knows this format"),
    ("binary_30000.bin", "the 6 columns have no names: number them"),
    ("pairs_id_force.txt", r"no grains.*found contacts \(pairs_id_force.txt\)"),
    ("noradius.txt", r"noradius.txt, step 30000: no radius.*`columns.*`radius`"),
]


@pytest.mark.parametrize(("name", "told"), WITHOUT_GRAINS)
def test_files_without_grains_are_told(name, told):
    refuses(FLOOR / name, told)


@pytest.mark.parametrize("ending", [".vtk", ".vtr"])
@pytest.mark.parametrize("name", ["grains_30000.vtk", "grains_30000.vtp", "grains_30000.vtu"])
def test_the_box_beside_a_vtk_file_is_its_cell(tmp_path, name, ending):
    for file in (name, f"grains_boundingBox_30000{ending}", "mesh_30000.vtk"):
        (tmp_path / file).write_bytes((FLOOR / file).read_bytes())
    with pytest.warns(scanfab.ScanfabNote, match="boundingBox"):
        (frame,) = scanfab.read_series(tmp_path)
    assert frame.read().cell.periodic == (False, False, False)
    packing = scanfab.read(tmp_path / name, periodic="xy")
    assert_true_grains(packing, FLOOR)
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), [0.014, 0.013, 0.04], rtol=1e-6)
    np.testing.assert_allclose(packing.cell.origin, [-0.005, 0, 0], atol=1e-9)
    assert packing.cell.periodic == (True, True, False)
