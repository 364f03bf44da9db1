"""VTK files of any origin: clouds with a radius, lines between centres, and what is refused."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.formats.liggghts import LiggghtsReader
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from tests.helpers.dumps import write
from tests.helpers.truth import FLOOR

POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0.25], [5.6, 0.5, 0]])
RADIUS = np.array([1.0, 1.0, 1.1, 0.9])
LINES = np.array([[0, 1], [1, 2], [2, 3]])


def polydata(path, binary=False, **arrays):
    cloud = pyvista.PolyData(POSITION)
    for name, values in arrays.items():
        cloud[name] = values
    cloud.save(path, binary=binary)
    return path


def grid(path, file_format=None, **arrays):
    cells = [("vertex", np.arange(len(POSITION))[:, None])]
    meshio.Mesh(POSITION, cells, point_data=arrays).write(path, file_format=file_format)
    return path


def vtk_grid(path, binary=False, **arrays):
    cloud = pyvista.PolyData(POSITION).cast_to_unstructured_grid()
    for name, values in arrays.items():
        cloud.point_data[name] = values
    cloud.save(path, binary=binary)
    return path


def lines_of_points(path, **arrays):
    flat = np.column_stack([np.full(len(LINES), 2), LINES]).ravel()
    mesh = pyvista.PolyData(POSITION, lines=flat)
    for name, values in arrays.items():
        mesh.cell_data[name] = values
    mesh.save(path, binary=False)
    return path


WRITERS = {
    "legacy ASCII POLYDATA": ("a.vtk", polydata, {}),
    "legacy BINARY POLYDATA": ("a.vtk", polydata, {"binary": True}),
    "legacy ASCII UNSTRUCTURED_GRID": ("a.vtk", vtk_grid, {}),
    "legacy BINARY UNSTRUCTURED_GRID": ("a.vtk", vtk_grid, {"binary": True}),
    "old legacy ASCII": ("a.vtk", grid, {"file_format": "vtk42"}),
    "new legacy BINARY": ("a.vtk", grid, {"file_format": "vtk51"}),
    "ASCII .vtp": ("a.vtp", polydata, {}),
    "binary .vtp": ("a.vtp", polydata, {"binary": True}),
    "ASCII .vtu": ("a.vtu", vtk_grid, {}),
    "binary .vtu": ("a.vtu", vtk_grid, {"binary": True}),
    "meshio's .vtu": ("a.vtu", grid, {}),
    "meshio's .xdmf": ("a.xdmf", grid, {}),
}


@pytest.mark.parametrize("form", WRITERS)
def test_every_form_holds_the_same_grains(tmp_path, form):
    name, writer, options = WRITERS[form]
    type = np.array([1, 2, 1, 2])
    packing = scanfab.read(writer(tmp_path / name, radius=RADIUS, type=type, **options))
    np.testing.assert_allclose(packing.position, POSITION, atol=1e-6)
    np.testing.assert_allclose(packing.radius, RADIUS, rtol=1e-7)
    np.testing.assert_array_equal(packing.columns["type"], type)


@pytest.mark.parametrize(
    "name", ["radius", "radii", "Radius", "RADIUS", "rad", "r", "diameter", "Diameter"]
)
@pytest.mark.parametrize("writer", [polydata, grid])
def test_a_radius_has_many_names(tmp_path, writer, name):
    values = 2 * RADIUS if "iameter" in name else RADIUS
    path = writer(tmp_path / "a.vtu" if writer is grid else tmp_path / "a.vtp", **{name: values})
    assert VtkReader().kind(path) == "grains"
    np.testing.assert_allclose(scanfab.read(path).radius, RADIUS)


def test_points_without_a_radius_are_points(tmp_path):
    path = polydata(tmp_path / "a.vtp", mass=RADIUS)
    assert VtkReader().kind(path) == "points"
    with pytest.raises(ReadError, match=r"no radius.*found mass.*`columns=.*`radius`"):
        scanfab.read(path)


def test_points_take_the_users_radius_or_column(tmp_path):
    path = polydata(tmp_path / "a.vtp", size=RADIUS)
    np.testing.assert_allclose(scanfab.read(path, columns={"radius": "size"}).radius, RADIUS)
    np.testing.assert_array_equal(scanfab.read(path, radius=0.5).radius, [0.5] * 4)


def test_ids_are_those_of_the_file(tmp_path):
    path = polydata(tmp_path / "a.vtp", radius=RADIUS, Id=np.array([7.0, 3, 9, 1000001]))
    np.testing.assert_array_equal(scanfab.read(path).id, [7, 3, 9, 1000001])


def test_arrays_of_vertex_cells_are_arrays_of_grains(tmp_path):
    cells = [("vertex", np.arange(4)[:, None])]
    mesh = meshio.Mesh(POSITION, cells, cell_data={"radius": [RADIUS]})
    mesh.write(tmp_path / "a.vtu")
    np.testing.assert_allclose(scanfab.read(tmp_path / "a.vtu").radius, RADIUS)


def test_vectors_stay_vectors(tmp_path):
    path = polydata(tmp_path / "a.vtp", radius=RADIUS, v=POSITION)
    assert scanfab.read(path).columns["v"].shape == (4, 3)


def test_flat_points_get_a_third_coordinate(tmp_path):
    cells = [("vertex", np.arange(4)[:, None])]
    mesh = meshio.Mesh(POSITION[:, :2], cells, point_data={"radius": RADIUS})
    mesh.write(tmp_path / "a.xdmf")
    np.testing.assert_array_equal(scanfab.read(tmp_path / "a.xdmf").position[:, 2], 0)


@pytest.mark.parametrize("ending", [".vtp", ".vtk"])
def test_lines_between_centres_are_contacts(tmp_path, ending):
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    contacts = lines_of_points(tmp_path / f"lines{ending}")
    packing = scanfab.read(spheres, contacts=contacts)
    np.testing.assert_array_equal(packing.contacts.pairs, LINES)
    assert packing.contacts.force is None


def test_line_cells_of_a_grid_are_contacts(tmp_path):
    spheres = grid(tmp_path / "spheres.vtu", radius=RADIUS)
    for name in ("lines.vtu", "lines.vtk", "lines.xdmf"):
        meshio.Mesh(POSITION, [("line", LINES)]).write(tmp_path / name)
        packing = scanfab.read(spheres, contacts=tmp_path / name)
        np.testing.assert_array_equal(packing.contacts.pairs, LINES)


def test_lines_with_ids_name_grains_by_id(tmp_path):
    ids = np.array([40, 10, 30, 20])
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS, id=ids)
    first, second = ids[LINES].T.astype(float)
    contacts = lines_of_points(tmp_path / "lines.vtp", id1=second, id2=first)
    packing = scanfab.read(spheres, contacts=contacts)
    np.testing.assert_array_equal(packing.contacts.pairs, LINES[:, ::-1])


@pytest.mark.parametrize("name", ["a.vtk", "a.vtp", "a.stl"])
def test_a_mesh_of_triangles_is_a_wall(tmp_path, name):
    pyvista.Plane().triangulate().save(tmp_path / name)
    with pytest.raises(ReadError, match=r"no grains|no reader knows"):
        scanfab.read(tmp_path / name)


def test_a_wall_with_an_array_called_radius_is_still_a_wall(tmp_path):
    plane = pyvista.Plane().triangulate()
    plane["radius"] = np.ones(plane.n_points)
    plane.save(tmp_path / "wall.vtp")
    assert VtkReader().kind(tmp_path / "wall.vtp") == "other"


def test_image_data_is_neither_grains_nor_contacts(tmp_path):
    pyvista.ImageData(dimensions=(3, 3, 3)).save(tmp_path / "a.vti")
    assert VtkReader().kind(tmp_path / "a.vti") == "other"


@pytest.mark.parametrize(
    "head",
    [
        "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n",
        "RECTILINEAR_GRID\nDIMENSIONS 2 2 2\nX_COORDINATES 2 double\n0 1\n"
        "Y_COORDINATES 2 double\n0 1\nZ_COORDINATES 2 double\n0 1\n",
    ],
)
def test_legacy_grids_are_neither_grains_nor_contacts(tmp_path, head):
    path = write(tmp_path / "a.vtk", f"# vtk DataFile Version 3.0\nbox\nASCII\nDATASET {head}")
    assert VtkReader().kind(path) == "other"


@pytest.mark.parametrize("name", ["all_30000.vtm", "liggghts_simulation.pvd"])
def test_an_index_of_other_files_beside_the_grains_is_passed_over(tmp_path, name):
    (tmp_path / name).write_bytes((FLOOR / "vtm" / name).read_bytes())
    polydata(tmp_path / "grains_30000.vtp", radius=RADIUS)
    with pytest.warns(scanfab.ScanfabNote, match="passed over"):
        (frame,) = scanfab.read_series(tmp_path)
    assert len(frame.read()) == 4


def test_an_empty_legacy_frame_has_no_grains(tmp_path, capfd):
    text = (
        "# vtk DataFile Version 3.0\nframe\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"
        "VERTICES 0 0\nPOINT_DATA 0\nSCALARS radius float 1\nLOOKUP_TABLE default\n"
    )
    path = write(tmp_path / "a.vtk", text)
    assert VtkReader().kind(path) == "grains"
    assert len(scanfab.read(path)) == 0
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", [".vtp", ".vtu"])
def test_an_empty_xml_frame_has_no_grains(tmp_path, ending, capfd):
    root, piece = (
        ("PolyData", 'NumberOfPoints="0" NumberOfVerts="0" NumberOfLines="0" NumberOfPolys="0"')
        if ending == ".vtp"
        else ("UnstructuredGrid", 'NumberOfPoints="0" NumberOfCells="0"')
    )
    text = (
        f'<VTKFile type="{root}" version="0.1" byte_order="LittleEndian"><{root}><Piece {piece}>'
        '<PointData><DataArray type="Float64" Name="radius" format="ascii"></DataArray></PointData>'
        '<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii"></DataArray>'
        "</Points>"
        '<Cells><DataArray type="Int32" Name="connectivity" format="ascii"></DataArray>'
        '<DataArray type="Int32" Name="offsets" format="ascii"></DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii"></DataArray></Cells>'
        f"</Piece></{root}></VTKFile>"
    )
    assert len(scanfab.read(write(tmp_path / f"a{ending}", text))) == 0
    assert capfd.readouterr() == ("", "")


def test_a_grid_of_points_without_cells_is_a_cloud(tmp_path, capfd):
    text = (
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">'
        '<UnstructuredGrid><Piece NumberOfPoints="2" NumberOfCells="0"><Points>'
        '<DataArray type="Float32" Name="Position" NumberOfComponents="3" format="ascii">'
        "0 0 0 1 0 0</DataArray></Points><PointData>"
        '<DataArray type="Float32" Name="Radius" format="ascii">0.5 0.5</DataArray></PointData>'
        '<Cells><DataArray type="Int32" Name="connectivity" format="ascii"></DataArray>'
        '<DataArray type="Int32" Name="offsets" format="ascii"></DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii"></DataArray></Cells>'
        "</Piece></UnstructuredGrid></VTKFile>"
    )
    packing = scanfab.read(write(tmp_path / "a.vtu", text))
    np.testing.assert_array_equal(packing.radius, [0.5, 0.5])
    assert capfd.readouterr() == ("", "")


def push():
    """Forces on the second grain that push it off the first."""
    return (POSITION[LINES[:, 1]] - POSITION[LINES[:, 0]]) * np.arange(1.0, len(LINES) + 1)[:, None]


@pytest.mark.parametrize(("sign", "grain"), [(1, "second"), (-1, "first")])
def test_forces_act_on_the_grain_that_they_push_off_the_other(tmp_path, sign, grain):
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    contacts = lines_of_points(tmp_path / "lines.vtp", force=sign * push())
    with pytest.warns(ScanfabNote, match=f"the forces act on the {grain} grain"):
        packing = scanfab.read(spheres, contacts=contacts)
    np.testing.assert_array_equal(packing.contacts.force, push())


@pytest.mark.parametrize("sign", [1, -1])
def test_so_they_do_where_one_file_holds_grains_and_contacts(tmp_path, sign):
    path = lines_of_points(tmp_path / "both.vtp", force=sign * push())
    mesh = pyvista.read(path)
    mesh.point_data["radius"] = RADIUS
    mesh.save(path)
    np.testing.assert_array_equal(scanfab.read(path).contacts.force, push())


def test_which_grain_a_force_acts_on_is_not_guessed(tmp_path):
    force = push()
    force[1] *= -1
    contacts = lines_of_points(tmp_path / "lines.vtp", force=force)
    grains = GrainTable(POSITION, RADIUS, None, {}, None)
    with pytest.warns(ScanfabWarning, match=r"lines\.vtp: the forces are left out: 67% of them"):
        joined = VtkReader().read_contacts(Snapshot(contacts), ReadOptions(), grains)
    assert joined.contacts.force is None


def test_other_arrays_of_forces_are_named(tmp_path):
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    arrays = {
        "normal_force": np.ones(len(LINES)),
        "ContactForce": push(),
        "kn": np.ones(len(LINES)),
    }
    contacts = lines_of_points(tmp_path / "lines.vtp", **arrays)
    with pytest.warns(ScanfabNote, match=r"left out of the contacts: \w+, \w+: a force is taken"):
        packing = scanfab.read(spheres, contacts=contacts)
    assert packing.contacts.force is None


def test_the_box_beside_a_dump_is_told(tmp_path):
    grains, box = tmp_path / "dump_100.vtk", tmp_path / "dump_boundingBox_100.vtk"
    reader = VtkReader()
    assert reader.beside(grains) == []
    box.write_text("")
    assert reader.beside(grains) == LiggghtsReader().beside(grains) == [box]
