"""YADE's ``O.save`` as XML: the whole simulation, of which spheres, contacts and cell are read."""

from __future__ import annotations

import re
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.arrays import MOST
from scanfab.base.errors import PackingError, ReadError, ScanfabWarning
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import first_bytes, unpacked
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.packing.cell import Cell
from scanfab.packing.walls import ListedWallForces

STEP = re.compile(rb"<iter>\s*(\d{1,18})\s*</iter>")
TIME = re.compile(rb"<time>\s*(\d[-+.\deE]*)\s*</time>")

# bytes that are parsed at a time; elements without a body or contact after which none will come
# (32 bytes of the file count as one more element); and how deep elements stand in one another
PIECE, BARREN, DEPTH = 1 << 16, 500_000, 200

# where the scene's own values stand
SCENE = ["boost_serialization", "scene", "px"]


def is_save(path: Path) -> bool:
    """Whether a file is a simulation saved as XML."""
    return b"<boost_serialization" in first_bytes(path)


def is_binary_save(path: Path) -> bool:
    """Whether a file is a simulation saved as YADE's binary, which only the same build reads."""
    head = first_bytes(path, 64)
    return b"serialization::archive" in head and b"<" not in head


def snapshot_of_save(path: Path) -> Snapshot:
    """The one frame, with step and time."""
    head = first_bytes(path)
    step, time = STEP.search(head), TIME.search(head)
    try:
        seconds = None if time is None else float(time[1])
    except ValueError:
        seconds = None
    return Snapshot(path, step=None if step is None else int(step[1]), time=seconds)


