"""Files that once crashed a reader, took all memory, or drew a warning of a library."""

from __future__ import annotations

import base64
import time
import warnings

import numpy as np
import pytest
import pyvista
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

import scanfab
from scanfab.base.errors import PackingError, ReadError
from scanfab.io.formats.liggghts import LiggghtsReader
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.formats.yade import YadeReader
from scanfab.io.parse.vtk_mesh import read_mesh
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from tests.helpers.dumps import (
    ROWS,
    dump_text,
    local_text,
    pairs_text,
    write,
    yade_lines,
    yade_spheres,
)
from tests.helpers.fuzzing import only_scanfabs_warnings
from tests.helpers.truth import YADE

POINTS = "POINTS 2 double\n0 0 0 2 0 0\n"


def legacy(path, body, version="3.0", dataset="POLYDATA"):
    return write(path, f"# vtk DataFile Version {version}\n\nASCII\nDATASET {dataset}\n{body}")


def xml(path, piece, content="", type="PolyData"):
    return write(
        path,
        f'<VTKFile type="{type}" version="0.1" byte_order="LittleEndian"><{type}>'
        f"<Piece {piece}>{content}</Piece></{type}></VTKFile>",
    )


def refuses(read, *args, match=None, **options):
    """ReadError, and no warning of a library."""
    with only_scanfabs_warnings(), pytest.raises(ReadError, match=match):
        read(*args, **options)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (POINTS.replace("2", "9" * 5000, 1), "expected a whole number"),
        (POINTS.replace("2", "1" + "0" * 14, 1), "has 6 of 300000000000000 values"),
        (POINTS.replace("2", "-2", 1), "expected a whole number"),
        (POINTS + "LINES 1 1\n7\n", "1 numbers are not 1 cells"),
        (POINTS + "LINES 1 3\n-2 0 1\n", "3 numbers are not 1 cells"),
        (POINTS + "LINES 2 3\n2 0 1\n", "3 numbers are not 2 cells"),
        (POINTS + "LINES 1 3\n2 0 x\n", "whole numbers"),
        (POINTS + "POINT_DATA 2\nFIELD FieldData 4294967296\nr 1 2 double\n1 1\n", "arrays"),
        (POINTS + "POINT_DATA 3\nSCALARS radius double\n1 1 1\n", "3 rows for 2 points"),
        (POINTS + "POINT_DATA 2\nSCALARS radius double\nLOOKUP_TABLE default\n1\n", "1 of 2"),
        (POINTS + "POINT_DATA 2\nSCALARS radius complex\n1 1\n", "there is no type"),
        (POINTS + "POINT_DATA 2\nFIELD FieldData 1\nradius 1 1 double\n1\n", "1 of 2 rows"),
        (POINTS + POINTS, "twice"),
        (POINTS + "METADATA\nINFORMATION 1e308\n\n", "whole number"),
        (POINTS + "METADATA\nINFORMATION 999999999\n\n", "0 of 999999999 entries"),
        (POINTS + "METADATA\nINFORMATION 1\nNAME A LOCATION B\nDATA 9 1 2\n\n", "2 of 9 values"),
        (POINTS + "POINT_DATA\n", "incomplete"),
        (POINTS + "SPLINES 2\n", "keyword"),
        (POINTS + "\xa0\n", "keyword"),
    ],
)
def test_legacy_counts_are_those_of_the_content(tmp_path, body, reason):
    refuses(read_mesh, legacy(tmp_path / "a.vtk", body), match=reason)


@pytest.mark.parametrize(
    ("version", "cells"),
    [
        ("3.0", "CELLS 3 2\nOFFSETS vtktypeint64\n0 1 2\nCONNECTIVITY vtktypeint64\n0 1\n"),
        ("5.1", "CELLS 2 4\n1 0 1 1\n"),
    ],
)
def test_cells_are_written_as_the_version_has_them(tmp_path, version, cells):
    body = POINTS + cells + "CELL_TYPES 2\n1\n1\n"
    refuses(read_mesh, legacy(tmp_path / "a.vtk", body, version, "UNSTRUCTURED_GRID"))


