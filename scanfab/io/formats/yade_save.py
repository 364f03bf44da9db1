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

from scanfab.base.errors import PackingError, ReadError, ScanfabWarning
from scanfab.base.lengths import MOST
from scanfab.base.typing import IntArray
from scanfab.io.files import first_bytes, unpacked
from scanfab.io.formats.columns import grain_table, whole_numbers
from scanfab.io.formats.join import join_ids, rows_of_ids
from scanfab.io.reader import GrainTable, ReadOptions, Snapshot
from scanfab.io.unpacking import Readable
from scanfab.packing.cell import Cell
from scanfab.packing.walls import ListedWallForces

STEP = re.compile(rb"<iter>\s*(\d{1,18})\s*</iter>")
TIME = re.compile(rb"<time>\s*([-+.\deE]+)\s*</time>")

# bytes that are parsed at a time; pieces without a new body or contact after which none will come,
# and inside one; how deep elements stand in one another
PIECE = 1 << 16
BARREN, BARREN_PART = 384, 128
DEPTH = 200

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
    scene = _Scene(path)
    scene.read()
    columns = {
        "id": np.array(scene.ids, dtype=np.float64),
        "mask": np.array(scene.masks, dtype=np.float64),
        "position": np.array(scene.centres, dtype=np.float64).reshape(-1, 3),
        "radius": np.array(scene.radii, dtype=np.float64),
    }
    if max(scene.clumps, default=-1.0) >= 0:
        columns["clumpId"] = np.array(scene.clumps, dtype=np.float64)
    grains = grain_table(path, columns, scene.cell(), options)
    pairs = whole_numbers(path, np.array(scene.pairs, dtype=np.float64).ravel()).reshape(-1, 2)
    image = whole_numbers(path, np.array(scene.images, dtype=np.float64).ravel()).reshape(-1, 3)
    unknown = ~np.isin(pairs, scene.bodies)
    if unknown.any():
        raise ReadError(f"{path}: a contact names the body {pairs[unknown][0]}, which is not there")
    # contacts of walls with walls are not ours
    ours = np.isin(pairs, scene.ids).any(axis=1)
    force = None
    if 0 < len(scene.forces) < len(pairs):
        lacking = f"{len(pairs) - len(scene.forces)} of {len(pairs)} contacts"
        warnings.warn(
            f"{path}: {lacking} have no normalForce and shearForce: all forces are left out",
            ScanfabWarning,
            stacklevel=2,
        )
    if len(scene.forces) == len(pairs):
        force = np.array(scene.forces, dtype=np.float64).reshape(-1, 3)[ours]
    if grains.cell is None or not grains.cell.is_periodic:
        joined = join_ids(path, grains, pairs[ours], force, walls=True)
    else:
        joined = join_ids(path, grains, pairs[ours], force, walls=True, image=image[ours])
    return grains._replace(
        contacts=joined.contacts,
        wall_contacts=joined.wall_contacts,
        wall_forces=_wall_forces(scene, pairs, grains),
    )


def _wall_forces(scene: _Scene, pairs: IntArray, grains: GrainTable) -> ListedWallForces | None:
    """Of contacts between a sphere and what is none; None if their points or forces are missing."""
    rows = rows_of_ids(grains, pairs)
    first, second = (rows >= 0).T
    at = first != second
    if not at.any() or len(scene.forces) != len(pairs) or len(scene.points) != len(pairs):
        return None
    # forces are those on the second body
    force = np.where(second, 1.0, -1.0)[:, None] * np.array(scene.forces).reshape(-1, 3)
    point = np.array(scene.points).reshape(-1, 3)
    return ListedWallForces(rows.max(axis=1)[at], point[at], force[at])


