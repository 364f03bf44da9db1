"""
The content of VTK files: which form a file has, and who reads it.

Text and plain bytes are read here, since whoever checks every count of a file has read it. HDF5 and
XDMF are left to their libraries, behind a fence.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.files import check_memory, file_inside, first_bytes, plain
from scanfab.io.parse.fence import fenced
from scanfab.io.parse.vtk_arrays import elements_of
from scanfab.io.parse.vtk_data import Cells, Content, FlawError, Mesh, joined, mesh_of
from scanfab.io.parse.vtk_hdf import content_of_hdf, form_of_hdf, is_hdf
from scanfab.io.parse.vtk_legacy import read_legacy
from scanfab.io.parse.vtk_xml import read_xml

# bytes for each of a file: its text, the words of a part of it, the numbers that they are
OF_TEXT = 4.0
# files that list the pieces of one frame
PIECES = ("PPolyData", "PUnstructuredGrid")
LEGACY = ("POLYDATA", "UNSTRUCTURED_GRID", "RECTILINEAR_GRID")
XML = ("PolyData", "UnstructuredGrid", "RectilinearGrid")


def form_of(path: Path) -> str | None:
    """``PolyData``, ``UNSTRUCTURED_GRID``, ``Xdmf``, ...: what the header says; None if no VTK."""
    head = first_bytes(path)
    if is_hdf(head):
        return form_of_hdf(path)
    if head.startswith(b"# vtk DataFile"):
        match = re.search(rb"^\s*DATASET\s+(\w+)", head, re.MULTILINE)
        return match[1].decode() if match else None
    match = re.search(rb"<VTKFile[^>]*\btype=[\"'](\w+)", head)
    if match:
        return match[1].decode()
    return "Xdmf" if re.search(rb"<Xdmf\b", head) else None


def read_mesh(path: Path, parts: Sequence[Path] = ()) -> Mesh:
    """
    Read a VTK file, or the pieces that it lists.

    Parameters
    ----------
    path : Path
        Of the file.
    parts : sequence of Path, optional
        Files with more of the same mesh, which come behind it.

    Raises
    ------
    ReadError
        If it is damaged, incomplete, or of another form.
    """
    with _named_flaws(path):
        return mesh_of(joined([_content(path), *map(_named_content, parts)]))


@contextmanager
def _named_flaws(path: Path) -> Iterator[None]:
    """Let what is wrong begin with the file."""
    try:
        yield
    except FlawError as flaw:
        raise ReadError(
            f"{path}: cannot be read as VTK: the file is damaged or incomplete: {flaw}"
        ) from None


def _content(path: Path) -> Content:
    head, form = first_bytes(path), form_of(path)
    if form is None:
        raise ReadError(f"{path}: expected a VTK file, found something else")
    if form in PIECES:
        return joined([_piece(one) for one in listed(path, "Piece", "Source")])
    if is_hdf(head):
        return content_of_hdf(path)
    if form == "Xdmf":
        return _content_of_xdmf(path)
    if form not in (*LEGACY, *XML):
        raise FlawError(f"a {form} holds neither grains nor contacts")
    check_memory(path, OF_TEXT * plain(path).stat().st_size)
    data = plain(path).read_bytes()
    if head.startswith(b"# vtk"):
        return read_legacy(data)
    return read_xml(data, lambda needed: check_memory(path, 3.0 * needed))


def _piece(path: Path) -> Content:
    if form_of(path) in PIECES:
        raise FlawError(f"its piece {path.name} lists pieces itself")
    return _named_content(path)


def _named_content(path: Path) -> Content:
    with _named_flaws(path):
        return _content(path)


def elements(path: Path) -> ElementTree.Element:
    """The elements of an XML file that lists others; ReadError if it is none."""
    check_memory(path, OF_TEXT * plain(path).stat().st_size)
    try:
        return elements_of(plain(path).read_bytes())
    except FlawError as flaw:
        raise ReadError(f"{path}: cannot be read as a list of VTK files: {flaw}") from None


def listed(path: Path, tag: str, key: str) -> list[Path]:
    """
    The files that an XML file names, such as ``<Piece Source="...">``, in its order.

    Raises
    ------
    ReadError
        If one is not below the folder of the file, or not there.
    """
    names = [one.attrib[key] for one in elements(path).iter(tag) if key in one.attrib]
    return [file_inside(path, name) for name in names]


def _content_of_xdmf(path: Path) -> Content:
    root = elements_of(plain(path).read_bytes())
    for item in root.iter():
        if item.get("Format", "").upper() in ("HDF", "BINARY"):
            file_inside(path, (item.text or "").strip().partition(":")[0])
        if "include" in item.tag.lower():
            raise FlawError("XDMF that includes other files is not read")
    found, _ = fenced("xdmf", plain(path), path)
    rows: dict[str, dict[str, object]] = {"point": {}, "cell": {}}
    for name, values in found.items():
        kind, slash, own = name.partition("/")
        if slash:
            flat = values.ndim == 2 and values.shape[1] == 1
            rows[kind][own] = values[:, 0] if flat else values
    ends = np.concatenate([np.zeros(1, np.int64), found["ends"]])
    cells = Cells("Cells", ends, found["named"], found["types"])
    return Content(found["points"], (cells,), rows["point"], rows["cell"], {})  # type: ignore[arg-type]


def read_bounds(path: Path) -> FloatArray | None:
    """
    Lower and upper bound of a grid along x, y and z, shape (3, 2); None if it has no points.

    Raises
    ------
    ReadError
        If it cannot be read at all.
    """
    with _named_flaws(path):
        points = _content(path).points
    if len(points) == 0:
        return None
    bounds: FloatArray = np.array([points.min(axis=0), points.max(axis=0)]).T
    return bounds


def read_faces(path: Path) -> tuple[FloatArray, list[IntArray]]:
    """
    The points of a surface, (N, 3), and its faces, an array for each number of corners.

    Raises
    ------
    ReadError
        If it cannot be read, or is no PolyData.
    """
    if form_of(path) != "PolyData":
        raise ReadError(f"{path}: expected a surface (PolyData), found something else")
    with _named_flaws(path):
        content = _content(path)
        mesh_of(content)  # checks that all fits together
    faces: list[IntArray] = []
    for cells in content.cells:
        corners = np.diff(cells.offsets)
        for count in np.unique(corners[corners > 2]) if cells.kind in ("Polys", "Strips") else ():
            first = cells.offsets[:-1][corners == count]
            named = cells.points[first[:, None] + np.arange(count)]
            if cells.kind == "Polys":
                faces.append(named)
            else:
                # three points in turn; the middle one of every second triangle comes last
                faces += [named[:, [k, k + 1 + k % 2, k + 2 - k % 2]] for k in range(count - 2)]
    return content.points, faces