def test_a_legacy_file_needs_its_three_first_lines(tmp_path):
    refuses(read_mesh, write(tmp_path / "a.vtk", "# vtk DataFile Version \n\nASCII\nDATASET X\n"))


@pytest.mark.parametrize("id", [2, -1, 10**10])
def test_legacy_lines_name_points_that_exist(tmp_path, id):
    refuses(read_mesh, legacy(tmp_path / "a.vtk", POINTS + f"LINES 1 3\n2 0 {id}\n"))


@pytest.mark.parametrize("binary", [False, True])
def test_offsets_of_lines_rise(tmp_path, binary):
    mesh = pyvista.PolyData(np.eye(3), lines=[2, 0, 1, 2, 1, 2])
    mesh.save(tmp_path / "a.vtk", binary=binary)
    data = (tmp_path / "a.vtk").read_bytes()
    sound, wrong = b"0 2 4 ", b"0 9 4 "
    if binary:
        sound, wrong = (np.array(n, ">i8").tobytes() for n in ((0, 2, 4), (0, 9, 4)))
    assert sound in data
    (tmp_path / "a.vtk").write_bytes(data.replace(sound, wrong))
    refuses(read_mesh, tmp_path / "a.vtk", match="LINES: the offsets")


@pytest.mark.parametrize(
    ("offsets", "ids"),
    [("0 1 2", "0 one"), ("0 x 2", "0 1"), ("0 1 1", "0 1"), ("1 1 2", "0 1"), ("0 3 2", "0 1")],
)
def test_legacy_offsets_and_points_of_cells_are_numbers(tmp_path, offsets, ids):
    cells = f"CELLS 3 2\nOFFSETS vtktypeint64\n{offsets}\nCONNECTIVITY vtktypeint64\n{ids}\n"
    body = POINTS + cells + "CELL_TYPES 2\n1\n1\n"
    refuses(read_mesh, legacy(tmp_path / "a.vtk", body, "5.1", "UNSTRUCTURED_GRID"))


def test_types_of_cells_are_numbers(tmp_path):
    body = POINTS + "CELLS 2 4\n1 0 1 1\nCELL_TYPES 2\n1 x\n"
    refuses(read_mesh, legacy(tmp_path / "a.vtk", body, dataset="UNSTRUCTURED_GRID"))


def test_cells_of_a_kind_that_does_not_exist_are_no_grains(tmp_path):
    body = POINTS + "CELLS 2 4\n1 0 1 1\nCELL_TYPES 2\n133 133\n"
    assert read_mesh(legacy(tmp_path / "a.vtk", body, dataset="UNSTRUCTURED_GRID")).has_faces


@pytest.mark.parametrize("count", [10**8, 10**15, 10**30, -1, "many"])
@pytest.mark.parametrize("name", ["Points", "Polys"])
def test_xml_counts_fit_into_the_file(tmp_path, name, count):
    counts = {"Points": 1, "Verts": 0, "Lines": 0, "Strips": 0, "Polys": 0, name: count}
    piece = " ".join(f'NumberOf{key}="{value}"' for key, value in counts.items())
    refuses(read_mesh, xml(tmp_path / "a.vtp", piece), match=f"NumberOf{name} cannot be")


def array(content="", **words):
    """A DataArray of the Points of one point."""
    words = {"type": "Float64", "NumberOfComponents": "3", "format": "binary", **words}
    return f"<DataArray {' '.join(f'{k}={v!r}' for k, v in words.items())}>{content}</DataArray>"