@dataclass
class _Scene:
    """What is read of a simulation, element by element: it never stands in memory as a whole."""

    path: Path
    bodies: list[float] = field(default_factory=list)
    """Ids of all bodies, of spheres and of walls."""
    ids: list[float] = field(default_factory=list)
    masks: list[float] = field(default_factory=list)
    clumps: list[float] = field(default_factory=list)
    """The clump of each sphere; -1 if it stands alone."""
    centres: list[list[float]] = field(default_factory=list)
    radii: list[float] = field(default_factory=list)
    pairs: list[list[float]] = field(default_factory=list)
    images: list[list[float]] = field(default_factory=list)
    forces: list[list[float]] = field(default_factory=list)
    points: list[list[float]] = field(default_factory=list)
    """Where bodies touch, for those that are walls."""
    size: list[float] | None = None
    is_periodic: bool = False
    shapes: dict[str, str] = field(default_factory=dict)
    """Names of shapes by their class, which is spelled out once only."""

    def read(self) -> None:
        """Walk through the file."""
        try:
            with unpacked(self.path) as stream:
                self._walk(stream)
        except (ElementTree.ParseError, LookupError, ValueError, OverflowError) as error:
            raise ReadError(
                f"{self.path}: cannot be read as a simulation that YADE saved (O.save): {error}"
            ) from None

    def _walk(self, stream: Readable) -> None:
        """Parse piece by piece, as long as bodies or contacts come out of it."""
        found = barren = 0
        for inside in self._pieces(stream):
            known = len(self.bodies) + len(self.pairs)
            barren = barren + 1 if known == found else 0
            found = known
            if barren > (BARREN_PART if inside else BARREN):
                raise ValueError(f"no body and no contact in {barren * PIECE} bytes")

    def _pieces(self, stream: Readable) -> Iterator[bool]:
        """For each piece that was parsed, whether it ends inside a body or a contact."""
        parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(("start", "end"))
        above: list[ElementTree.Element] = []
        part: int | None = None
        while piece := stream.read(PIECE):
            parser.feed(piece)
            events: Iterator[Any] = parser.read_events()
            for event, element in events:
                if event == "start":
                    if part is None and _is_part(above, element):
                        part = len(above)
                    above.append(element)
                    continue
                above.pop()
                if part is None or part == len(above) or element.tag == "px":
                    self._take(above, element)
                if part is None or part == len(above):
                    part = None
                    if above:
                        # the parser holds on to it by the one above
                        del above[-1][:]
            if len(above) > DEPTH:
                raise ValueError(f"elements stand in one another {len(above)} deep")
            yield part is not None
        parser.close()

    def _take(self, above: list[ElementTree.Element], element: ElementTree.Element) -> None:
        """An element that is complete; ``above``: the elements that it stands in."""
        tag = element.tag
        if tag == "px" and element.find("iterMadeReal") is not None:
            # inside the first body that has it, as YADE writes it
            self._take_interaction(element)
            element.clear()
        elif tag == "px" and _tags(above[-2:]) == ["body", "item"]:
            self._take_body(element)
        elif tag == "isPeriodic" and _tags(above) == SCENE:
            self.is_periodic = (element.text or "").strip() == "1"
        elif tag == "hSize" and _tags(above) == [*SCENE, "cell", "px"]:
            self.size = [_number(element, f"m{row}{column}") for row, column in np.ndindex(3, 3)]

    def _take_body(self, body: ElementTree.Element) -> None:
        if body.find("id") is None:
            return  # erased
        self.bodies.append(_number(body, "id"))
        shape = body.find("shape/px")
        if shape is None or self._shape(shape) != "Sphere":
            return
        place = body.find("state/px/se3/position")
        if place is None:
            raise ValueError("a sphere has no position")
        self.ids.append(_number(body, "id"))
        self.masks.append(_number(body, "groupMask"))
        self.clumps.append(float(body.findtext("clumpId", "-1")))
        self.centres.append(_vector(place))
        self.radii.append(_number(shape, "radius"))

    def _shape(self, shape: ElementTree.Element) -> str:
        number = shape.get("class_id") or shape.get("class_id_reference") or ""
        name = shape.get("class_name")
        if name is not None:
            self.shapes[number] = name.rpartition("::")[2]
        return self.shapes.get(number, "")

    def _take_interaction(self, contact: ElementTree.Element) -> None:
        # YADE also keeps pairs that are near each other
        if _number(contact, "iterMadeReal") < 0:
            return
        shift = contact.find("cellDist")
        self.pairs.append([_number(contact, "id1"), _number(contact, "id2")])
        self.images.append([0.0] * 3 if shift is None else _vector(shift))
        geometry = contact.find("geom")
        points = [] if geometry is None else [*geometry.iter("contactPoint")]
        self.points += [_vector(point) for point in points[:1]]
        physics = contact.find("phys")
        parts = (
            [] if physics is None else [*physics.iter("normalForce"), *physics.iter("shearForce")]
        )
        if len(parts) == 2:
            self.forces.append(np.sum([_vector(part) for part in parts], axis=0).tolist())

    def cell(self) -> Cell | None:
        """The periodic cell, whose vectors are the columns of hSize."""
        if not self.is_periodic or self.size is None:
            return None
        vectors = np.array(self.size).reshape(3, 3).T
        if not np.all(np.abs(vectors) < MOST):
            return None
        try:
            return Cell(vectors)
        except PackingError as error:
            raise ReadError(f"{self.path}: {error}") from None


def _is_part(above: list[ElementTree.Element], element: ElementTree.Element) -> bool:
    """Whether an element is looked at as a whole, when it is complete."""
    tag = element.tag
    return tag == "hSize" or (tag == "px" and bool(above) and above[-1].tag == "item")


def _tags(elements: list[ElementTree.Element]) -> list[str]:
    return [element.tag for element in elements]


def _number(element: ElementTree.Element, name: str) -> float:
    text = element.findtext(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no <{name}>")
    return float(text)


def _vector(element: ElementTree.Element) -> list[float]:
    return [_number(element, name) for name in "xyz"]
