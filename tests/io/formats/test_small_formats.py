"""The small formats: what they read, what they refuse; ON-DEM's VTKHDF with its signs."""

import h5py
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab import ReadError, ScanfabNote
from scanfab.io import reader as readers
from scanfab.io.formats import musen as musen_reader
from scanfab.io.reader import reader_for, reader_named
from scanfab.testing import made_up_packings
from tests.helpers.dumps import holds, refuses, write
from tests.helpers.made import esys, gsd, musen
from tests.helpers.made.kratos import MDPA
from tests.helpers.made.mfix import version_2
from tests.helpers.made.on_dem import COMPRESSION, FORCE, IDS, POSITION, draft_1, draft_2
from tests.helpers.sound_files import made


@pytest.mark.parametrize("behind", ["", esys.TURNS, " 1", " 1 0.1" + esys.TURNS + " 1"])
def test_esys_particles_of_all_workers(tmp_path, behind):
    path = esys.run(tmp_path, behind=behind)
    packing = scanfab.read(path)
    holds(packing, id=[4, 5, 1], position=[[1, 1, 2], [1.5, 1, 2], [3.75, 1, 2]], radius=0.25)
    # bonds are no contacts
    holds(packing, tag=[77] * 3, step=30, time=15, contacts=None)
    holds(packing.cell, origin=[0, -1, 0], vectors=np.diag([4, 6, 6]), periodic=[1, 0, 0])
    # in 2D it is not periodic across, whatever the header says
    flat = path.read_text().replace("0 -1 0 4 5 6", "0 -1 2 4 5 2").replace("n 3D", "n 2D")
    path.write_text(flat.replace("Boundaries 1 0 0", "Boundaries 1 0 1"))
    assert scanfab.read(path).cell.periodic == (True, False, False)


@pytest.mark.parametrize("source", ["", "snap*", "snap_t=*_0.txt"])
def test_esys_snapshots_are_a_series_of_their_headers(tmp_path, source):
    for step in (200, 30, 1000):
        path = esys.run(tmp_path, step)
    series = scanfab.read_series(str(tmp_path / source))
    assert [(frame.step, len(frame.read())) for frame in series] == [(30, 3), (200, 3), (1000, 3)]
    names = [one.name for one in reader_named("esys").beside(path)]
    assert names == ["snap_t=1000_1.txt", "snap_t=1000_2.txt"]


def test_gsd_frames_have_what_they_or_the_first_one_say(tmp_path):
    path = gsd.gsd_file(tmp_path / "a.gsd", gsd.frame(7), gsd.frame(20, count=2))
    series = scanfab.read_series(path)
    assert [one.step for one in series] == [7, 20]
    packing, second = (one.read() for one in series)
    holds(second, radius=[0.5, 0.5])
    # tilt factors are multiples of the second and third edge; the box lies about the origin
    vectors = [[4, 0, 0], [1.5, 3, 0], [0.5, -1, 2]]
    holds(packing.cell, vectors=vectors, center=[0, 0, 0], periodic=(True, True, True))
    position = packing.cell.wrap(gsd.CENTRES)
    holds(packing, position=position, radius=[0.5, 0.5, 0.25], body=[-1, 4, 4])


def test_gsd_default_diameters_are_none_and_a_plane_is_not_periodic_across(tmp_path):
    flat = gsd.frame(0, diameter=None, box=(4, 3, 0, 0, 0, 0), dimensions=2)
    path = gsd.gsd_file(tmp_path / "a.gsd", flat)
    refuses(path, "no radius: expected radius or diameter")
    packing = scanfab.read(path, radius=0.2)
    holds(packing, radius=[0.2] * 3)
    assert packing.cell.periodic == (True, True, False)
    np.testing.assert_array_equal(packing.cell.vectors[:2], [[4, 0, 0], [0, 3, 0]])


def test_gsd_of_another_schema_or_without_the_package(tmp_path, monkeypatch):
    fl, path = pytest.importorskip("gsd.fl"), tmp_path / "a.gsd"
    with fl.open(str(path), "w", application="x", schema="mine", schema_version=[1, 0]) as file:
        file.end_frame()
    refuses(path, "has incorrect schema: mine")
    monkeypatch.setattr(readers, "find_spec", lambda name: None)
    for format in (None, "gsd"):
        refuses(path, r'pip install "scanfab\[gsd\]"', error=scanfab.ScanfabError, format=format)


