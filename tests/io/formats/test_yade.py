"""YADE's files against its own truth: text, VTKExporter and VTKRecorder, periodic or not."""

from __future__ import annotations

import itertools
import shutil

import numpy as np
import pytest

import scanfab
from scanfab.io.reader import reader_for
from tests.helpers import truth
from tests.helpers.dumps import refuses, write, yade_lines, yade_spheres
from tests.helpers.truth import SIX_DIGITS, YADE, assert_same_vectors, centres, csv_rows

TRUE_BODIES = csv_rows(YADE / "truth_bodies.csv")
TRUE_CONTACTS = csv_rows(YADE / "truth_contacts.csv")
TRUE_WALLS = csv_rows(YADE / "truth_walls.csv")
PERIODIC_BODIES = csv_rows(YADE / "periodic_truth_bodies.csv")
PERIODIC_CONTACTS = csv_rows(YADE / "periodic_truth_contacts.csv")
CELL = (0.02863940766875124, 0.03212233831079451, 0.03546973927065077)

HEAP = ["noid-spheres-00000000.vtk.gz", "id-spheres-00000000.vtk.gz"]
HEAP += ["ascii_spheres.30000.vtu", "zlib_spheres.30000.vtu", "text.txt", "x_y_z_r.txt"]
HEAP += ["x_y_z_r_matId.txt", "id_x_y_z_r_matId.txt", "x_y_z_r_attrs.txt"]
WITH_IDS = [*HEAP[1:4], *HEAP[7:]]
EXPORTED = ["noid-intrs-00000000.vtk.gz", "id-intrs-00000000.vtk.gz"]
PERIODIC_INTRS, PERIODIC_SPHERES = (
    f"periodic-{what}-00000000.vtk.gz" for what in ("intrs", "spheres")
)
PACK = "periodic_pack.txt"
# positions of the pack are not wrapped into the cell, unlike the ends of the lines
IN_CELL = [PERIODIC_SPHERES, "periodic_id_x_y_z_r_matId.txt", "periodic_x_y_z_r.txt", PACK]
RECORDED = ["ascii_intrs.30000.vtp", "zlib_intrs.30000.vtp"]


@pytest.mark.parametrize("name", HEAP)
def test_every_form_gives_the_same_grains(name):
    packing = scanfab.read(YADE / name, contacts="geometric")
    np.testing.assert_allclose(packing.radius, TRUE_BODIES["r"], rtol=SIX_DIGITS)
    np.testing.assert_allclose(packing.position, centres(TRUE_BODIES), rtol=SIX_DIGITS)
    if name in WITH_IDS:
        np.testing.assert_array_equal(packing.id, TRUE_BODIES["id"])


@pytest.mark.parametrize("name", IN_CELL)
def test_the_periodic_grains_are_the_same_in_every_form(name):
    packing = scanfab.read(YADE / name, contacts="geometric", cell=None if name == PACK else CELL)
    np.testing.assert_allclose(packing.radius, PERIODIC_BODIES["r"], rtol=SIX_DIGITS)
    assert truth.off_by(packing, centres(PERIODIC_BODIES)).max() < SIX_DIGITS * 0.036
    # SpherePack.save names its cell
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), CELL, rtol=SIX_DIGITS)
    assert name != PACK or np.all(packing.columns["clumpId"] == -1)


JOINED = [
    *itertools.product(WITH_IDS, EXPORTED + RECORDED),
    (HEAP[0], EXPORTED[0]),
    *itertools.product(IN_CELL, [PERIODIC_INTRS]),
]


