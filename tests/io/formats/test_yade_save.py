"""YADE's O.save: spheres, real contacts with their images, walls, the cell; and bad input."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io.reader import reader_for
from tests.helpers.dumps import small_save, write
from tests.helpers.truth import (
    YADE,
    assert_same_vectors,
    centres,
    csv_rows,
    forces_by_pair,
    id_pairs,
    normals_by_pair,
    true_pairs,
    true_vectors,
)

PERIODIC, BOX = YADE / "periodic.xml.bz2", YADE / "formats.xml.bz2"


def truth(path, what):
    return csv_rows(YADE / f"{'periodic_' if path == PERIODIC else ''}truth_{what}.csv")


@pytest.mark.parametrize("path", [PERIODIC, BOX])
def test_spheres_and_real_contacts_are_those_that_yade_holds(path):
    packing, bodies, contacts = scanfab.read(path), truth(path, "bodies"), truth(path, "contacts")
    np.testing.assert_array_equal(packing.id, bodies["id"])
    np.testing.assert_array_equal(packing.radius, bodies["r"])
    cell, expected = packing.cell, centres(bodies)
    expected = expected if cell is None else cell.wrap(expected)
    np.testing.assert_array_equal(packing.position, expected)
    assert packing.contacts.source == "file"
    assert len(packing.contacts) == len(contacts)
    assert id_pairs(packing) == true_pairs(contacts)
    assert_same_vectors(normals_by_pair(packing), true_vectors(contacts, "n"), atol=1e-12)
    assert_same_vectors(forces_by_pair(packing), true_vectors(contacts, "f"), atol=1e-12)


def test_cell_walls_step_time_and_mask():
    cell, packing, walls = scanfab.read(PERIODIC).cell, scanfab.read(BOX), truth(BOX, "walls")
    np.testing.assert_array_equal(cell.vectors, centres(truth(PERIODIC, "cell")))
    assert cell.periodic == (True, True, True)
    assert packing.cell is None
    expected = [np.count_nonzero(walls["sphere"] == id) for id in packing.id]
    np.testing.assert_array_equal(packing.wall_contacts, expected)
    assert (packing.step, packing.time) == (30000, pytest.approx(1.58959062636740689))
    assert set(packing.columns["mask"].tolist()) <= {1, 5}
    assert scanfab.read(BOX, contacts="geometric").wall_contacts.sum() == 0


def test_the_small_save_in_a_tilted_cell(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.xml", small_save()))
    np.testing.assert_array_equal(packing.cell.vectors, [[1, 0, 0], [0.25, 2, 0], [0, 0, 3]])
    assert (packing.step, packing.time) == (30, 1.5e-3)
    np.testing.assert_array_equal(packing.columns["mask"], [1, 2, 3])
    assert packing.contacts.pairs.tolist() == [[0, 1], [2, 0]]
    assert packing.contacts.image.tolist() == [[0, 0, 0], [1, 0, 0]]
    np.testing.assert_allclose(packing.contacts.normal, [[1, 0, 0]] * 2, atol=1e-15)
    np.testing.assert_array_equal(packing.contacts.force, [[2, 3, 0]] * 2)
    np.testing.assert_array_equal(packing.wall_contacts, [0, 1, 0])

    # a contact that may become real is none
    contacts = ((0, 1, (0, 0, 0), 5), (2, 0, (1, 0, 0), -1))
    packing = scanfab.read(write(tmp_path / "a.xml", small_save(contacts)))
    assert packing.contacts.pairs.tolist() == [[0, 1]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</scene>", "</scen>", "cannot be read as a simulation that YADE saved"),
        (small_save()[900:], "", "cannot be read as a simulation that YADE saved"),
        ("<radius>0.1</radius>", "", "<px> has no <radius>"),
        ("<radius>0.1</radius>", "<radius>nan</radius>", "must be finite"),
        ("<id>1</id>", "<id>1.5</id>", "ids must be whole numbers"),
        ("<id>3</id>", "<id>0</id>", "names the body 3, which is not there"),
        ("<m00>1.0</m00>", "<m00>0.0</m00>", "span no volume"),
    ],
)
def test_what_is_wrong_with_a_save(tmp_path, old, new, message):
    text = small_save()
    assert old in text
    path = write(tmp_path / "a.xml", text.replace(old, new, 1))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read(path)


def test_entities_that_grow_are_an_error(tmp_path):
    bomb = "<!DOCTYPE boost_serialization [<!ENTITY a0 'aaaaaaaaaa'>" + "".join(
        f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>" for n in range(1, 12)
    )
    text = small_save().replace("<!DOCTYPE boost_serialization", bomb + "]", 1)
    path = write(tmp_path / "a.xml", text.replace("<iter>30<", "<iter>&a11;<"))
    with pytest.raises(ReadError, match="cannot be read as a simulation"):
        scanfab.read(path)


def test_the_binary_format_is_refused_with_advice(tmp_path):
    path = tmp_path / "a.yade"
    path.write_bytes(b"\x16\x00\x00\x00\x00\x00\x00\x00serialization::archive\x12\x00\x04")
    assert reader_for(path).name == "yade"
    with pytest.raises(ReadError, match=r"save it as XML: O.save\('name.xml.bz2'\)"):
        scanfab.read(path)


def test_contact_fabric_is_what_yade_computes_itself():
    """utils.fabricTensor() of YADE 2023.02a, after O.load of the same file."""
    packing = scanfab.read(PERIODIC)
    yades = [
        [0.3447425639495811933, 0.01556076543761630675, 0.01238750215078152084],
        [0.01556076543761630675, 0.3262522875107742859, -0.009056572267288032566],
        [0.01238750215078152084, -0.009056572267288032566, 0.3290051485396444098],
    ]
    # YADE takes the normals of the last step, scanfab the saved positions
    assert scanfab.contact_fabric(packing.contacts.normal).matrix == pytest.approx(
        np.array(yades), abs=5e-7
    )
