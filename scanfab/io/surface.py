"""Read triangulated surfaces of windows: .vtp by VTK, other formats by meshio, in the worker."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.fence import fenced
from scanfab.io.mesh import faces_in_worker

SUFFIXES = (".stl", ".vtp", ".ply", ".obj")


def read_surface(path: Path) -> tuple[FloatArray, IntArray]:
    """
    Read a surface: its points, shape (N, 3), and its triangles as rows of points, shape (T, 3).

    Polygons are cut into triangles that share their first corner, which is exact for convex ones.

    Raises
    ------
    ReadError
        If the file is damaged, or its format is not known.
    """
    is_vtp = path.suffix.lower() == ".vtp"
    points, faces = fenced(faces_in_worker if is_vtp else faces_by_meshio, path)
    if points.shape != (len(points), 3) or not np.all(np.isfinite(points)):
        raise ReadError(f"{path}: expected points of three finite numbers")
    if any(rows.size and not 0 <= rows.min() <= rows.max() < len(points) for rows in faces):
        raise ReadError(f"{path}: its faces name points that do not exist")
    fans = [corners[:, [0, k, k + 1]] for corners in faces for k in range(1, corners.shape[1] - 1)]
    return points, np.concatenate([np.zeros((0, 3), np.int64), *fans])


def faces_by_meshio(path: str) -> tuple[FloatArray, list[IntArray]]:
    """The points of a surface, and arrays of its faces: one array for each block of the file."""
    import meshio

    try:
        mesh = meshio.read(Path(path))
    except SystemExit:
        # meshio prints the reason, and exits
        raise ValueError(f"it is not a valid surface file ({Path(path).suffix})") from None
    blocks = [block for block in mesh.cells if block.dim == 2 and len(block.data)]
    faces = [np.asarray(block.data, np.int64) for block in blocks]
    return np.asarray(mesh.points, np.float64), faces