def sizes(*numbers, type="<u4"):
    return base64.b64encode(np.array(numbers, type).tobytes()).decode()


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (array("0 0", format="ascii"), "2 of 3 values"),
        (array("0 <InformationKey>1 2</InformationKey> 0", format="ascii"), "2 of 3 values"),
        (array("0 0 0", format="ascii").replace("</DataArray>", ""), "mismatched tag"),
        (array(NumberOfComponents="9999999"), "NumberOfComponents cannot be"),
        (array(type="Complex"), "there is no type 'Complex'"),
        (array(), "end too early"),
        (array("!!!!!!!!"), "base64"),
        (array(sizes(24)), "end too early"),
        (array(sizes(4, 0)), "0 of 3 values"),
        (array(sizes(2**31, 0, 0)), "end too early"),
        (array(format="appended"), "offset cannot be ''"),
        (array(format="appended", offset="2.5"), "offset cannot be '2.5'"),
        (array(format="appended", offset="99"), "end too early"),
        (array(format="anything"), "offset cannot be ''"),
    ],
)
def test_xml_arrays_have_their_values(tmp_path, points, reason):
    path = xml(tmp_path / "a.vtp", 'NumberOfPoints="1"', f"<Points>{points}</Points>")
    refuses(read_mesh, path, match=reason)


@pytest.mark.parametrize(
    ("blocks", "reason"),
    [
        (sizes(1, 2**31, 2**31, 16), "end too early"),
        (sizes(1, 2**31, 0, 0), "bytes"),
        (sizes(2**31, 1, 0, 0), "blocks"),
        (sizes(2, 24, 0, 0), "end too early"),
        (sizes(1, 16, 0, 0), "2 of 3 values"),
    ],
)
@pytest.mark.parametrize("compressor", ["ZLib", "LZ4", "LZMA"])
def test_packed_arrays_have_their_blocks(tmp_path, blocks, reason, compressor):
    path = xml(tmp_path / "a.vtp", 'NumberOfPoints="1"', f"<Points>{array(blocks)}</Points>")
    text = path.read_text().replace(
        "<VTKFile", f'<VTKFile compressor="vtk{compressor}DataCompressor"'
    )
    refuses(read_mesh, write(path, text), match=reason)


@pytest.mark.parametrize(
    "part",
    ["<DataArray ", "<DataArray format='ascii'>", "<Piece", "<InformationKey", "a=' ", "<!--", " "],
)
def test_the_time_grows_as_the_file_does(tmp_path, part):
    head = '<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="1"><Points>'
    path = write(tmp_path / "a.vtp", f"{head}<DataArray {part * 100_000}</DataArray>")
    began = time.monotonic()
    refuses(read_mesh, path)
    assert time.monotonic() - began < 10


def test_there_are_three_compressors(tmp_path):
    path = xml(tmp_path / "a.vtp", 'NumberOfPoints="0"')
    text = path.read_text().replace("<VTKFile", '<VTKFile compressor="vtkRARDataCompressor"')
    refuses(read_mesh, write(path, text), match="there is no compressor")


@pytest.mark.parametrize("offset", ["1", "-2", "99999999999", "9" * 30, "x"])
@pytest.mark.parametrize("order", [1, -1])
def test_offsets_of_xml_cells_are_those_of_their_points(tmp_path, offset, order):
    parts = [
        array("0 1 0 1", format="ascii", type="Int64", Name="connectivity", NumberOfComponents="1"),
        array(f"2 {offset}", format="ascii", type="Int64", Name="offsets", NumberOfComponents="1"),
    ]
    points = array("0 0 0 2 0 0", format="ascii")
    content = f"<Points>{points}</Points><Lines>{''.join(parts[::order])}</Lines>"
    path = xml(tmp_path / "a.vtp", 'NumberOfPoints="2" NumberOfLines="2"', content)
    refuses(read_mesh, path, match="offsets of")


