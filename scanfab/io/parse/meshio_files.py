"""What meshio reads: XDMF, and surfaces in .stl, .ply and .obj; runs behind the fence."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

# VTK's numbers of the cells that may be grains or contacts; any other is a face or a solid
TYPES = {"vertex": 1, "line": 3}
OTHER = 7

Arrays = dict[str, npt.NDArray[Any]]


def read_xdmf(path: str) -> Arrays:
    """
    Points, cells and their arrays.

    ``points`` (N, 3), ``ends`` of the cells, the points that they have one behind the other
    (``named``), VTK's numbers of their ``types``; ``point/NAME`` and ``cell/NAME``.
    """
    import meshio

    with _silence():
        mesh = meshio.xdmf.read(path)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    blocks = [np.asarray(block.data) for block in mesh.cells]
    none = [np.zeros(0, np.int64)]
    found = {
        "points": points,
        "ends": np.cumsum(np.concatenate([*none, *(np.full(len(b), b.shape[1]) for b in blocks)])),
        "named": np.concatenate([*none, *(b.ravel().astype(np.int64) for b in blocks)]),
        "types": np.concatenate(
            [
                *none,
                *(np.full(len(b.data), TYPES.get(b.type, OTHER)) for b in mesh.cells),
            ]
        ),
    }
    found.update({f"point/{name}": np.asarray(v) for name, v in mesh.point_data.items()})
    found.update(
        {f"cell/{name}": np.concatenate(values) for name, values in mesh.cell_data.items()}
    )
    return {name: _plain(name, values) for name, values in found.items()}


def read_faces(path: str, suffix: str) -> Arrays:
    """The points of a surface, and its faces, an array ``face/K`` for each number of corners."""
    import meshio

    # the number of triangles that a text in place of binary STL seems to name is any
    with _silence(), np.errstate(over="ignore"):
        mesh = meshio.read(Path(path), file_format=suffix)
    faces = [block.data for block in mesh.cells if block.dim == 2 and len(block.data)]
    found = {f"face/{k}": np.asarray(one, np.int64) for k, one in enumerate(faces)}
    return {"points": np.asarray(mesh.points, np.float64), **found}


def _plain(name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if values.dtype.kind not in "biufU":
        raise ValueError(f"{name}: expected numbers, found {values.dtype}")
    return values


@contextlib.contextmanager
def _silence() -> Any:
    """Meshio prints, and exits for what it does not know."""
    nowhere = io.StringIO()
    with contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere):
        try:
            yield
        except SystemExit:
            raise ValueError("meshio cannot read it") from None
