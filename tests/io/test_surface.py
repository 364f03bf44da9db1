"""Surfaces from files: every format gives the same body, damaged files are told."""

import meshio
import numpy as np
import pytest
import pyvista

from scanfab import ScanfabError, polyhedron
from scanfab.io.surface import SUFFIXES, read_surface
from tests.helpers.windows import OF_A_BOX, corners_of_a_box

HALF = np.array([0.5, 1.0, 1.75])
CORNERS = np.array([3.0, 4.0, 5.0]) + corners_of_a_box(HALF)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)


def write(path, cells):
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
        write(path, OF_A_BOX)
    shape, center = polyhedron(*read_surface(path))
    assert center == pytest.approx([3.0, 4.0, 5.0])
    assert shape.high == pytest.approx(HALF)
    assert len(shape.planes) == 6


@pytest.mark.parametrize("suffix", [".vtp", ".ply", ".obj"])
def test_faces_of_four_corners_are_two_triangles_each(tmp_path, suffix):
    points, triangles = read_surface(write(tmp_path / f"box{suffix}", QUADS))
    assert triangles.shape == (12, 3)
    assert polyhedron(points, triangles)[0].volume == pytest.approx(8 * HALF.prod())


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_surface_or_ends_too_early_is_told(tmp_path, suffix):
    path = write(tmp_path / f"box{suffix}", OF_A_BOX)
    whole = path.read_bytes()
    parts = [whole[: int(share * len(whole))] for share in (0.2, 0.5, 0.8)]
    for content in (b"", b"hello\nworld\n", b"\x00\xff" * 300, *parts):
        path.write_bytes(content)
        with pytest.raises(ScanfabError):
            polyhedron(*read_surface(path))
