"""Triangulated surfaces from files: .vtp read here, all others by meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.files import check_memory
from scanfab.io.parse.fence import fenced
from scanfab.io.parse.vtk_mesh import read_faces

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
    if path.suffix.lower() == ".vtp":
        points, faces = read_faces(path)
    else:
        points, faces = _from_meshio(path)
    if points.shape != (len(points), 3) or not np.all(np.isfinite(points)):
        raise ReadError(f"{path}: expected points of three finite numbers")
    if any(one.size and not 0 <= one.min() <= one.max() < len(points) for one in faces):
        raise ReadError(f"{path}: its faces name points that do not exist")
    fans = [one[:, [0, k, k + 1]] for one in faces for k in range(1, one.shape[1] - 1)]
    return points, np.concatenate([np.zeros((0, 3), np.int64), *fans])


def _from_meshio(path: Path) -> tuple[FloatArray, list[IntArray]]:
    check_memory(path, 20.0 * path.stat().st_size)
    try:
        found, _ = fenced("surface", path, path, suffix=path.suffix.lower()[1:])
    except ReadError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise ReadError(f"{path}: cannot be read as a surface: {reason}") from error
    return found.pop("points"), list(found.values())
