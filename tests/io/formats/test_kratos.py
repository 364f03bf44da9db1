"""Kratos DEM: radii of nodes, comments, what is no sphere, and groups of HDF5."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import scanfab
from tests.helpers.dumps import write
from tests.helpers.made.kratos import MDPA


def test_nodes_with_a_radius_are_spheres(tmp_path):
    path = write(tmp_path / "a.mdpa", MDPA)
    packing = scanfab.read(path)
    assert packing.id.tolist() == [3, 7]
    # the column between says whether the value is fixed
    np.testing.assert_array_equal(packing.radius, [0.1, 0.2])
    np.testing.assert_array_equal(packing.position, [[0.75, 0.25, 0.125], [0.5, 0.25, 0.125]])
    write(path, MDPA.replace("7  1 0.2", "End NodalData\nBegin NodalData RADIUS\n7 0 0.3"))
    np.testing.assert_array_equal(scanfab.read(path).radius, [0.1, 0.3])


def test_groups_are_frames_in_the_order_of_their_numbers(tmp_path):
    path = tmp_path / "a.hdf5"
    with h5py.File(path, "w") as file:
        for name, time in (("0", 0.5), ("10", 1.5), ("9", 1.0)):
            group = file.create_group(name)
            group.attrs["time"] = time
            for column in ("x", "y", "z", "radius"):
                group[column] = np.array([0.1, 0.2]) + time
            group["id"] = np.array([5.0, 4.0])
    series = scanfab.read_series(path)
    assert [frame.snapshot.time for frame in series] == [0.5, 1.0, 1.5]
    packing = series[1].read()
    assert packing.id.tolist() == [5, 4]
    np.testing.assert_array_equal(packing.radius, [1.1, 1.2])
    with h5py.File(path, "a") as file:
        del file["9/id"]
        file["9/id"] = np.zeros(3)
    with pytest.raises(scanfab.ReadError, match="group 9: expected columns of one length"):
        scanfab.read_series(path)[1].read()
