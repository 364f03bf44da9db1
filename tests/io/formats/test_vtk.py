"""VTK files of any origin: clouds with a radius, lines between centres, and what is refused."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from tests.helpers.dumps import write
from tests.helpers.truth import FLOOR

POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0.25], [5.6, 0.5, 0]])
RADIUS = np.array([1.0, 1.0, 1.1, 0.9])
LINES = np.array([[0, 1], [1, 2], [2, 3]])
# forces on the second grain that push it off the first
PUSH = (POSITION[1:] - POSITION[:-1]) * np.arange(1.0, 4)[:, None]


def polydata(path, binary=False, cells=None, **arrays):
    flat = np.column_stack([np.full(len(LINES), 2), LINES]).ravel()
    cloud = pyvista.PolyData(POSITION) if cells is None else pyvista.PolyData(POSITION, lines=flat)
    for name, values in arrays.items():
        cloud.point_data[name] = values
    for name, values in (cells or {}).items():
        cloud.cell_data[name] = values
    cloud.save(path, binary=binary)
    return path


def test_flat_points_get_a_third_coordinate(tmp_path):
    cells = [("vertex", np.arange(4)[:, None])]
    mesh = meshio.Mesh(POSITION[:, :2], cells, point_data={"radius": RADIUS})
    mesh.write(tmp_path / "a.xdmf")
    np.testing.assert_array_equal(scanfab.read(tmp_path / "a.xdmf").position[:, 2], 0)


def test_lines_with_ids_name_grains_by_id(tmp_path):
    ids = np.array([40, 10, 30, 20])
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS, id=ids)
    first, second = ids[LINES].T.astype(float)
    contacts = polydata(tmp_path / "lines.vtp", cells={"id1": second, "id2": first})
    packing = scanfab.read(spheres, contacts=contacts)
    np.testing.assert_array_equal(packing.contacts.pairs, LINES[:, ::-1])


@pytest.mark.parametrize("name", ["a.vtk", "a.vtp", "a.stl", "a.vti", "grid.vtk"])
def test_walls_boxes_and_images_hold_no_grains(tmp_path, name):
    others = {"a.vti": pyvista.ImageData(dimensions=[3] * 3), "grid.vtk": pyvista.RectilinearGrid()}
    mesh = others.get(name, pyvista.Plane().triangulate())
    mesh["radius"] = np.ones(mesh.n_points)
    mesh.save(tmp_path / name)
    with pytest.raises(ReadError, match=r"no grains|no reader knows"):
        scanfab.read(tmp_path / name)


@pytest.mark.parametrize("name", ["all_30000.vtm", "liggghts_simulation.pvd"])
def test_an_index_of_other_files_beside_the_grains_is_left_out(tmp_path, name):
    (tmp_path / name).write_bytes((FLOOR / "vtm" / name).read_bytes())
    polydata(tmp_path / "grains_30000.vtp", radius=RADIUS)
    with pytest.warns(scanfab.ScanfabNote, match=name):
        (frame,) = scanfab.read_series(tmp_path)
    assert len(frame.read()) == 4


def grid_without_cells(path, count, points="", radius=""):
    """XML as MercuryDPM writes it: a grid of points without cells, or without anything."""
    array = '<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="ascii">{}</DataArray>'
    names = {"connectivity": "Int32", "offsets": "Int32", "types": "UInt8"}
    cells = "".join(array.format(type, name, 1, "") for name, type in names.items())
    return write(
        path,
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">'
        f'<UnstructuredGrid><Piece NumberOfPoints="{count}" NumberOfCells="0">'
        f"<PointData>{array.format('Float32', 'Radius', 1, radius)}</PointData>"
        f"<Points>{array.format('Float32', 'Position', 3, points)}</Points><Cells>{cells}</Cells>"
        "</Piece></UnstructuredGrid></VTKFile>",
    )


def test_a_grid_of_points_without_cells_is_a_cloud_and_may_be_empty(tmp_path, capfd):
    path = grid_without_cells(tmp_path / "a.vtu", 2, "0 0 0 1 0 0", "0.5 0.5")
    np.testing.assert_array_equal(scanfab.read(path).radius, [0.5, 0.5])
    assert len(scanfab.read(grid_without_cells(path, 0))) == 0
    text = "# vtk DataFile Version 3.0\nframe\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"
    text += "POINT_DATA 0\nSCALARS Radius float 1\nLOOKUP_TABLE default\n"
    assert len(scanfab.read(write(tmp_path / "a.vtk", text))) == 0
    assert capfd.readouterr() == ("", "")


def test_arrays_of_a_vertex_at_each_point_are_those_of_the_points(tmp_path):
    cells, more = [("vertex", np.arange(4)[:, None])], {"coordNumber": [np.arange(4)]}
    mesh = meshio.Mesh(POSITION, cells, point_data={"radius": RADIUS}, cell_data=more)
    mesh.write(tmp_path / "a.vtu")
    packing = scanfab.read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(packing.columns["coordNumber"], range(4))


@pytest.mark.parametrize(("sign", "grain"), [(1, "second"), (-1, "first")])
@pytest.mark.parametrize("files", [1, 2])
def test_forces_act_on_the_grain_that_they_push_off_the_other(tmp_path, sign, grain, files):
    grains = polydata(tmp_path / "both.vtp", cells={"force": sign * PUSH}, radius=RADIUS)
    if files == 2:
        contacts = polydata(tmp_path / "lines.vtp", cells={"force": sign * PUSH})
        grains = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    with pytest.warns(ScanfabNote, match=f"the forces act on the {grain} grain"):
        packing = scanfab.read(grains, contacts="file" if files == 1 else contacts)
    np.testing.assert_array_equal(packing.contacts.force, PUSH)


def test_forces_whose_grain_is_in_doubt_and_arrays_of_other_names_are_left_out(tmp_path):
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    force = PUSH * [[1], [-1], [1]]
    contacts = polydata(tmp_path / "lines.vtp", cells={"force": force})
    with pytest.warns(ScanfabWarning, match=r"lines\.vtp: the forces are left out: 67% of them"):
        assert scanfab.read(spheres, contacts=contacts).contacts.force is None
    polydata(contacts, cells={"normal_force": np.ones(3), "ContactForce": PUSH, "kn": np.ones(3)})
    with pytest.warns(ScanfabNote, match=r"left out of the contacts: \w+, \w+: only a vector"):
        assert scanfab.read(spheres, contacts=contacts).contacts.force is None
