"""YADE's files against its own truth: text, VTKExporter and VTKRecorder, periodic or not."""

from __future__ import annotations

import base64
import re
import shutil
import struct
import zlib

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io.registry import reader_for
from scanfab.packing.cell import Cell
from tests.helpers.dumps import write, yade_lines, yade_spheres
from tests.helpers.truth import (
    SIX_DIGITS,
    YADE,
    assert_same_vectors,
    csv_rows,
    forces_by_pair,
    id_pairs,
    normals_by_pair,
    off_by,
    true_pairs,
    vectors_by_pair,
)

TRUE_BODIES = csv_rows(YADE / "truth_bodies.csv")
TRUE_CONTACTS = csv_rows(YADE / "truth_contacts.csv")
TRUE_WALLS = csv_rows(YADE / "truth_walls.csv")
PERIODIC_BODIES = csv_rows(YADE / "periodic_truth_bodies.csv")
PERIODIC_CONTACTS = csv_rows(YADE / "periodic_truth_contacts.csv")
CELL = tuple(
    float(edge) for edge in (0.02863940766875124, 0.03212233831079451, 0.03546973927065077)
)

HEAP = [
    "noid-spheres-00000000.vtk.gz",
    "id-spheres-00000000.vtk.gz",
    "ascii_spheres.30000.vtu",
    "zlib_spheres.30000.vtu",
    "text.txt",
    "x_y_z_r.txt",
    "x_y_z_r_matId.txt",
    "id_x_y_z_r_matId.txt",
    "x_y_z_r_attrs.txt",
]
WITH_IDS = [
    "id-spheres-00000000.vtk.gz",
    "ascii_spheres.30000.vtu",
    "zlib_spheres.30000.vtu",
    "id_x_y_z_r_matId.txt",
    "x_y_z_r_attrs.txt",
]
EXPORTED = ["noid-intrs-00000000.vtk.gz", "id-intrs-00000000.vtk.gz"]
RECORDED = ["ascii_intrs.30000.vtp", "zlib_intrs.30000.vtp"]


def true_vectors(truth, prefix, names="xyz"):
    vectors = np.column_stack([truth[f"{prefix}{axis}"] for axis in names])
    return vectors_by_pair(truth["id1"], truth["id2"], vectors)


def centres(truth):
    return np.column_stack([truth["x"], truth["y"], truth["z"]])


@pytest.mark.parametrize("name", HEAP)
def test_every_form_gives_the_same_grains(name):
    packing = scanfab.read(YADE / name)
    np.testing.assert_allclose(packing.radius, TRUE_BODIES["r"], rtol=SIX_DIGITS)
    np.testing.assert_allclose(packing.position, centres(TRUE_BODIES), rtol=SIX_DIGITS)


@pytest.mark.parametrize("name", WITH_IDS)
def test_ids_are_yades(name):
    np.testing.assert_array_equal(scanfab.read(YADE / name).id, TRUE_BODIES["id"])


@pytest.mark.parametrize(
    "name",
    ["periodic-spheres-00000000.vtk.gz", "periodic_x_y_z_r.txt", "periodic_id_x_y_z_r_matId.txt"],
)
def test_the_periodic_grains_are_the_same_in_every_form(name):
    packing = scanfab.read(YADE / name, cell=CELL)
    np.testing.assert_allclose(packing.radius, PERIODIC_BODIES["r"], rtol=SIX_DIGITS)
    assert off_by(packing, centres(PERIODIC_BODIES)).max() < SIX_DIGITS * 0.036


def test_a_saved_sphere_pack_names_its_cell():
    packing = scanfab.read(YADE / "periodic_pack.txt")
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_allclose(np.diagonal(packing.cell.vectors), CELL, rtol=SIX_DIGITS)
    assert off_by(packing, centres(PERIODIC_BODIES)).max() < SIX_DIGITS * 0.036
    np.testing.assert_array_equal(packing.columns["clumpId"], -1)


@pytest.mark.parametrize("contacts", EXPORTED + RECORDED)
@pytest.mark.parametrize("grains", WITH_IDS)
def test_every_contact_form_gives_the_same_contacts(grains, contacts):
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts)
    assert len(packing.contacts) == len(TRUE_CONTACTS) == 271
    assert id_pairs(packing) == true_pairs(TRUE_CONTACTS)
    assert_same_vectors(normals_by_pair(packing), true_vectors(TRUE_CONTACTS, "n"), atol=1e-4)