@pytest.mark.parametrize("count", [1, 5000])
@pytest.mark.parametrize("compressor", ["ZLib", "LZ4", "LZMA", "None"])
@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("is_raw", [False, True])
def test_all_that_vtk_writes_passes(tmp_path, count, compressor, mode, is_raw):
    points = np.random.default_rng(1).random((count, 3))
    mesh = pyvista.PolyData(points)
    mesh["radius"] = np.ones(count)
    grid = mesh.cast_to_unstructured_grid()
    for data, ending in ((mesh, "vtp"), (grid, "vtu")):
        for header, order in ((32, 0), (32, 1), (64, 0), (64, 1)):
            writer = vtkXMLPolyDataWriter() if data is mesh else vtkXMLUnstructuredGridWriter()
            writer.SetInputData(data)
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            getattr(writer, f"SetDataModeTo{mode}")()
            writer.SetEncodeAppendedData(not is_raw)
            writer.SetHeaderType(header)
            writer.SetByteOrder(order)
            writer.SetFileName(str(tmp_path / f"a.{ending}"))
            writer.Write()
            assert len(read_mesh(tmp_path / f"a.{ending}").points) == count


def test_wall_contacts_name_grains_that_exist(tmp_path):
    position = np.array([row[2:5] for row in ROWS])
    grains = GrainTable(position, np.full(3, 0.1), np.array([1, 2, 3]), {}, None)
    rows = [(*place, 0, 0, id) for place, id in zip(position, (1, 2, 9), strict=True)]
    path = write(tmp_path / "a.txt", local_text(rows))
    snapshot = LiggghtsReader().snapshots(path)[0]
    read = LiggghtsReader().read_contacts
    refuses(read, snapshot, ReadOptions(), grains, match="names the grain 9, which is not")


def test_a_box_of_any_extent_fits_into_the_file(tmp_path):
    yade_spheres(tmp_path / "g1.vtk", [[0, 0, 0]], [1])
    extent = "0 1000000000 0 1 0 1"
    write(
        tmp_path / "gboundingBox_1.vtr",
        f'<VTKFile type="RectilinearGrid"><RectilinearGrid WholeExtent="{extent}">'
        f'<Piece Extent="{extent}"/></RectilinearGrid></VTKFile>',
    )
    refuses(scanfab.read, tmp_path / "g1.vtk", match="coordinates along three axes")


def test_meshio_keeps_scalars_flat(tmp_path):
    body = (
        POINTS + "CELLS 2 4\n1 0 1 1\nCELL_TYPES 2\n1\n1\n"
        "POINT_DATA 2\nSCALARS radius double\nLOOKUP_TABLE default\n1 1\n"
    )
    path = legacy(tmp_path / "a.vtk", body, dataset="UNSTRUCTURED_GRID")
    np.testing.assert_array_equal(scanfab.read(path).radius, [1, 1])


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_contacts_end_at_finite_places(tmp_path, value):
    ends = [[[0, 0, 0], [value, 0, 0]]]
    path = yade_lines(tmp_path / "a.vtk", ends)
    grains = GrainTable(np.zeros((1, 3)), np.ones(1), None, {}, None)
    read = VtkReader().read_contacts
    refuses(read, Snapshot(path), ReadOptions(), grains, match="no finite numbers")


@pytest.mark.parametrize(("position", "radius"), [(np.nan, 1), (0, np.nan), (0, 0), (0, np.inf)])
def test_contacts_need_grains_with_a_place_and_a_size(tmp_path, position, radius):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]])
    cell = scanfab.Cell([4, 4, 4])
    grains = GrainTable(np.full((1, 3), position), np.full(1, radius), None, {}, cell)
    refuses(VtkReader().read_contacts, Snapshot(path), ReadOptions(), grains, match="finite")


def test_a_large_grain_in_a_small_cell_has_few_images(tmp_path):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]])
    cell = scanfab.Cell([4, 4, 4])
    grains = GrainTable(np.zeros((1, 3)), np.full(1, 1e50), None, {}, cell)
    VtkReader().read_contacts(Snapshot(path), ReadOptions(), grains)


def test_ids_of_contacts_are_whole_numbers(tmp_path):
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]], id1=[np.nan], id2=[1])
    grains = GrainTable(np.zeros((1, 3)), np.ones(1), np.array([1]), {}, None)
    read = VtkReader().read_contacts
    refuses(read, Snapshot(path), ReadOptions(), grains, match="ids must be whole numbers")


