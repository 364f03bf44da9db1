"""The answers that stand beside the dumps of sample_data, and what a packing says to compare."""

from pathlib import Path
from typing import Any

import numpy as np

SAMPLE_DATA = Path(__file__).parents[2] / "sample_data"
FLOOR = SAMPLE_DATA / "liggghts_formats" / "floor"
PERIODIC = SAMPLE_DATA / "liggghts_formats" / "periodic"
YADE = SAMPLE_DATA / "yade_formats"
TRIAXIAL = SAMPLE_DATA / "yade_triaxial"
BOX = SAMPLE_DATA / "liggghts_box"
CELL = SAMPLE_DATA / "liggghts_periodic"
SHEAR = SAMPLE_DATA / "lammps_shear"
# the meaning of the columns in its lists of pairs
OF_SHEAR = (
    "id1=c_ids[1],id2=c_ids[2],fx=c_pair[3],fy=c_pair[4],fz=c_pair[5],"
    "tx=c_pair[6],ty=c_pair[7],tz=c_pair[8]"
)

COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")

# rounding of numbers with six digits
SIX_DIGITS = 5.1e-6


def csv_rows(path: Path) -> Any:
    """A CSV file as an array with named columns."""
    return np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")


def id_pairs(packing) -> set[tuple[int, int]]:
    """The contacts of a packing by the grains' ids, the smaller first."""
    pairs = np.sort(packing.id[packing.contacts.pairs], axis=1)
    return {(int(one), int(two)) for one, two in pairs}


def true_pairs(truth) -> set[tuple[int, int]]:
    """The contacts of a truth file, the smaller id first."""
    pairs = np.sort(np.column_stack([truth["id1"], truth["id2"]]), axis=1)
    return {(int(one), int(two)) for one, two in pairs}


def vectors_by_pair(first_id, second_id, vectors) -> dict[tuple[int, int], np.ndarray]:
    """Vectors that point from the first id to the second, turned to point to the larger id."""
    return {
        (min(one, two), max(one, two)): np.asarray(vector if one < two else -vector)
        for one, two, vector in zip(first_id.tolist(), second_id.tolist(), vectors, strict=True)
    }


def centres(truth, prefix: str = "") -> np.ndarray:
    """The columns x y z of a truth file, or those of another vector, such as nx ny nz."""
    return np.column_stack([truth[f"{prefix}{axis}"] for axis in "xyz"])


def true_vectors(truth, prefix: str) -> dict[tuple[int, int], np.ndarray]:
    """A vector of each contact of a truth file, as ``vectors_by_pair`` turns them."""
    return vectors_by_pair(truth["id1"], truth["id2"], centres(truth, prefix))


def normals_by_pair(packing) -> dict[tuple[int, int], np.ndarray]:
    """Unit normals, towards the grain with the larger id."""
    ids = packing.id[packing.contacts.pairs]
    return vectors_by_pair(ids[:, 0], ids[:, 1], packing.contacts.normal)


def forces_by_pair(packing) -> dict[tuple[int, int], np.ndarray]:
    """Forces on the grain with the larger id."""
    ids = packing.id[packing.contacts.pairs]
    return vectors_by_pair(ids[:, 0], ids[:, 1], packing.contacts.force)


def assert_same_vectors(found, expected, *, atol: float) -> None:
    """The same pairs, and vectors that differ by no more than ``atol``."""
    assert set(found) == set(expected)
    keys = sorted(expected)
    np.testing.assert_allclose(
        [found[key] for key in keys], [expected[key] for key in keys], rtol=0, atol=atol
    )


def assert_true_contacts(packing, truth, *, normals=None, forces=None) -> None:
    """The pairs of a truth file; and its normals and forces, within these bounds."""
    assert packing.contacts.source == "file"
    assert len(packing.contacts) == len(truth)
    assert id_pairs(packing) == true_pairs(truth)
    if normals is not None:
        assert_same_vectors(normals_by_pair(packing), true_vectors(truth, "n"), atol=normals)
    if forces is not None:
        assert_same_vectors(forces_by_pair(packing), true_vectors(truth, "f"), atol=forces)


def lammps_fabric(packing) -> list[float]:
    """LAMMPS' compute fabric contact: 15/2 of the deviator of the mean of n n, xx to yz."""
    tensor = np.mean([np.outer(n, n) for n in packing.contacts.normal], axis=0)
    deviator = 7.5 * (tensor - np.eye(3) * np.trace(tensor) / 3)
    places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    return [deviator[place] for place in places]


def off_by(packing, position) -> np.ndarray:
    """How far the grains are from the given positions, nearest image."""
    branch = packing.position - position
    if packing.is_periodic:
        branch = branch + packing.cell.nearest_image(branch) @ packing.cell.vectors
    return np.abs(branch)


def branches(packing) -> np.ndarray:
    """From the first grain of each contact to the second, shape (M, 3)."""
    one, two = packing.contacts.pairs.T
    across = packing.contacts.image @ packing.cell.vectors
    return packing.position[two] - packing.position[one] + across
