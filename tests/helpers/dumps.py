"""Small dump files as the programs write them, for tests of readers and series."""

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabError
from tests.helpers.lattices import shaken_cubic

UNIT_BOX = ((0, 1), (0, 1), (0, 1))
NAMES = "id type x y z radius"
# three grains in a row; the first two touch, and the last two
ROWS = ((1, 1, 0.2, 0.5, 0.5, 0.1), (2, 1, 0.39, 0.5, 0.5, 0.1), (3, 2, 0.58, 0.5, 0.5, 0.1))
PAIRS = ((1, 2), (2, 3))


def dump_text(
    rows: Sequence[Sequence[object]] = ROWS,
    names: str = NAMES,
    *,
    step: int = 0,
    box: Sequence[Sequence[object]] = UNIT_BOX,
    flags: str = " ff ff ff",
    before: str = "",
    after: str = "",
    word: str = "ATOMS",
    separator: str = " ",
    end: str = " \n",
) -> str:
    """One snapshot of a text dump; ``before`` and ``after`` are items around TIMESTEP."""
    header = (
        f"{before}ITEM: TIMESTEP\n{step}\n{after}ITEM: NUMBER OF {word}\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS{flags}\n"
        + "".join(" ".join(map(str, bounds)) + "\n" for bounds in box)
        + f"ITEM: {word} {names} \n"
    )
    return header + "".join(separator.join(map(str, row)) + end for row in rows)


def binary_dump(
    rows: Sequence[Sequence[float]] = ROWS,
    *,
    names: str | None = None,
    step: int = 0,
    time: float | None = None,
    flags: Sequence[int] = (1, 1, 1, 1, 1, 1),
    tilt: Sequence[float] = (),
    blocks: int = 1,
) -> bytes:
    """One snapshot of a binary dump: of the new layout with names, else of the old one."""
    numbers = np.asarray(rows, dtype=np.float64)
    header = b""
    if names is not None:
        header = struct.pack("<q10sii", -10, b"DUMPCUSTOM", 1, 2)
    header += struct.pack("<qqi", step, len(rows), bool(len(tilt)))
    header += struct.pack("<6i", *flags)
    header += struct.pack(f"<6d{len(tilt)}d", 0, 1, 0, 1, 0, 1, *tilt)
    header += struct.pack("<i", numbers.shape[1])
    if names is not None:
        header += struct.pack("<i", 0) + (b"\0" if time is None else struct.pack("<bd", 1, time))
        header += struct.pack("<i", len(names)) + names.encode()
    header += struct.pack("<i", blocks)
    for part in np.array_split(numbers, blocks):
        header += struct.pack("<i", part.size) + part.astype("<f8").tobytes()
    return header


def cubic_rows(count: int = 4, squeeze: float = 1.0) -> list[tuple[object, ...]]:
    """Rows of count³ grains that nearly touch, in a cube with the edge ``count``."""
    packing = shaken_cubic(np.random.default_rng(0), count)
    position = packing.position * [1, 1, squeeze]
    numbers = zip(position.tolist(), packing.radius.tolist(), strict=True)
    return [(row, 1, *place, size) for row, (place, size) in enumerate(numbers, start=1)]


def local_text(rows: Sequence[Sequence[object]], *, step: int = 0, word: str = "ENTRIES") -> str:
    """One snapshot of a contact dump: the names of the columns say nothing."""
    width = len(rows[0]) if len(rows) else 3
    names = " ".join(f"c_con[{number}]" for number in range(1, width + 1))
    return dump_text(rows, names, step=step, word=word)


def pairs_text(pairs: Sequence[Sequence[int]] = PAIRS, *, step: int = 0) -> str:
    """A contact dump with ids, face flag and a force that pushes the first grain to -x."""
    return local_text([(*pair, 0, -1.5, 0, 0) for pair in pairs], step=step)


def write(path: Path, text: str) -> Path:
    """A text file, its line ends as they are."""
    path.write_bytes(text.encode())
    return path


def vtk_array(content: object = "", **words: object) -> str:
    """A DataArray of VTK's XML; by default of packed places."""
    words = {"type": "Float64", "NumberOfComponents": 3, "format": "binary", **words}
    named = " ".join(f'{name}="{value}"' for name, value in words.items())
    return f"<DataArray {named}>{content}</DataArray>"


def vtk_xml(path: Path, piece: str, content: str, kind: str = "PolyData", more: str = "") -> Path:
    """An XML file of VTK of one piece."""
    head = f'<VTKFile type="{kind}" version="0.1" byte_order="LittleEndian" {more}>'
    return write(path, f"{head}<{kind}><Piece {piece}>{content}</Piece></{kind}></VTKFile>")


def yade_spheres(path: Path, position, radius, **scalars) -> Path:
    """What YADE's VTKExporter writes for spheres, with all digits."""
    data = _scalars({"radius": radius, **scalars})
    return _polydata(path, position, f"\nPOINT_DATA {len(position)}\n{data}")