def test_contacts_are_joined_by_place_where_there_are_no_ids():
    packing = scanfab.read(
        YADE / "noid-spheres-00000000.vtk.gz", contacts=YADE / "noid-intrs-00000000.vtk.gz"
    )
    ids = TRUE_BODIES["id"][packing.contacts.pairs]
    assert {tuple(sorted(pair)) for pair in ids.tolist()} == true_pairs(TRUE_CONTACTS)


@pytest.mark.parametrize("contacts", EXPORTED)
def test_contacts_with_facets_and_boxes_are_counted(contacts):
    packing = scanfab.read(YADE / "id-spheres-00000000.vtk.gz", contacts=YADE / contacts)
    expected = np.bincount(TRUE_WALLS["sphere"], minlength=200)[packing.id]
    assert expected.sum() == 107
    np.testing.assert_array_equal(packing.wall_contacts, expected)


@pytest.mark.parametrize("contacts", RECORDED)
def test_the_recorder_lists_no_walls(contacts):
    packing = scanfab.read(YADE / "ascii_spheres.30000.vtu", contacts=YADE / contacts)
    assert packing.wall_contacts.sum() == 0


# (a) by the name of the reader, (b) as users call it


@pytest.mark.parametrize("format", ["yade", None])
def test_the_force_acts_on_the_second_body(tmp_path, format):
    position, pairs = (
        centres(TRUE_BODIES),
        np.column_stack([TRUE_CONTACTS["id1"], TRUE_CONTACTS["id2"]]),
    )
    rows = np.searchsorted(TRUE_BODIES["id"], pairs)
    force = np.column_stack([TRUE_CONTACTS[f"f{axis}"] for axis in "xyz"])
    spheres = yade_spheres(
        tmp_path / "a-spheres-0.vtk", position, TRUE_BODIES["r"], id=TRUE_BODIES["id"]
    )
    lines = yade_lines(
        tmp_path / "a-intrs-0.vtk",
        position[rows],
        {"force": force},
        id1=TRUE_CONTACTS["id1"],
        id2=TRUE_CONTACTS["id2"],
    )
    packing = scanfab.read(spheres, contacts=lines, format=format)
    assert packing.contacts.force is not None
    assert_same_vectors(forces_by_pair(packing), true_vectors(TRUE_CONTACTS, "f"), atol=1e-12)


@pytest.mark.parametrize("format", ["yade", None])
def test_the_periodic_force_acts_on_the_second_body(format):
    packing = scanfab.read(
        YADE / "periodic-spheres-00000000.vtk.gz",
        contacts=YADE / "periodic-intrs-00000000.vtk.gz",
        cell=CELL,
        format=format,
    )
    assert packing.contacts.force is not None
    expected = true_vectors(PERIODIC_CONTACTS, "f")
    assert_same_vectors(forces_by_pair(packing), expected, atol=2e-4)
    push = np.sum(packing.contacts.force * packing.contacts.normal, axis=1)
    assert np.all(push > 0)


def test_normal_and_shear_force_add_up(tmp_path):
    position = [[0, 0, 0], [1.9, 0, 0]]
    spheres = yade_spheres(tmp_path / "a-spheres-0.vtk", position, [1, 1], id=[5, 6])
    both = {"normalForce": [[2, 0, 0]], "shearForce": [[0, 3, 0]]}
    lines = yade_lines(tmp_path / "a-intrs-0.vtk", [position], both, id1=[5], id2=[6])
    packing = scanfab.read(spheres, contacts=lines, format="yade")
    np.testing.assert_array_equal(packing.contacts.force, [[2, 3, 0]])


def test_a_normal_force_alone_is_not_taken_for_the_whole():
    packing = scanfab.read(
        YADE / "id-spheres-00000000.vtk.gz",
        contacts=YADE / "id-intrs-00000000.vtk.gz",
        format="yade",
    )
    assert packing.contacts.force is None


@pytest.mark.parametrize(
    "grains", ["periodic-spheres-00000000.vtk.gz", "periodic_id_x_y_z_r_matId.txt"]
)
def test_periodic_contacts_have_the_true_images(grains):
    packing = scanfab.read(
        YADE / grains, contacts=YADE / "periodic-intrs-00000000.vtk.gz", cell=CELL
    )
    assert len(packing.contacts) == len(PERIODIC_CONTACTS) == 261
    assert id_pairs(packing) == true_pairs(PERIODIC_CONTACTS)
    assert_same_vectors(normals_by_pair(packing), true_vectors(PERIODIC_CONTACTS, "n"), atol=1e-4)