@pytest.mark.parametrize(("grains", "contacts"), JOINED)
def test_every_form_gives_the_same_contacts_by_ids_or_places_and_walls(grains, contacts):
    """Across the faces of the cell as well, where normals are true if the images are."""
    bodies, pairs, count, cell, walls = TRUE_BODIES, TRUE_CONTACTS, 271, None, 107
    if contacts == PERIODIC_INTRS:
        bodies, pairs, count, cell, walls = PERIODIC_BODIES, PERIODIC_CONTACTS, 261, CELL, 0
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts, cell=cell)
    assert len(packing.contacts) == len(pairs) == count
    ids = bodies["id"][packing.contacts.pairs]
    assert {tuple(sorted(pair)) for pair in ids.tolist()} == truth.true_pairs(pairs)
    if "r_matId" in grains or grains in (*WITH_IDS, PERIODIC_SPHERES):
        assert_same_vectors(
            truth.normals_by_pair(packing), truth.true_vectors(pairs, "n"), atol=1e-4
        )
    # the recorder leaves out contacts with facets and boxes
    expected = np.bincount(TRUE_WALLS["sphere"], minlength=200)[bodies["id"]]
    expected *= bool(walls and contacts in EXPORTED)
    assert expected.sum() in (0, walls)
    np.testing.assert_array_equal(packing.wall_contacts, expected)


def test_the_periodic_force_acts_on_the_second_body():
    contacts = YADE / PERIODIC_INTRS
    packing = scanfab.read(YADE / PERIODIC_SPHERES, contacts=contacts, cell=CELL)
    expected = truth.true_vectors(PERIODIC_CONTACTS, "f")
    assert_same_vectors(truth.forces_by_pair(packing), expected, atol=2e-4)
    assert np.all(np.sum(packing.contacts.force * packing.contacts.normal, axis=1) > 0)


def test_normal_and_shear_force_add_up_and_more_forces_than_lines_are_refused(tmp_path):
    position = [[0, 0, 0], [1.9, 0, 0]]
    spheres = yade_spheres(tmp_path / "a-spheres-0.vtk", position, [1, 1], id=[5, 6])
    both = {"normalForce": [[2, 0, 0]], "shearForce": [[0, 3, 0]]}
    lines = yade_lines(tmp_path / "a-intrs-0.vtk", [position], both, id1=[5], id2=[6])
    packing = scanfab.read(spheres, contacts=lines, format="yade")
    np.testing.assert_array_equal(packing.contacts.force, [[2, 3, 0]])
    yade_lines(lines, [position], {"force": [[2, 0, 0]] * 2})
    refuses(spheres, r"a-intrs-0\.vtk", error=scanfab.ScanfabError, contacts=lines)


def test_a_contact_through_a_face_without_a_cell_asks_for_it(tmp_path):
    # away from the file of the cell
    spheres = shutil.copy(YADE / PERIODIC_SPHERES, tmp_path)
    refuses(spheres, "name its cell", error=scanfab.PackingError, contacts=YADE / PERIODIC_INTRS)


@pytest.mark.parametrize("name", ["ascii_boxes.30000.vtu", "zlib_facets.30000.vtu"])
def test_boxes_and_facets_are_no_grains(name):
    assert reader_for(YADE / name).kind(YADE / name) == "other"


@pytest.mark.parametrize("format", ["yade", None])
@pytest.mark.parametrize("name", RECORDED)
def test_values_of_lost_contacts_are_refused_with_advice(tmp_path, name, format):
    """In a periodic cell VTKRecorder loses lines, but not their values."""
    text = (YADE / name).read_text()
    contacts = write(tmp_path / name, text.replace('NumberOfLines="271"', 'NumberOfLines="270"'))
    told = r"271 values for 270 contacts.*VTKExporter.*geometric"
    refuses(YADE / "id-spheres-00000000.vtk.gz", told, contacts=contacts, format=format)


def test_attributes_have_the_names_of_the_second_line_or_are_numbered(tmp_path):
    named = scanfab.read(YADE / "x_y_z_r_attrs.txt", contacts="geometric")
    assert sorted(named.columns) == ["mask", "vx", "vy", "vz"]
    path = write(tmp_path / "a.txt", "#format x_y_z_r_attrs\r\n1\t2\t3\t0.5\t7\t8\r\n")
    assert sorted(scanfab.read(path).columns) == ["attr1", "attr2"]
    write(path, "#format x_y_z_r_clumpId\n1\t2\t3\t0.5\t7\n")
    np.testing.assert_array_equal(scanfab.read(path).columns["clumpId"], [7])
    assert len(scanfab.read(write(path, "#format x_y_z_r\n"))) == 0