DIAMETERS = [("F  0.17D-2", "", 0.00085), ("T  0.0017", "0.1 ", 0.05)]


@pytest.mark.parametrize("behind", ["", " 300 0.5"])
@pytest.mark.parametrize(("dimension", "z"), [(2, 0), (3, 1)])
def test_mfix_diameters_of_the_header_or_the_rows(tmp_path, dimension, z, behind):
    for diameter, size, radius in DIAMETERS:
        text = version_2(diameter, size, dimension, behind=behind)
        packing = scanfab.read(write(tmp_path / "a.dat", text))
        holds(packing, radius=radius, position=[[0.05, 0.25, z], [0.15, 0.25, z]], density=2650)
        assert ("w" in packing.columns) == (dimension == 3)


def test_mfix_rows_alone_have_radii_and_columns_may_lack_names(tmp_path):
    for row, place in (
        ("0.1D0 0.2 0.5250D-01 2650 7 8", [0.1, 0.2, 0]),
        ("0.1 0.2 3 0.0525 2650 7 8 9", [0.1, 0.2, 3]),
    ):
        packing = scanfab.read(write(tmp_path / "particle_input.dat", f"{row}\n"))
        holds(packing, radius=[0.0525], position=[place])
        # rows of numbers by another name may be anything
        refuses(write(tmp_path / "other.dat", f"{row}\n"), "", error=scanfab.ScanfabError)
    text = version_2().replace("Velocity:        T", "Velocity: F")
    packing = scanfab.read(write(tmp_path / "a.dat", text))
    assert list(packing.columns)[-3:] == ["5", "6", "7"]


def test_kratos_nodes_with_a_radius_are_spheres(tmp_path):
    path = write(tmp_path / "a.mdpa", MDPA)
    packing = scanfab.read(path)
    # the column between says whether the value is fixed
    holds(packing, id=[3, 7], radius=[0.1, 0.2])
    holds(packing, position=[[0.75, 0.25, 0.125], [0.5, 0.25, 0.125]])
    write(path, MDPA.replace("7  1 0.2", "End NodalData\nBegin NodalData RADIUS\n7 0 0.3"))
    np.testing.assert_array_equal(scanfab.read(path).radius, [0.1, 0.3])


def test_kratos_groups_are_frames_in_the_order_of_their_numbers(tmp_path):
    path = made("kratos", tmp_path)[1]
    with h5py.File(path, "a") as file:
        file.copy("1", "10")
        file["10"].attrs["time"] = 9.0
    series = scanfab.read_series(path)
    assert [frame.snapshot.time for frame in series] == [0.5, 1.0, 9.0]
    holds(series[1].read(), id=[1, 2], radius=[2, 3])
    with h5py.File(path, "a") as file:
        del file["2/id"]
        file["2/id"] = np.zeros(3)
    refuses(path, "group 2: expected columns of one length", frame=1)


def test_musen_spheres_of_each_time(tmp_path, monkeypatch):
    read, real = [], musen_reader.text_of
    monkeypatch.setattr(musen_reader, "text_of", lambda one: read.append(one) or real(one))
    path = write(tmp_path / "a.txt", musen.export(*musen.ROWS))
    series = scanfab.read_series(path)
    assert [frame.snapshot.time for frame in series] == [0, 0.5]
    with pytest.warns(ScanfabNote, match="bonds are not read"):
        first, second = (frame.read() for frame in series)
    # one sphere comes later
    holds(first, id=[3, 1], radius=0.1, contacts=None, cell=None)
    holds(second, id=[3, 1, 2])
    np.testing.assert_allclose(second.position[:, 0], [0.21, 0.385, 0.61])
    # a file is parsed once for all its frames, and again when it has changed
    assert len(read) == 1
    write(path, musen.export(*musen.ROWS, musen.sphere(9, 0.85)))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [3, 4]