@pytest.mark.parametrize("grains", ["periodic_pack.txt", "periodic_x_y_z_r.txt"])
def test_periodic_ends_that_are_not_wrapped_find_their_grains(grains):
    packing = scanfab.read(
        YADE / grains, contacts=YADE / "periodic-intrs-00000000.vtk.gz", cell=CELL
    )
    ids = PERIODIC_BODIES["id"][packing.contacts.pairs]
    assert {tuple(sorted(pair)) for pair in ids.tolist()} == true_pairs(PERIODIC_CONTACTS)
    assert packing.wall_contacts.sum() == 0


def test_geometry_finds_yades_contacts():
    packing = scanfab.Packing(
        centres(PERIODIC_BODIES), PERIODIC_BODIES["r"], id=PERIODIC_BODIES["id"], cell=Cell(CELL)
    )
    assert id_pairs(scanfab.find_contacts(packing)) == true_pairs(PERIODIC_CONTACTS)


def test_a_contact_through_a_face_without_a_cell_asks_for_it(tmp_path):
    # away from the file of the cell
    spheres = shutil.copy(YADE / "periodic-spheres-00000000.vtk.gz", tmp_path)
    with pytest.raises(scanfab.PackingError, match="name its cell"):
        scanfab.read(spheres, contacts=YADE / "periodic-intrs-00000000.vtk.gz")


def test_lines_to_images_without_a_cell_are_not_taken_for_walls(tmp_path):
    # three grains in a row that touch through a face; without ids only their places tell them
    position = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0]])
    ends = [position[[0, 1]], position[[1, 2]], [position[2], [5.7, 0, 0]]]
    spheres = yade_spheres(tmp_path / "a-spheres-0.vtk", position, [1, 1, 1])
    lines = yade_lines(tmp_path / "a-intrs-0.vtk", ends)
    with pytest.raises((ReadError, scanfab.PackingError, scanfab.ScanfabWarning), match="cell"):
        scanfab.read(spheres, contacts=lines)


@pytest.mark.parametrize(
    "name",
    [
        "ascii_boxes.30000.vtu",
        "ascii_facets.30000.vtu",
        "zlib_boxes.30000.vtu",
        "zlib_facets.30000.vtu",
    ],
)
def test_boxes_and_facets_are_neither_grains_nor_contacts(name):
    assert reader_for(YADE / name).kind(YADE / name) == "other"


@pytest.mark.parametrize(
    "name",
    [
        "id-spheres-00000000.vtk.gz",
        "id-intrs-00000000.vtk.gz",
        "ascii_intrs.30000.vtp",
        "zlib_intrs.30000.vtp",
        "text.txt",
        "periodic_pack.txt",
    ],
)
def test_yades_own_files_are_yades(name):
    assert reader_for(YADE / name).name == "yade"


# the periodic defect of VTKRecorder


def with_lost_lines(text):
    """An ASCII interaction file as VTKRecorder writes it in a periodic cell: values too many."""
    return re.sub(
        r'(<DataArray type="Float64" Name="forceN".*?>\n)(.*?)(\n\s*<(?:/DataArray|Information))',
        lambda match: f"{match[1]}{match[2]} 0.001 0.002 0.003{match[3]}",
        text,
        count=1,
        flags=re.DOTALL,
    )


def as_zlib(lines, values):
    """An appended, compressed interaction file with the given numbers of lines and values."""

    def block(array):
        raw = array.tobytes()
        packed = zlib.compress(raw)
        head = struct.pack("<4I", 1, len(raw), 0, len(packed))
        return base64.b64encode(head).decode() + base64.b64encode(packed).decode()

    arrays = [
        np.linspace(0.1, 1, values),
        np.array([[0, 0, 0], [1.9, 0, 0]], dtype="<f8"),
        np.tile([0, 1], lines).astype("<i8"),
        (2 * np.arange(1, lines + 1)).astype("<i8"),
    ]
    blocks = [block(array) for array in arrays]
    offsets = np.concatenate([[0], np.cumsum([len(text) for text in blocks])])
    return (
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian" '
        'header_type="UInt32" compressor="vtkZLibDataCompressor">\n<PolyData>\n'
        f'<Piece NumberOfPoints="2" NumberOfVerts="0" NumberOfLines="{lines}" NumberOfStrips="0" '
        'NumberOfPolys="0">\n<CellData>\n<DataArray type="Float64" Name="forceN" format="appended" '
        f'offset="{offsets[0]}"/>\n</CellData>\n<Points>\n<DataArray type="Float64" Name="Points" '
        f'NumberOfComponents="3" format="appended" offset="{offsets[1]}"/>\n</Points>\n<Lines>\n'
        f'<DataArray type="Int64" Name="connectivity" format="appended" offset="{offsets[2]}"/>\n'
        f'<DataArray type="Int64" Name="offsets" format="appended" offset="{offsets[3]}"/>\n'
        "</Lines>\n</Piece>\n</PolyData>\n"
        f'<AppendedData encoding="base64">\n_{"".join(blocks)}\n</AppendedData>\n</VTKFile>\n'
    )


