"""ON-DEM's VTKHDF, as the exporters of its two drafts write it."""

import h5py
import numpy as np

POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [1.9, 1.9, 0]])
IDS = np.array([7, 5, 2**60])
# id 1 is a wall's
PAIRS = np.array([[7, 5], [5, 2**60], [1, 7], [7, 2**60]])
NORMAL = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]])
COMPRESSION = np.array([3.0, -0.5, 2.0, 9.0])
SHEAR = np.array([[0.0, 0.25, 0], [0, 0, 0.125], [0, 0, 0], [0, 0, 0]])
VIRTUAL = np.array([0, 0, 0, 1], np.int8)
FORCE = COMPRESSION[:2, None] * NORMAL[:2] + SHEAR[:2]


def cells(group, count):
    for section in ("Vertices", "Lines", "Polygons", "Strips"):
        filled = count if section == "Vertices" else 0
        one = group.create_group(section)
        one["NumberOfCells"] = one["NumberOfConnectivityIds"] = np.array([filled])
        one["Connectivity"], one["Offsets"] = np.arange(filled), np.arange(filled + 1)


def interactions(group, sign):
    group["id1"], group["id2"] = PAIRS.T
    group["normal"], group["normal_force"] = NORMAL, sign * COMPRESSION
    group["shear_force"], group["virtual"] = SHEAR, VIRTUAL


def draft_1(path, version="0.1-draft"):
    """As YADE's exporter of the first draft writes it; positive forces push."""
    with h5py.File(path, "w") as file:
        file.attrs["file_format_version"] = version
        group = file.create_group("VTKHDF", track_order=True)
        group.attrs["Type"], group.attrs["Version"] = np.bytes_("PolyData"), [2, 0]
        group["NumberOfPoints"], group["Points"] = np.array([3]), POSITION
        cells(group, 3)
        data = group.create_group("PointData")
        data["radius"], data["body_id"], data["clump_id"] = np.ones(3), IDS, np.array([-1, 4, 4])
        file.create_group("ONDEM/Scene").attrs["time"] = 0.25
        interactions(file.create_group("ONDEM/Interactions"), 1)
    return path


def draft_2(path):
    """As the exporter of the second one: blocks, a group for each type, positive forces pull."""
    with h5py.File(path, "w", track_order=True) as file:
        file.attrs["file_format_version"] = "0.2-draft"
        group = file.create_group("VTKHDF", track_order=True)
        group.attrs["Type"], group.attrs["Version"] = np.bytes_("MultiBlockDataSet"), [2, 5]
        group.create_group("Assembly")
        # the wall is a point without a radius
        blocks = {
            "grains": (POSITION[:2], IDS[:2], np.ones(2)),
            "others": (np.vstack([POSITION[2:], [[9, 9, 9]]]), [IDS[2], 1], [1.0, np.nan]),
        }
        for name, (points, ids, radius) in blocks.items():
            block = group.create_group(name, track_order=True)
            block.attrs["Type"], block.attrs["Version"] = np.bytes_("PolyData"), [2, 5]
            block["NumberOfPoints"], block["Points"] = np.array([2]), points
            cells(block, 2)
            data = block.create_group("PointData")
            data["radius"], data["body_id"] = np.array(radius), np.array(ids)
            group["Assembly"][name] = h5py.SoftLink(f"/VTKHDF/{name}")
        spheres = file.create_group("ONDEM/Bodies/sphere")
        spheres["body_id"], spheres["clump_id"] = IDS[::-1], np.array([4, 4, -1])
        file.create_group("ONDEM/Scene").attrs["time"] = 0.25
        interactions(file.create_group("ONDEM/Interactions/frict_phys"), -1)
    return path
