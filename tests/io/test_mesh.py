"""VTK files and surfaces: all that is written is read, and what is damaged is refused."""

import base64
import itertools

import meshio
import numpy as np
import pytest
import pyvista
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

from scanfab import ScanfabError, polyhedron
from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.files import plain
from scanfab.io.mesh import read_mesh
from scanfab.io.surface import SUFFIXES, read_surface
from tests.helpers.dumps import holds, vtk_array, vtk_xml, write, yade_spheres
from tests.helpers.fuzzing import only_scanfabs_warnings
from tests.helpers.truth import FLOOR, YADE
from tests.helpers.windows import OF_A_BOX, corners_of_a_box

POINTS = "POINTS 2 double\n0 0 0 2 0 0\n"


def legacy(path, body, dataset="POLYDATA", version="3.0"):
    return write(path, f"# vtk DataFile Version {version}\n\nASCII\nDATASET {dataset}\n{body}")


def refuses(path, match="damaged or incomplete|its library crashed"):
    """ReadError with the name of the file, and no warning of a library."""
    with only_scanfabs_warnings(), pytest.raises(ReadError, match=rf"{path.name}: .*({match})"):
        read_mesh(path)


@pytest.fixture
def lines():
    """Points, vertices and lines with arrays of all kinds, and one with a NaN."""
    points = np.random.default_rng(1).integers(0, 999, (512, 3)) / 8
    ends = np.column_stack([np.full(511, 2), np.arange(511), np.arange(1, 512)])
    verts = np.column_stack([np.ones(512, int), np.arange(512)])
    mesh = pyvista.PolyData(points, verts=verts.ravel(), lines=ends.ravel())
    mesh["radius"], mesh["id"] = np.ones(512), np.arange(512) + 2**40
    mesh["velocity"] = points.astype(np.float32)
    mesh["velocity"][3] = np.nan
    mesh.cell_data["kn"] = np.arange(1023.0)
    return mesh


def same(path, mesh):
    found = read_mesh(path)
    holds(found, points=mesh.points, lines=np.arange(511)[:, None] + [0, 1], has_faces=False)
    for name in ("radius", "id", "velocity"):
        np.testing.assert_array_equal(found.point_arrays[name], mesh[name], strict=True)
    np.testing.assert_array_equal(found.line_arrays["kn"], np.arange(512.0, 1023))


def put(writer, data, path, **settings):
    """What a writer of VTK writes with these settings."""
    writer.SetInputData(data)
    writer.SetFileName(str(path))
    for name, value in settings.items():
        getattr(writer, f"Set{name}")(value)
    writer.Write()
    return path


@pytest.mark.parametrize("compressor", ["ZLib", "LZ4", "LZMA", "None"])
@pytest.mark.parametrize(("mode", "is_raw"), [("Binary", 0), ("Appended", 0), ("Appended", 1)])
def test_all_that_vtk_writes_is_read(tmp_path, lines, compressor, mode, is_raw):
    """Also arrays of several blocks: radii fill one, coordinates three, and kn one and a part."""
    form = {"DataMode": getattr(vtkXMLPolyDataWriter, mode), "EncodeAppendedData": not is_raw}
    form["BlockSize"] = 4096
    for header, order in itertools.product((32, 64), (0, 1)):
        for data, name, writer in (
            (lines, "a.vtp", vtkXMLPolyDataWriter()),
            (lines.cast_to_unstructured_grid(), "a.vtu", vtkXMLUnstructuredGridWriter()),
        ):
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            how = {**form, "HeaderType": header, "ByteOrder": order}
            same(put(writer, data, tmp_path / name, **how), lines)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", [42, 51])
def test_all_legacy_files_are_read(tmp_path, lines, binary, version):
    form = {"FileVersion": version, "FileType": 2 if binary else 1}
    same(put(vtkPolyDataWriter(), lines, tmp_path / "a.vtk", **form), lines)


