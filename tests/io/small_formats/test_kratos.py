"""Kratos DEM: radii of nodes, comments, what is no sphere, and groups of HDF5."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.dumps import write
from tests.helpers.made.kratos import MDPA


def test_nodes_with_a_radius_are_spheres(tmp_path):
    packing = scanfab.read(write(tmp_path / "a.mdpa", MDPA))
    assert packing.id.tolist() == [3, 7]
    # the column between says whether the value is fixed
    np.testing.assert_array_equal(packing.radius, [0.1, 0.2])
    np.testing.assert_array_equal(packing.position, [[0.75, 0.25, 0.125], [0.5, 0.25, 0.125]])


def test_several_blocks_of_radii(tmp_path):
    text = MDPA.replace("7  1 0.2", "End NodalData\nBegin NodalData RADIUS\n7 0 0.3")
    np.testing.assert_array_equal(scanfab.read(write(tmp_path / "a.mdpa", text)).radius, [0.1, 0.3])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("7  1 0.2\n", "", "the sphere at node 7 and 0 more have no radius"),
        ("7 0.5 0.25", "8 0.5 0.25", "the node 7 has a radius, but no place"),
        ("SphericParticle3D", "Cluster3D", "expected elements that are spheres, found Cluster3D"),
        ("7  1 0.2", "7  1", "the number of columns changed"),
        ("End Nodes", "", "expected no .End Elements. here|has no end|a block is incomplete"),
        ("RADIUS", "MASS", "no grains: expected points with a radius"),
    ],
)
def test_what_is_wrong(tmp_path, old, new, message):
    assert old in MDPA
    with pytest.raises(ReadError, match=message):
        scanfab.read(write(tmp_path / "a.mdpa", MDPA.replace(old, new)))


@pytest.fixture
def groups(tmp_path):
    path = tmp_path / "a.hdf5"
    with h5py.File(path, "w") as file:
        for name, time in (("0", 0.5), ("10", 1.5), ("9", 1.0)):
            group = file.create_group(name)
            group.attrs["time"] = time
            for column in ("x", "y", "z", "radius"):
                group[column] = np.array([0.1, 0.2]) + time
            group["id"] = np.array([5.0, 4.0])
    return path


def test_groups_are_frames_in_the_order_of_their_numbers(groups):
    series = scanfab.read_series(groups)
    assert [frame.snapshot.time for frame in series] == [0.5, 1.0, 1.5]
    packing = series[1].read()
    assert packing.id.tolist() == [5, 4]
    np.testing.assert_array_equal(packing.radius, [1.1, 1.2])


def test_columns_of_other_lengths(groups):
    with h5py.File(groups, "a") as file:
        del file["9/id"]
        file["9/id"] = np.zeros(3)
    with pytest.raises(ReadError, match="group 9: expected columns of one length"):
        scanfab.read_series(groups)[1].read()


def test_the_kit(tmp_path, groups):
    reader = reader_named("kratos")
    path = write(tmp_path / "a.mdpa", MDPA)
    check_reader(reader, [path], tmp_path / "damaged", counts=True)
    check_reader(reader, [groups], tmp_path / "more", counts=True)