def yade_lines(path: Path, ends, vectors=None, **scalars) -> Path:
    """What YADE's VTKExporter writes for interactions: both centres, shape (M, 2, 3)."""
    ends = np.asarray(ends, dtype=float)
    count = len(ends)
    lines = "".join(f"2 {2 * line} {2 * line + 1}\n" for line in range(count))
    data = f"\nCELL_DATA {count}\n" if scalars or vectors else ""
    named = "".join(
        f"\nVECTORS {name} double\n" + _rows(values) for name, values in (vectors or {}).items()
    )
    rest = f"LINES {count} {3 * count}\n{lines}{data}{_scalars(scalars)}{named}"
    return _polydata(path, ends.reshape(-1, 3), rest)


def small_save(contacts: Sequence[tuple[int, int, Sequence[int], int]] | None = None) -> str:
    """
    What YADE's O.save writes as XML, reduced to what is read, for three spheres and a wall.

    The spheres have the ids 0 to 2 and stand in a row through the face of a tilted cell;
    ``contacts``: both ids, cellDist, iterMadeReal.
    """
    if contacts is None:
        contacts = ((0, 1, (0, 0, 0), 5), (2, 0, (1, 0, 0), 7), (1, 3, (0, 0, 0), 9))
    bodies = [_body(id, x, id == 0) for id, x in enumerate((0.1, 0.29, 0.92))] + [_wall(3)]
    intrs = "".join(_interaction(*contact) for contact in contacts)
    bodies[0] = bodies[0].replace("</px></item>", f"<intrs>{intrs}</intrs></px></item>")
    size = ((1.0, 0.25, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0))
    numbers = "".join(
        f"<m{row}{column}>{size[row][column]}</m{row}{column}>"
        for row in range(3)
        for column in range(3)
    )
    return (
        '<?xml version="1.0" encoding="UTF-8" standalone="yes" ?>\n'
        "<!DOCTYPE boost_serialization>\n"
        '<boost_serialization signature="serialization::archive" version="18">\n<scene><px>'
        "<iter>30</iter><time>1.5e-3</time><isPeriodic>1</isPeriodic>\n"
        f"<bodies><px><body><count>4</count>\n{''.join(bodies)}</body></px></bodies>\n"
        f"<cell><px><hSize>{numbers}</hSize></px></cell>\n"
        "</px></scene>\n</boost_serialization>\n"
    )


def _xyz(name: str, values: Sequence[object]) -> str:
    inner = "".join(f"<{axis}>{value}</{axis}>" for axis, value in zip("xyz", values, strict=True))
    return f"<{name}>{inner}</{name}>"


def _body(id: int, x: float, first: bool) -> str:
    # a class is named where it comes first
    named = 'class_id="62" class_name="yade::Sphere"' if first else 'class_id_reference="62"'
    return (
        f"<item><px><id>{id}</id><groupMask>{id + 1}</groupMask>"
        f"<state><px><se3>{_xyz('position', (x, 0.5, 0.5))}</se3></px></state>"
        f"<shape><px {named}><radius>0.1</radius></px></shape></px></item>\n"
    )


def _wall(id: int) -> str:
    return (
        f"<item><px><id>{id}</id><groupMask>1</groupMask>"
        f"<state><px><se3>{_xyz('position', (0, 0, 0))}</se3></px></state>"
        '<shape><px class_id="63" class_name="yade::Box"></px></shape></px></item>\n'
    )


def _interaction(one: int, two: int, shift: Sequence[int], real: int) -> str:
    return (
        f"<item><first>{two}</first><second><px><id1>{one}</id1><id2>{two}</id2>"
        f"<iterMadeReal>{real}</iterMadeReal><geom><px>{_xyz('normal', (1, 0, 0))}</px></geom>"
        f"<phys><px><NormPhys>{_xyz('normalForce', (2, 0, 0))}</NormPhys>"
        f"{_xyz('shearForce', (0, 3, 0))}</px></phys>{_xyz('cellDist', shift)}"
        "</px></second></item>\n"
    )


def _polydata(path: Path, position, rest: str) -> Path:
    head = "# vtk DataFile Version 3.0.\ncomment\nASCII\n\nDATASET POLYDATA\n"
    return write(path, f"{head}POINTS {len(position)} double\n{_rows(position)}{rest}")


def _rows(values) -> str:
    return "".join(" ".join(repr(float(x)) for x in row) + "\n" for row in values)


def _scalars(arrays) -> str:
    return "".join(
        f"\nSCALARS {name} double 1\nLOOKUP_TABLE default\n"
        + "".join(f"{float(value)!r}\n" for value in values)
        for name, values in arrays.items()
    )


def refuses(source, told: str, *, error: type[ScanfabError] = ReadError, **options) -> None:
    """Reading a file or series ends in an error with these words."""
    with pytest.raises(error, match=told):
        scanfab.read(source, **options)


def holds(found: object, **expected: object) -> None:
    """Each attribute of an object, or column of a packing, has this value, to the last bit."""
    for name, value in expected.items():
        own = getattr(found, name) if hasattr(found, name) else found.columns[name]
        np.testing.assert_array_equal(own, value, err_msg=name)