def test_lines_of_several_points_and_beside_other_cells_join_their_ends(tmp_path):
    mesh = pyvista.PolyData(np.eye(3), lines=np.array([3, 0, 2, 1, 2, 1, 2]))
    mesh.save(tmp_path / "a.vtp")
    assert read_mesh(tmp_path / "a.vtp").lines.tolist() == [[0, 1], [1, 2]]
    body = POINTS + "CELLS 3 9\n1 0\n2 0 1\n3 1 0 1\nCELL_TYPES 3\n1\n3\n5\n"
    mesh = read_mesh(legacy(tmp_path / "a.vtk", body, "UNSTRUCTURED_GRID"))
    assert mesh.lines.tolist() == [[0, 1]]
    assert mesh.has_faces


TEXTS = ("periodic-spheres-00000000.vtk.gz", "id-intrs-00000000.vtk.gz")
SOURCES = [YADE / name for name in (*TEXTS, "periodic-periCell-00000001.vtk")]
SOURCES += [FLOOR / f"grains_{end}" for end in ("binary_30000.vtk", "30000.vtp", "30000.vtu")]
SOURCES += [FLOOR / "grains_binary_30000.vtp", YADE / "zlib_spheres.30000.vtu"]


@pytest.mark.parametrize("source", SOURCES, ids=str)
def test_a_file_that_was_cut_off_is_an_error_that_prints_nothing(tmp_path, source, capfd):
    """Wherever it was cut: VTK fills the rest with zeros, or with what memory holds."""
    data, path = plain(source).read_bytes(), tmp_path / source.name.removesuffix(".gz")
    whole = len(data.rstrip())
    for size in np.random.default_rng(2).integers(200, whole - 60, 12):
        path.write_bytes(data[:size])
        with pytest.raises(ReadError, match=path.name):
            read_mesh(path)
    assert capfd.readouterr() == ("", "")


def test_a_last_number_without_a_line_end_is_doubted(tmp_path):
    path = legacy(tmp_path / "a.vtk", POINTS.rstrip())
    with pytest.warns(ScanfabWarning, match=r"a\.vtk: the last line has no end"):
        read_mesh(path)


GRID = "UNSTRUCTURED_GRID"
CELLS_51 = "CELLS 3 2\nOFFSETS vtktypeint64\n{}\nCONNECTIVITY vtktypeint64\n"
ONES = "CELL_TYPES 2\n1\n1\n"


DAMAGED_TEXTS = [
    (POINTS.replace("2", "9" * 5000, 1), ()),
    (POINTS + "LINES 1 1\n7\n", ()),
    (POINTS + "LINES 1 3\n2 0 x\n", ()),
    (POINTS + "LINES 1 3\n2 0 10000000000\n", ()),
    (POINTS + "POINT_DATA 2\nSCALARS radius double\nLOOKUP_TABLE default\n1\n", ()),
    (POINTS + "POINT_DATA 2\nFIELD FieldData 1\nradius 1 1 double\n1\n", ()),
    (POINTS + "POINT_DATA 2\n", ()),
    ("", ()),
    (POINTS + CELLS_51.format("0 1 2") + "0 1\n" + ONES, (GRID,)),
    (POINTS + CELLS_51.format("0 1 2") + "0 one\n" + ONES, (GRID, "5.1")),
    (POINTS + CELLS_51.format("0 3 2") + "0 1\n" + ONES, (GRID, "5.1")),
    (POINTS + "CELLS 2 6\n3 0 1 1 1 0\nCELL_TYPES 2\n3 3\n", (GRID,)),
    (POINTS + "CELLS 2 3\n1 0 0\nCELL_TYPES 2\n3 3\n", (GRID,)),
]


@pytest.mark.parametrize(("body", "how"), DAMAGED_TEXTS)
def test_legacy_texts_that_are_damaged_are_refused(tmp_path, body, how):
    refuses(legacy(tmp_path / "a.vtk", body, *how))


@pytest.mark.parametrize("dataset", ["STRUCTURED_POINTS", "TABLE"])
def test_data_that_are_no_mesh_are_refused(tmp_path, dataset):
    refuses(legacy(tmp_path / "a.vtk", "", dataset), f"with points, found {dataset}")
    refuses(write(tmp_path / "a.vtk", "hello"), "expected a VTK file with points")