def test_musen_domains_times_and_cut_files(tmp_path):
    text = musen.export(*musen.ROWS, domain="28 1 1 0 1 -1 0 -2 1 0 2")
    cell = scanfab.read_series(write(tmp_path / "a.txt", text))[0].read().cell
    assert cell.periodic == (True, False, True)
    assert cell.origin.tolist() == [-1, 0, -2]
    assert cell.vectors.diagonal()[[0, 2]].tolist() == [2, 4]
    # times of activity need not be there
    text = musen.export(*musen.ROWS).replace(" 24 0 1e+300 2", " 2").replace(" 24 0.25 0.5 2", " 2")
    assert len(scanfab.read(write(tmp_path / "a.txt", text), frame=0)) == 3
    late = musen.sphere(9, 0.85).replace(" 2 0.5 ", " 2 0.75 ")
    series = scanfab.read_series(write(tmp_path / "a.txt", musen.export(*musen.ROWS, late)))
    assert len(series[0].read()) == 3
    with pytest.raises(ReadError, match=r"no state at time 0\.5"):
        series[1].read()
    refuses(write(tmp_path / "a.txt", musen.export(*musen.ROWS)[:-100]), "the last line has no end")


@pytest.mark.parametrize("make", [draft_1, draft_2])
def test_both_drafts_hold_the_same_packing(tmp_path, make):
    """The signs are those of the draft."""
    path = make(tmp_path / "a.vtkhdf")
    packing, of_spheres = scanfab.read(path), scanfab.read(path, bodies="id").contacts
    holds(packing, position=POSITION, id=IDS, clump_id=[-1, 4, 4], time=0.25)
    # the pair of one clump is no contact, the virtual one neither, the wall's is counted
    holds(packing, wall_contacts=[1, 0, 0])
    holds(packing.contacts, pairs=[[0, 1]])
    holds(of_spheres, force=FORCE, force_n=COMPRESSION[:2])


def test_a_draft_whose_signs_are_not_known_is_refused(tmp_path):
    path = draft_1(tmp_path / "a.vtkhdf", "0.3")
    refuses(path, r"'0.3', expected 0.1 or 0.2.*sign of the normal force")


def test_what_is_written_has_the_names_of_the_draft(tmp_path):
    packing = made_up_packings()["everything"]
    (path,) = scanfab.convert(packing, tmp_path / "a.vtkhdf")
    with h5py.File(path) as file:
        assert file.attrs["file_format"] == "ON-DEM VTKHDF"
        own = file["ONDEM/Interactions"]
        normal = own["normal_force"][:][:, None] * own["normal"][:] + own["shear_force"][:]
        np.testing.assert_allclose(normal, packing.contacts.force, atol=1e-15)
        np.testing.assert_array_equal(own["id1"], packing.id[packing.contacts.pairs[:, 0]])
        np.testing.assert_array_equal(file["VTKHDF/PointData/body_id"], packing.id)
    assert pyvista.read(path).n_verts == len(packing)


def test_vtkhdf_of_other_programs_is_read_as_vtk_and_other_hdf5_is_nobodys(tmp_path):
    with h5py.File(draft_1(tmp_path / "a.vtkhdf"), "a") as file:
        del file["ONDEM"]
    assert reader_for(tmp_path / "a.vtkhdf").name == "vtk"
    packing = scanfab.read(tmp_path / "a.vtkhdf")
    holds(packing, id=IDS, contacts=None)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.ones(3)
    assert reader_for(tmp_path / "a.h5") is None


SPOILT = {
    "z is in another file": lambda one: one.update({"z": h5py.ExternalLink("b.h5", "/x")}),
    "data of .*z are in another file": lambda one: one.create_dataset(
        "z", (3,), "f8", external=[("z.bin", 0, 24)]
    ),
    "of VTKHDF/PointData/z are in another": lambda one: one.create_virtual_dataset(
        "z", h5py.VirtualLayout((3,), "f8")
    ),
    "Unable to allocate": lambda one: one.create_dataset("z", (1 << 40,), "f8", chunks=(1 << 16,)),
    "a radius for each": lambda one: one.create_dataset("z", (4,), "f8"),
    "steps in time": lambda one: one.parent.create_group("Steps"),
}


@pytest.mark.parametrize("reason", SPOILT)
def test_what_cannot_be_read_is_told(tmp_path, reason):
    path = draft_1(tmp_path / "a.vtkhdf")
    (tmp_path / "z.bin").write_bytes(bytes(24))
    with h5py.File(path, "a") as file:
        SPOILT[reason](file["VTKHDF/PointData"])
    refuses(path, reason)