def test_forces_of_another_shape_are_no_forces(tmp_path):
    vectors = {"normalForce": [[1, 0, 0]]}
    path = yade_lines(tmp_path / "a.vtk", [[[0, 0, 0], [1, 0, 0]]], vectors, shearForce=[1])
    assert YadeReader().force_on_second(read_mesh(path)) is None


def test_a_text_export_may_be_called_gz(tmp_path):
    path = write(tmp_path / "a.txt.gz", "#format x_y_z_r\n0 0 0 1\n")
    assert len(scanfab.read(path)) == 1


def test_indented_comments_are_no_rows(tmp_path):
    path = write(tmp_path / "a.txt", "#format x_y_z_r\n  # none\n")
    with only_scanfabs_warnings():
        assert len(scanfab.read(path)) == 0


@pytest.mark.parametrize("edge", ["1e200", "-1e200", "inf", "nan"])
def test_a_text_exports_cell_is_finite(tmp_path, edge):
    path = write(tmp_path / "a.txt", f"##PERIODIC:: 1 1 {edge}\n0 0 0 1 -1\n")
    refuses(scanfab.read, path, match="expected three lengths")


def test_a_float_that_signals_that_it_is_no_number_is_none(tmp_path):
    points, radius = np.array([0x7FA00001, 0, 0], ">u4"), np.array([0.5], ">f4")
    path = tmp_path / "a.vtk"
    path.write_bytes(
        b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 1 float\n"
        + points.tobytes()
        + b"\nPOINT_DATA 1\nSCALARS radius float 1\nLOOKUP_TABLE default\n"
        + radius.tobytes()
        + b"\n"
    )
    with only_scanfabs_warnings(), pytest.raises(PackingError, match="must be finite numbers"):
        scanfab.read(path)


def test_blank_lines_are_no_rows(tmp_path):
    text = dump_text(ROWS[:1]).replace("1 1 0.2 0.5 0.5 0.1", "")
    refuses(scanfab.read, write(tmp_path / "a.txt", text), match="counts 1 rows, found 0")


@pytest.mark.parametrize("value", ["inf", "nan", "1e300"])
def test_fractions_of_the_box_are_numbers(tmp_path, value):
    rows = [(1, value, 0.5, 0.5, 0.1)]
    path = write(tmp_path / "a.txt", dump_text(rows, "id xs ys zs radius"))
    with only_scanfabs_warnings(), pytest.raises(scanfab.ScanfabError):
        scanfab.read(path)


def test_a_box_without_limits_is_no_box(tmp_path):
    path = write(tmp_path / "a.txt", dump_text(box=((-1e300, 1e300), (0, 1), (0, 1))))
    with only_scanfabs_warnings():
        assert scanfab.read(path).cell is None


@pytest.mark.parametrize("name", ["x", "radius"])
def test_coordinates_and_radii_are_lengths(tmp_path, name):
    rows = [(1, *(1e200 if one == name else 0.5 for one in ("x", "y", "z", "radius")))]
    path = write(tmp_path / "a.txt", dump_text(rows, "id x y z radius"))
    refused = pytest.raises(PackingError, match=r"a\.txt: grain 1: .* cannot be a length")
    with only_scanfabs_warnings(), refused:
        scanfab.read(path)


def test_a_grain_is_not_far_from_its_cell(tmp_path):
    rows = [(1, 1e30, 0.5, 0.5, 0.1)]
    text = dump_text(rows, "id x y z radius", flags=" pp pp pp")
    refuses(scanfab.read, write(tmp_path / "a.txt", text), match=r"1e\+30 cells away")


@pytest.mark.parametrize("id", ["1e300", "nan", "inf", "0.5"])
def test_ids_are_whole_numbers(tmp_path, id):
    path = write(tmp_path / "a.txt", dump_text([(id, 1, 0.5, 0.5, 0.5, 0.1)]))
    refuses(scanfab.read, path, match="ids must be whole numbers")


