"""Triangulated surfaces of windows: .vtp by VTK, all others by meshio, both in the worker."""

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
    The points of a surface, (N, 3), and its triangles, rows of points, (T, 3).

    Polygons are cut into triangles about their first corner, as the faces of convex bodies can be.

    Raises
    ------
    ReadError
        If the file is damaged, or of another format.
    """
    is_vtp = path.suffix.lower() == ".vtp"
    points, faces = fenced(faces_in_worker if is_vtp else faces_by_meshio, path)
    if points.shape != (len(points), 3) or not np.all(np.isfinite(points)):
        raise ReadError(f"{path}: expected points of three finite numbers")
    if any(one.size and not 0 <= one.min() <= one.max() < len(points) for one in faces):
        raise ReadError(f"{path}: its faces name points that do not exist")
    fans = [one[:, [0, k, k + 1]] for one in faces for k in range(1, one.shape[1] - 1)]
    return points, np.concatenate([np.zeros((0, 3), np.int64), *fans])


def faces_by_meshio(path: str) -> tuple[FloatArray, list[IntArray]]:
    """The points of a surface, and its faces, an array for each number of corners."""
    import meshio

    try:
        mesh = meshio.read(Path(path))
    except SystemExit:
        # it prints why, in the worker, and exits
        raise ValueError(f"it is no sound surface ({Path(path).suffix})") from None
    faces = [np.asarray(one.data, np.int64) for one in mesh.cells if one.dim == 2 and len(one.data)]
    return np.asarray(mesh.points, np.float64), faces