def sizes(*numbers, type="<u4"):
    return base64.b64encode(np.array(numbers, type).tobytes()).decode()


DAMAGED_ARRAYS = [
    vtk_array("0 0", format="ascii"),
    vtk_array("0 <InformationKey>1 2</InformationKey> 0", format="ascii"),
    vtk_array("0 0 0 0", format="ascii"),
    vtk_array("0 0 zero", format="ascii"),
    vtk_array("0 0 0", format="ascii").replace("</DataArray>", ""),
    # pytest hands the id to processes that a test starts, and 1 MB is too long for them
    pytest.param(vtk_array("0 0 0", format="ascii") + "<DataArray " * 100_000, id="open tags"),
    vtk_array(NumberOfComponents="9999999"),
    vtk_array(type="Complex"),
    vtk_array("!!!!!!!!"),
    vtk_array(sizes(24)),
    vtk_array(sizes(1, 2**31, 2**31, 16)),
    vtk_array(sizes(2**32 - 1, 24, 0, 0)),
    vtk_array(sizes(1, 24, 0, 99)),
    vtk_array(format="appended"),
    vtk_array(format="appended", offset="2.5"),
    vtk_array(format="anything"),
]


@pytest.mark.parametrize("points", DAMAGED_ARRAYS)
@pytest.mark.parametrize("packing", ["", *(f"vtk{name}Data" for name in ("ZLib", "LZ4", "RAR"))])
def test_arrays_of_xml_that_are_damaged_are_refused(tmp_path, points, packing):
    more = f'compressor="{packing}Compressor"' if packing else ""
    for count in ("1", "many"):
        content = f"<Points>{points}</Points>"
        refuses(vtk_xml(tmp_path / "a.vtp", f'NumberOfPoints="{count}"', content, more=more))


@pytest.mark.parametrize("wrong", [b"0.5 0.5 0.5", b"0.\x005", b"half"])
def test_arrays_that_vtk_drops_in_silence_are_missed(tmp_path, wrong):
    path = yade_spheres(tmp_path / "a.vtk", np.eye(3), [0.5, 0.25, 1.0], id=[1, 2, 3])
    path.write_bytes(path.read_bytes().replace(b"0.5", wrong))
    refuses(path)


HALF = np.array([0.5, 1.0, 1.75])
CORNERS = np.array([3.0, 4.0, 5.0]) + corners_of_a_box(HALF)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)


def saved(path, cells):
    if path.suffix == ".vtp":
        faces = np.hstack([np.full((len(cells), 1), cells.shape[1]), cells])
        pyvista.PolyData(CORNERS, faces.ravel()).save(path)
    else:
        kind = {3: "triangle", 4: "quad"}[cells.shape[1]]
        meshio.Mesh(CORNERS, [(kind, cells)]).write(path)
    return path


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("suffix", [*SUFFIXES, ".STL"])
def test_every_format_gives_the_same_body(tmp_path, suffix, binary):
    path = tmp_path / f"box{suffix}"
    if suffix.lower() in (".stl", ".ply"):
        mesh = meshio.Mesh(CORNERS, [("triangle", OF_A_BOX)])
        mesh.write(path, file_format=suffix.lower()[1:], binary=binary)
    else:
        # faces of four corners are two triangles each
        saved(path, QUADS if binary and suffix in (".vtp", ".obj") else OF_A_BOX)
    points, triangles = read_surface(path)
    shape, center = polyhedron(points, triangles)
    assert (len(triangles), len(shape.planes)) == (12, 6)
    assert center == pytest.approx([3.0, 4.0, 5.0])
    assert shape.high == pytest.approx(HALF)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_surface_or_ends_too_early_is_told(tmp_path, suffix):
    path = saved(tmp_path / f"box{suffix}", OF_A_BOX)
    whole = path.read_bytes()
    parts = [whole[: int(share * len(whole))] for share in (0.2, 0.5, 0.8)]
    for content in (b"", b"hello\nworld\n", b"\x00\xff" * 300, *parts):
        path.write_bytes(content)
        with pytest.raises(ScanfabError):
            polyhedron(*read_surface(path))
