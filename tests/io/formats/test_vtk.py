"""VTK files of any origin, and lists of them."""

import meshio
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.base.errors import ScanfabNote
from tests.helpers.dumps import holds, refuses, write
from tests.helpers.truth import FLOOR

POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0.25], [5.6, 0.5, 0]])
RADIUS = np.array([1.0, 1.0, 1.1, 0.9])
LINES = np.array([[0, 1], [1, 2], [2, 3]])
FLAT = np.insert(LINES, 0, 2, axis=1).ravel()
# forces on the second grain that push it off the first
PUSH = (POSITION[1:] - POSITION[:-1]) * np.arange(1.0, 4)[:, None]


def polydata(path, rows=(0, 1, 2, 3), cells=None, **arrays):
    path.parent.mkdir(exist_ok=True)
    mesh = pyvista.PolyData(POSITION[[*rows]], lines=None if cells is None else FLAT)
    mesh.point_data.update(arrays)
    mesh.cell_data.update(cells or {})
    (mesh if path.suffix == ".vtp" else mesh.cast_to_unstructured_grid()).save(path)
    return path


@pytest.mark.parametrize(("name", "axes"), [("a.xdmf", 2), ("a.vtu", 3)])
def test_what_meshio_writes_is_read(tmp_path, name, axes):
    """Flat points get a third coordinate; arrays of a vertex at each point are those of points."""
    arrays = {"point_data": {"radius": RADIUS}, "cell_data": {"number": [np.arange(4)]}}
    vertices = [("vertex", np.arange(4)[:, None])]
    meshio.Mesh(POSITION[:, :axes], vertices, **arrays).write(tmp_path / name)
    packing = scanfab.read(tmp_path / name)
    holds(packing, position=POSITION * [1, 1, axes == 3], number=range(4))


@pytest.mark.parametrize("vertices", [None, np.insert(np.arange(4)[:, None], 0, 1, axis=1).ravel()])
@pytest.mark.parametrize("ending", [".vtk", ".vtp", ".vtu"])
def test_one_file_may_hold_grains_and_contacts(tmp_path, ending, vertices):
    mesh, path = pyvista.PolyData(POSITION, lines=FLAT, verts=vertices), tmp_path / f"both{ending}"
    mesh["radius"] = RADIUS
    (mesh.cast_to_unstructured_grid() if ending == ".vtu" else mesh).save(path)
    holds(scanfab.read(path).contacts, source="file", pairs=LINES)
    assert scanfab.read(path, contacts="geometric").contacts is None


def test_lines_with_ids_name_grains_by_id(tmp_path):
    ids = np.array([40, 10, 30, 20])
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS, id=ids)
    first, second = ids[LINES].T.astype(float)
    contacts = polydata(tmp_path / "lines.vtp", cells={"id1": second, "id2": first})
    packing = scanfab.read(spheres, contacts=contacts)
    np.testing.assert_array_equal(packing.contacts.pairs, LINES[:, ::-1])


@pytest.mark.parametrize("name", ["all_30000.vtm", "liggghts_simulation.pvd"])
def test_an_index_of_other_files_beside_the_grains_is_left_out(tmp_path, name):
    (tmp_path / name).write_bytes((FLOOR / "vtm" / name).read_bytes())
    polydata(tmp_path / "grains_30000.vtp", radius=RADIUS)
    with pytest.warns(scanfab.ScanfabNote, match=name):
        (frame,) = scanfab.read_series(tmp_path)
    assert len(frame.read()) == 4


def test_a_grid_of_points_without_cells_is_a_cloud_and_may_be_empty(tmp_path, capfd):
    """As MercuryDPM writes it."""
    for count in (2, 0):
        grid = pyvista.UnstructuredGrid(np.zeros(0, int), np.uint8([]), POSITION[:count])
        grid["Radius"] = RADIUS[:count]
        grid.save(tmp_path / "a.vtu", binary=False)
        holds(scanfab.read(tmp_path / "a.vtu"), position=POSITION[:count], radius=RADIUS[:count])
    text = "# vtk DataFile Version 3.0\nframe\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"
    text += "POINT_DATA 0\nSCALARS Radius float 1\nLOOKUP_TABLE default\n"
    assert len(scanfab.read(write(tmp_path / "a.vtk", text))) == 0
    assert capfd.readouterr() == ("", "")


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


def test_arrays_of_other_names_are_left_out_and_told(tmp_path):
    spheres = polydata(tmp_path / "spheres.vtp", radius=RADIUS)
    arrays = {"normal_force": np.ones(3), "ContactForce": PUSH, "kn": np.ones(3)}
    contacts = polydata(tmp_path / "lines.vtp", cells=arrays)
    with pytest.warns(ScanfabNote, match=r"arrays that are not read: \w+, \w+: only a vector"):
        assert scanfab.read(spheres, contacts=contacts).contacts.force is None


def cloud(path, rows, **arrays):
    return polydata(path, rows, radius=np.ones(len(rows)), id=np.array(rows), **arrays)


def listing(path, kind, *entries):
    """A list of files, each by its name or with attributes."""
    tag, key = ("Piece", "Source") if kind.startswith("P") else ("DataSet", "file")
    pairs = [(one, "") if isinstance(one, str) else one for one in entries]
    rows = "".join(f'<{tag} {key}="{name}" {more}/>' for name, more in pairs)
    return write(path, f'<VTKFile type="{kind}"><{kind}>{rows}</{kind}></VTKFile>')