@pytest.mark.parametrize("format", ["yade", None])
def test_values_of_lost_contacts_are_refused_with_advice(tmp_path, format):
    text = (YADE / "ascii_intrs.30000.vtp").read_text()
    contacts = write(tmp_path / "a_intrs.1.vtp", with_lost_lines(text))
    with pytest.raises(ReadError, match=r"274 values for 271 contacts.*VTKExporter.*geometric"):
        scanfab.read(YADE / "id-spheres-00000000.vtk.gz", contacts=contacts, format=format)


@pytest.mark.parametrize("format", ["yade", None])
@pytest.mark.parametrize(("values", "lines"), [(3, 1), (842, 374), (40000, 20000)])
def test_packed_values_of_lost_contacts_are_refused_too(tmp_path, format, values, lines):
    spheres = yade_spheres(tmp_path / "a.vtk", [[0, 0, 0], [1.9, 0, 0]], [1, 1])
    contacts = write(tmp_path / "a_intrs.1.vtp", as_zlib(lines, values))
    with pytest.raises(ReadError, match=f"{values} values for {lines} contacts"):
        scanfab.read(spheres, contacts=contacts, format=format)


def test_as_many_values_as_contacts_are_right(tmp_path):
    spheres = yade_spheres(tmp_path / "a.vtk", [[0, 0, 0], [1.9, 0, 0]], [1, 1])
    contacts = write(tmp_path / "a_intrs.1.vtp", as_zlib(1, 1))
    packing = scanfab.read(spheres, contacts=contacts, format="yade")
    np.testing.assert_array_equal(packing.contacts.pairs, [[0, 1]])


# text


def test_other_line_ends_do_not_matter(tmp_path):
    path = write(tmp_path / "a.txt", "#format x_y_z_r\r\n1\t2\t3\t0.5\r\n2\t2\t3\t0.5\r\n")
    np.testing.assert_array_equal(scanfab.read(path).position, [[1, 2, 3], [2, 2, 3]])


def test_clump_ids_are_a_column(tmp_path):
    path = write(tmp_path / "a.txt", "#format x_y_z_r_clumpId\n1\t2\t3\t0.5\t7\n")
    np.testing.assert_array_equal(scanfab.read(path).columns["clumpId"], [7])


def test_attributes_without_names_are_numbered(tmp_path):
    path = write(tmp_path / "a.txt", "#format x_y_z_r_attrs\n1\t2\t3\t0.5\t7\t8\n")
    assert sorted(scanfab.read(path).columns) == ["attr1", "attr2"]


def test_attributes_have_the_names_of_the_second_line():
    packing = scanfab.read(YADE / "x_y_z_r_attrs.txt")
    assert sorted(packing.columns) == ["mask", "vx", "vy", "vz"]


def test_a_text_without_grains_is_an_empty_frame(tmp_path, recwarn):
    assert len(scanfab.read(write(tmp_path / "a.txt", "#format x_y_z_r\n"))) == 0
    assert not recwarn.list


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("#format x_y_z_r\n1 2 3\n", "first line names 4 columns, the rows have 3"),
        ("#format x_y_z_r\n1 2 3 oops\n", "a.txt, line 2: .*oops"),
        ("#format x_y_z_r\n1 2 3 1\n1 2 3\n", "a.txt, line 3: expected 4 columns"),
        ("#format x_y_z_r\n# a comment\n0 0 0 1\n3 x 0 1\n", "a.txt, line 4: .*'x'"),
        ("##PERIODIC:: 1 2\n1 2 3 1\n", "line 1: expected three lengths"),
        ("##PERIODIC:: 1 2 long\n1 2 3 1\n", "line 1: expected three lengths"),
        ("##PERIODIC:: 1 2 0\n1 2 3 1\n", "a.txt"),
    ],
)
def test_a_text_that_cannot_be_read_says_why(tmp_path, text, message):
    with pytest.raises(ReadError, match=message):
        scanfab.read(write(tmp_path / "a.txt", text))


def test_a_text_holds_no_contacts():
    with pytest.raises(ReadError, match="expected contacts, found grains"):
        scanfab.read(YADE / "text.txt", contacts=YADE / "x_y_z_r.txt")