def read_save(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """
    Spheres with their ids and masks, the cell, and the real interactions.

    Raises
    ------
    ReadError
        If the file is not as YADE writes it.
    """
    path = snapshot.path
    scene = _Scene()
    try:
        _walk(path, scene)
    except (ElementTree.ParseError, LookupError, ValueError, OverflowError) as error:
        raise ReadError(
            f"{path}: cannot be read as a simulation that YADE saved (O.save): {error}"
        ) from None
    spheres = np.array(scene.spheres, dtype=np.float64).reshape(-1, 7)
    id, mask, clump, radius = spheres[:, :4].T
    columns = {"id": id, "mask": mask, "position": spheres[:, 4:], "radius": radius}
    if np.any(clump >= 0):
        columns["clumpId"] = clump
    grains = grain_table(path, columns, _cell(path, scene), options)
    listed = np.array(scene.contacts, dtype=np.float64).reshape(-1, 11)
    pairs = whole_numbers(path, listed[:, :2].ravel()).reshape(-1, 2)
    unknown = ~np.isin(pairs, scene.bodies)
    if unknown.any():
        raise ReadError(f"{path}: a contact names the body {pairs[unknown][0]}, which is not there")
    # contacts of walls with walls are not ours
    ours = np.isin(pairs, id).any(axis=1)
    pairs, listed = pairs[ours], listed[ours]
    force: FloatArray | None = listed[:, 5:8]
    lacking = np.isnan(listed[:, 5])
    if 0 < np.count_nonzero(lacking) < len(lacking):
        warnings.warn(
            f"{path}: {np.count_nonzero(lacking)} of {len(lacking)} contacts have no normalForce "
            f"and shearForce: all forces are left out",
            ScanfabWarning,
            stacklevel=2,
        )
    if lacking.any():
        force = None
    image = None
    if grains.cell is not None and grains.cell.is_periodic:
        image = whole_numbers(path, listed[:, 2:5].ravel()).reshape(-1, 3)
    joined = join_ids(path, grains, pairs, force, walls=True, image=image)
    return grains._replace(
        contacts=joined.contacts,
        wall_contacts=joined.wall_contacts,
        wall_forces=_wall_forces(pairs, force, listed[:, 8:], grains),
    )


def _wall_forces(
    pairs: IntArray, force: FloatArray | None, point: FloatArray, grains: GrainTable
) -> ListedWallForces | None:
    """Of contacts between a sphere and a wall; None if their points or forces are missing."""
    rows = rows_of_ids(grains, pairs)
    first, second = (rows >= 0).T
    at = first != second
    if not at.any() or force is None or np.isnan(point).any():
        return None
    # forces are those on the second body
    own = np.where(second, 1.0, -1.0)[:, None] * force
    return ListedWallForces(rows.max(axis=1)[at], point[at], own[at])


def _cell(path: Path, scene: _Scene) -> Cell | None:
    """The periodic cell, whose vectors are the columns of hSize."""
    vectors = np.array(scene.size).reshape(-1, 3).T
    if not scene.is_periodic or vectors.shape != (3, 3) or not np.all(np.abs(vectors) < MOST):
        return None
    try:
        return Cell(vectors)
    except PackingError as error:
        raise ReadError(f"{path}: {error}") from None


@dataclass
class _Scene:
    """What is read of a simulation."""

    bodies: list[float] = field(default_factory=list)
    """Ids of all bodies, of spheres and of walls."""
    spheres: list[list[float]] = field(default_factory=list)
    """Id, mask, clump (-1 if it stands alone), radius and centre of each."""
    contacts: list[list[float]] = field(default_factory=list)
    """Two ids, the image, the force and the point of each; NaN for what the file lacks."""
    size: list[float] = field(default_factory=list)
    is_periodic: bool = False
    shapes: dict[str, str] = field(default_factory=dict)
    """Names of shapes by their class, which is spelled out once only."""


def _walk(path: Path, scene: _Scene) -> None:
    """Go through the elements; the file never stands in memory as a whole."""
    parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(("start", "end"))
    above: list[ElementTree.Element] = []
    # how deep the body or contact stands that is read, and how many elements came without any
    part: int | None = None
    barren = 0
    with unpacked(path) as stream:
        while piece := stream.read(PIECE):
            parser.feed(piece)
            barren += PIECE // 32
            events: Iterator[Any] = parser.read_events()
            for event, element in events:
                if event == "start":
                    is_item = element.tag == "px" and above and above[-1].tag == "item"
                    if part is None and (is_item or element.tag == "hSize"):
                        part = len(above)
                    above.append(element)
                    continue
                above.pop()
                barren += 1
                if part is None or part == len(above) or element.tag == "px":
                    barren = 0 if _take(scene, above, element) else barren
                if part is None or part == len(above):
                    part = None
                    if above:
                        # the parser holds on to it by the one above
                        del above[-1][:]
            if len(above) > DEPTH:
                raise ValueError(f"elements stand in one another {len(above)} deep")
            if barren > BARREN:
                raise ValueError("no body and no contact in half a million elements")
    parser.close()


def _take(scene: _Scene, above: list[ElementTree.Element], element: ElementTree.Element) -> bool:
    """Read a complete element, which stands in those above; whether it is a body or contact."""
    tags = [one.tag for one in above]
    if element.tag == "px" and element.find("iterMadeReal") is not None:
        # inside the first body that has it, as YADE writes it
        _take_contact(scene, element)
        element.clear()
        return True
    if element.tag == "px" and tags[-2:] == ["body", "item"]:
        _take_body(scene, element)
        return True
    if element.tag == "isPeriodic" and tags == SCENE:
        scene.is_periodic = (element.text or "").strip() == "1"
    elif element.tag == "hSize" and tags == [*SCENE, "cell", "px"]:
        scene.size = [_number(element, f"m{row}{column}") for row, column in np.ndindex(3, 3)]
    return False


def _take_body(scene: _Scene, body: ElementTree.Element) -> None:
    if body.find("id") is None:
        return  # erased
    scene.bodies.append(_number(body, "id"))
    shape, place = body.find("shape/px"), body.find("state/px/se3/position")
    if shape is None:
        return
    number = shape.get("class_id") or shape.get("class_id_reference") or ""
    if "class_name" in shape.attrib:
        scene.shapes[number] = shape.attrib["class_name"].rpartition("::")[2]
    if scene.shapes.get(number) != "Sphere":
        return
    if place is None:
        raise ValueError("a sphere has no position")
    own = [_number(body, "id"), _number(body, "groupMask"), float(body.findtext("clumpId", "-1"))]
    scene.spheres.append([*own, _number(shape, "radius"), *_vector(place)])


def _take_contact(scene: _Scene, contact: ElementTree.Element) -> None:
    # YADE also keeps pairs that are near each other
    if _number(contact, "iterMadeReal") < 0:
        return
    shift = contact.find("cellDist")
    found = [next(contact.iter(one), None) for one in ("normalForce", "shearForce", "contactPoint")]
    normal, shear, point = ([np.nan] * 3 if one is None else _vector(one) for one in found)
    force = [one + other for one, other in zip(normal, shear, strict=True)]
    ids = [_number(contact, "id1"), _number(contact, "id2")]
    image = [0.0] * 3 if shift is None else _vector(shift)
    scene.contacts.append([*ids, *image, *force, *point])


def _number(element: ElementTree.Element, name: str) -> float:
    text = element.findtext(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no <{name}>")
    return float(text)


def _vector(element: ElementTree.Element) -> list[float]:
    return [_number(element, name) for name in "xyz"]