@pytest.mark.parametrize(("kind", "ending"), [("PPolyData", ".vtp"), ("PUnstructuredGrid", ".vtu")])
def test_pieces_make_one_frame_and_their_ghosts_count_once(tmp_path, kind, ending):
    cloud(tmp_path / f"parts/0{ending}", [0, 1, 2], vtkGhostType=np.uint8([0, 0, 1]))
    cloud(tmp_path / f"parts/1{ending}", [1, 2, 3], vtkGhostType=np.uint8([1, 0, 0]))
    names = [f"parts/{k}{ending}" for k in range(2)]
    packing = scanfab.read(listing(tmp_path / f"all.p{ending[1:]}", kind, *names))
    holds(packing, id=range(4), position=POSITION)


def test_a_piece_that_is_missing_or_damaged_is_named(tmp_path):
    cloud(tmp_path / "0.vtp", [0, 1])
    path = listing(tmp_path / "a.pvtp", "PPolyData", "0.vtp", "1.vtp")
    refuses(path, r"a\.pvtp: names '1\.vtp', but there is no such file")
    data = (tmp_path / "0.vtp").read_bytes()
    (tmp_path / "1.vtp").write_bytes(data[: len(data) // 2])
    refuses(path, r"1\.vtp: .*damaged or incomplete")


def test_the_files_of_a_frame_are_its_grains_and_contacts(tmp_path):
    cloud(tmp_path / "f/grains.vtu", [0, 1, 2, 3])
    lines = pyvista.PolyData(POSITION, lines=[2, 0, 1, 2, 1, 2])
    lines.save(tmp_path / "f/lines.vtp")
    pyvista.Plane().save(tmp_path / "f/wall.vtp")
    names = [f"f/{name}" for name in ("wall.vtp", "grains.vtu", "lines.vtp")]
    path = listing(tmp_path / "f_7.vtm", "vtkMultiBlockDataSet", *names)
    packing = scanfab.read(path)
    np.testing.assert_array_equal(packing.contacts.pairs, [[0, 1], [1, 2]])
    assert packing.step is None
    # a cell that the user names makes none of them less of an input
    series = scanfab.read_series(path, cell=(99.0, 99.0, 99.0))
    assert [*series.files()] == [path, *(tmp_path / name for name in names)]
    listing(path, "vtkMultiBlockDataSet", *names[1:2] * 2)
    refuses(path, r"expected one file of grains.* 2 of grains and 0 of con")


@pytest.mark.parametrize(
    "name", ["../secret.vtp", "/etc/passwd", "a/../../secret.vtp", "..\\\\secret.vtp", ".", "a\0b"]
)
@pytest.mark.parametrize("kind", ["PPolyData", "vtkMultiBlockDataSet", "Collection", "Xdmf"])
def test_files_elsewhere_are_not_read(tmp_path, name, kind):
    cloud(tmp_path / "secret.vtp", [0, 1])
    folder = tmp_path / "given"
    folder.mkdir()
    if kind == "Xdmf":
        text = f'<Xdmf><Domain><DataItem Format="HDF">{name}:/x</DataItem></Domain></Xdmf>'
        path = write(folder / "a.xdmf", text)
    else:
        path = listing(folder / "a.pvd", kind, (name, 'timestep="0"'))
    refuses(path, r"which is outside the folder of this file|not well-formed", radius=1.0)


def test_lists_of_lists_have_no_end_and_are_refused(tmp_path):
    refuses(listing(tmp_path / "a.pvtp", "PPolyData", "a.pvtp"), "lists pieces itself")
    path = listing(tmp_path / "a.vtm", "vtkMultiBlockDataSet", "a.vtm")
    refuses(path, "expected one file of grains")


def test_a_collection_is_a_series_with_times(tmp_path):
    for step in (100, 200):
        cloud(tmp_path / f"grains_{step}.vtp", [0, 1])
    pyvista.Box().save(tmp_path / "box_100.vtp")
    times = ("grains_100.vtp", 0.5), ("box_100.vtp", 0.5), ("grains_200.vtp", 1.5)
    entries = [(name, f'timestep="{time}"') for name, time in times]
    index = listing(tmp_path / "all.pvd", "Collection", *entries)
    frames = [frame.read() for frame in scanfab.read_series(index)]
    assert [(one.step, one.time, len(one)) for one in frames] == [(100, 0.5, 2), (200, 1.5, 2)]
    write(index, index.read_text()[:90])
    refuses(index, "cannot be read as a list of VTK files")


def test_files_of_a_list_that_are_no_series_are_an_error_that_names_them(tmp_path):
    for name in "ab":
        cloud(tmp_path / f"{name}.vtp", [0, 1])
    pyvista.PolyData(POSITION).save(tmp_path / "c.vtp")
    both = [(f"{name}.vtp", f'timestep="5" part="{k}"') for k, name in enumerate("ab")]
    wall = [("a.vtp", 'timestep="5"'), ("c.vtp", 'timestep="6"')]
    for entries, told in (
        (both, r"lists a\.vtp and b\.vtp for one time: name the files of one series"),
        (wall, r"lists points without a radius \(c\.vtp\) beside a\.vtp: take them out"),
    ):
        refuses(listing(tmp_path / "run.pvd", "Collection", *entries), told)


@pytest.mark.parametrize("more", ["", 'group="" part="0" timestep="7"'])
def test_a_list_of_one_file_is_a_frame(tmp_path, more):
    cloud(tmp_path / "a_3.vtp", [0, 1, 2])
    packing = scanfab.read(listing(tmp_path / "run.pvd", "Collection", ("a_3.vtp", more)))
    assert (len(packing), packing.step) == (3, 3)
    assert packing.time == (7.0 if "timestep" in more else None)