def test_forces_of_any_size_draw_no_warning(tmp_path):
    write(tmp_path / "d1.txt", dump_text())
    write(tmp_path / "p1.txt", pairs_text().replace("-1.5", "-1e308"))
    with only_scanfabs_warnings():
        assert len(scanfab.read(tmp_path).contacts) == 2


def test_sound_files_still_pass():
    packing = scanfab.read(YADE / "zlib_spheres.30000.vtu", contacts="geometric")
    assert len(packing) > 100


@pytest.mark.parametrize("cells", ["CELLS 1 4\n3 0 1 1\n", "CELLS 1 2\n1 0\n", "CELLS 1 1\n0\n"])
def test_lines_of_another_number_of_points_than_two(tmp_path, cells):
    """VTK's own table of cells by type walks off their end."""
    body = POINTS + cells + "CELL_TYPES 1\n3\n"
    refuses(read_mesh, legacy(tmp_path / "a.vtk", body, dataset="UNSTRUCTURED_GRID"), match="fit")


def test_lines_beside_cells_of_other_kinds(tmp_path):
    body = POINTS + "CELLS 3 9\n1 0\n2 0 1\n3 1 0 1\nCELL_TYPES 3\n1\n3\n5\n"
    mesh = read_mesh(legacy(tmp_path / "a.vtk", body, dataset="UNSTRUCTURED_GRID"))
    assert mesh.lines.tolist() == [[0, 1]]
    assert mesh.has_faces


def test_a_nan_that_signals_is_no_warning(tmp_path):
    points = np.array([[1, 2, 3]], np.float32)
    points.view(np.uint32)[0, 0] = 0x7F800001
    cloud = pyvista.PolyData(points)
    cloud["radius"] = [1.0]
    cloud.save(tmp_path / "a.vtp")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with pytest.raises(scanfab.ScanfabError, match="finite"):
            scanfab.read(tmp_path / "a.vtp")


@pytest.mark.parametrize("word", ["9" * 5000 + "x", "9" * 5000 + ".5.5", "1" * 5000 + "e"])
def test_words_of_many_digits_take_no_time(tmp_path, word):
    """A pattern that could cut the digits anywhere tried all places: 32 s for a table of these."""
    rows = f"1,0,{word},0,1\n" * 40
    path = write(tmp_path / "a.csv", f"id,x,y,z,radius\n{rows}")
    began = time.monotonic()
    refuses(scanfab.read, path)
    assert time.monotonic() - began < 5


def test_radii_near_zero_prove_nothing(tmp_path):
    rows = "".join(f"{k}e300 0 0 1e-300\n" for k in range(12))
    refuses(scanfab.read, write(tmp_path / "a.txt", rows), match="no names")


@pytest.mark.parametrize("rows", ["", "1,2,0.5,0,\n"])
def test_a_column_without_name_and_numbers_that_the_user_names(tmp_path, rows):
    grains = write(tmp_path / "d1.csv", "id,x,y,z,radius\n1,0,0,0,1\n2,2,0,0,1\n")
    pairs = write(tmp_path / "p1.csv", f"id1,id2,fx,fy,\n{rows}")
    named = "id1=id1,id2=id2,fx2=fx,fy2=fy,fz2=5"
    refuses(scanfab.read, grains, contacts=pairs, contact_columns=named, match="column 5")


def test_tables_by_an_ending_that_says_doubles(tmp_path):
    """Arrays of NumPy in an .xyzd file were read as such, and then held for x y z d."""
    with open(tmp_path / "a.xyzd", "wb") as file:
        np.savez(file, radius=np.ones(12), other=np.ones(12))
    refuses(scanfab.read, tmp_path / "a.xyzd", format="table")


def test_doubles_that_begin_as_an_archive_does(tmp_path):
    rows = np.column_stack([np.arange(12.0), np.zeros((12, 2)), np.ones(12)]).astype("<f8")
    rows[0, 0] = np.frombuffer(b"PK" + bytes(6), "<f8")[0]
    (tmp_path / "a.xyzd").write_bytes(rows.tobytes())
    assert len(scanfab.read(tmp_path / "a.xyzd")) == 12
