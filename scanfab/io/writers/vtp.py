"""Packings as VTK's PolyData (``.vtp``): spheres as points, contacts as lines between them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from scanfab.io.writer import Left
from scanfab.io.written import own_columns, standard_columns
from scanfab.packing.packing import Packing

TYPES = {
    "i1": "Int8",
    "u1": "UInt8",
    "i2": "Int16",
    "u2": "UInt16",
    "i4": "Int32",
    "u4": "UInt32",
    "i8": "Int64",
    "u8": "UInt64",
    "f4": "Float32",
    "f8": "Float64",
}


class VtpWriter:
    """One PolyData piece; all numbers in their bytes behind the elements."""

    name = "vtp"
    description = "VTK PolyData: spheres as points, contacts as lines, the cell as field data"
    extensions = (".vtp",)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; it holds everything."""
        own, notes = own_columns(packing)
        points = {**standard_columns(packing), "radius": packing.radius, **own}
        contacts = packing.contacts
        count = 0 if contacts is None else len(contacts)
        cells: dict[str, npt.NDArray[Any]] = {}
        pairs = np.zeros((0, 2), np.int64)
        if contacts is not None:
            pairs = contacts.pairs
            ids = packing.id[pairs]
            cells = {"id1": ids[:, 0], "id2": ids[:, 1], "image": contacts.image}
            if contacts.force is not None:
                cells["force"] = contacts.force
            elif contacts.force_n is not None:
                cells["force_n"] = contacts.force_n
        file = _File()
        body = [
            f"<FieldData>{''.join(_field(packing))}</FieldData>",
            f'<Piece NumberOfPoints="{len(packing)}" NumberOfVerts="0" NumberOfLines="{count}" '
            'NumberOfStrips="0" NumberOfPolys="0">',
            file.section("PointData", points),
            file.section("CellData", cells),
            file.section("Points", {"Points": packing.position}),
            file.section(
                "Lines",
                {"connectivity": pairs.ravel(), "offsets": 2 * np.arange(1, count + 1)},
            ),
            "</Piece>",
        ]
        file.write(path, body)
        return Left(no_step=False, notes=tuple(notes))


def _field(packing: Packing) -> list[str]:
    """Step, time, cell, and whether contacts are known, as text in the head of the file."""
    found: list[tuple[str, str, int, list[Any]]] = []
    if packing.time is not None:
        found.append(("TimeValue", "Float64", 1, [packing.time]))
    if packing.step is not None:
        found.append(("scanfab_step", "Int64", 1, [packing.step]))
    if packing.cell is not None:
        cell = packing.cell
        vectors = [float(one) for one in cell.vectors.ravel()]
        found.append(("scanfab_cell", "Float64", 9, vectors))
        found.append(("scanfab_origin", "Float64", 3, [float(one) for one in cell.origin]))
        found.append(("scanfab_periodic", "Int64", 3, [int(one) for one in cell.periodic]))
    known = packing.contacts is not None
    found.append(("scanfab_contacts", "Int64", 1, [int(known)]))
    return [
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" '
        f'NumberOfTuples="{len(values) // width}" format="ascii">'
        f"{' '.join(map(repr, values))}</DataArray>"
        for name, kind, width, values in found
    ]


class _File:
    """Elements that name places in what is appended, and what is appended."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0

    def section(self, name: str, arrays: Mapping[str, npt.NDArray[Any]]) -> str:
        """A section of arrays."""
        return f"<{name}>{''.join(self._array(*one) for one in arrays.items())}</{name}>"

    def _array(self, name: str, values: npt.NDArray[Any]) -> str:
        if values.dtype.kind == "U":
            data = b"".join(str(one).encode() + b"\0" for one in values.ravel())
            kind = "String"
        else:
            plain = values.astype(np.uint8) if values.dtype.kind == "b" else values
            if plain.dtype.str[1:] not in TYPES:
                plain = plain.astype(np.float64)
            kind = TYPES[plain.dtype.str[1:]]
            data = np.ascontiguousarray(plain, plain.dtype.newbyteorder("<")).tobytes()
        width = int(np.prod(values.shape[1:]))
        place = self.size
        self.parts += [len(data).to_bytes(8, "little"), data]
        self.size += 8 + len(data)
        return (
            f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfComponents="{width}" '
            f'format="appended" offset="{place}"/>'
        )

    def write(self, path: Path, body: list[str]) -> None:
        """Put the file on the disk."""
        head = (
            '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" '
            'byte_order="LittleEndian" header_type="UInt64"><PolyData>\n'
        )
        with open(path, "wb") as stream:
            stream.write((head + "\n".join(body)).encode())
            stream.write(b'\n</PolyData><AppendedData encoding="raw">_')
            for part in self.parts:
                stream.write(part)
            stream.write(b"\n</AppendedData></VTKFile>\n")
