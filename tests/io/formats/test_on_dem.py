"""ON-DEM's VTKHDF: both drafts, their signs, walls, what others read of it, damaged files."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.io.reader import reader_for
from scanfab.testing import made_up_packings
from tests.helpers.dumps import holds, refuses
from tests.helpers.made.on_dem import COMPRESSION, FORCE, IDS, POSITION, draft_1, draft_2


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
        np.testing.assert_array_equal(file["VTKHDF/PointData/radius"], packing.radius)
    mesh = pyvista.read(path)
    np.testing.assert_array_equal(mesh.points, packing.position)
    np.testing.assert_array_equal(mesh["body_id"], packing.id)
    assert mesh.n_verts == len(packing)


def test_vtkhdf_of_other_programs_is_read_as_vtk_and_other_hdf5_is_nobodys(tmp_path):
    with h5py.File(draft_1(tmp_path / "a.vtkhdf"), "a") as file:
        del file["ONDEM"]
    assert reader_for(tmp_path / "a.vtkhdf").name == "vtk"
    packing = scanfab.read(tmp_path / "a.vtkhdf")
    holds(packing, id=IDS, contacts=None)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.ones(3)
    assert reader_for(tmp_path / "a.h5") is None


def other_rows(group):
    del group["radius"]
    group["radius"] = np.ones(4)


def virtual_data(group):
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (3,))
    group.create_virtual_dataset("z", layout)


SPOILT = {
    "z is in another file": lambda one: one.update({"z": h5py.ExternalLink("b.h5", "/x")}),
    "data of .*z are in another file": lambda one: one.create_dataset(
        "z", (3,), "f8", external=[("z.bin", 0, 24)]
    ),
    "of VTKHDF/PointData/z are in another": virtual_data,
    "Unable to allocate": lambda one: one.create_dataset("z", (1 << 40,), "f8", chunks=(1 << 16,)),
    "a radius for each": other_rows,
    "steps in time": lambda one: one.parent.create_group("Steps"),
}


@pytest.mark.parametrize("reason", SPOILT)
def test_what_cannot_be_read_is_told(tmp_path, reason):
    path = draft_1(tmp_path / "a.vtkhdf")
    (tmp_path / "z.bin").write_bytes(bytes(24))
    with h5py.File(path, "a") as file:
        SPOILT[reason](file["VTKHDF/PointData"])
    refuses(path, reason)
