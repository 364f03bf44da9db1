"""The fabric table: one row for each frame and variant, with the columns that scripts rely on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, overload

import numpy as np
import numpy.typing as npt

__all__ = ["COLUMNS", "MEANINGS", "Row", "Table"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Row:
    """One frame and variant; None is a value that does not exist. Lengths in the dump's unit."""

    source: str
    frame: int
    step: int | None
    time: float | None
    strain: float | None
    variant: str
    grains: int
    rattlers: int
    contacts: int
    contacts_from: str
    coordination: float | None
    solid_fraction: float | None
    directions: int | None
    replicates: int | None
    lines: int | None
    segments: int | None
    spacing: float | None
    cutoff: float | None
    mean_length: float | None
    gvs_xx: float | None
    gvs_yy: float | None
    gvs_zz: float | None
    gvs_xy: float | None
    gvs_xz: float | None
    gvs_yz: float | None
    alpha_vs: float | None
    alpha_vs_axial: float | None
    alpha_vs_axial_se: float | None
    gc_xx: float | None
    gc_yy: float | None
    gc_zz: float | None
    gc_xy: float | None
    gc_xz: float | None
    gc_yz: float | None
    alpha_c: float | None
    alpha_c_axial: float | None
    alpha_c_axial_se: float | None
    alpha_vs_axial_sample_se: float | None
    alpha_c_axial_sample_se: float | None
    alpha_vs_axial_without_1: float | None
    alpha_vs_axial_without_2: float | None
    alpha_vs_axial_without_3: float | None
    alpha_vs_axial_without_4: float | None
    alpha_vs_axial_without_5: float | None
    alpha_vs_axial_without_6: float | None
    alpha_vs_axial_without_7: float | None
    alpha_vs_axial_without_8: float | None
    alpha_c_axial_without_1: float | None
    alpha_c_axial_without_2: float | None
    alpha_c_axial_without_3: float | None
    alpha_c_axial_without_4: float | None
    alpha_c_axial_without_5: float | None
    alpha_c_axial_without_6: float | None
    alpha_c_axial_without_7: float | None
    alpha_c_axial_without_8: float | None
    gvs_axis_x: float | None
    gvs_axis_y: float | None
    gvs_axis_z: float | None
    gc_axis_x: float | None
    gc_axis_y: float | None
    gc_axis_z: float | None
    coaxiality_deg: float | None
    shear_strain: float | None
    alpha_vs_axial_half_1: float | None
    alpha_vs_axial_half_2: float | None
    alpha_vs_axial_half_3: float | None
    alpha_vs_axial_half_4: float | None
    alpha_vs_axial_half_5: float | None
    alpha_vs_axial_half_6: float | None
    alpha_vs_axial_half_7: float | None
    alpha_vs_axial_half_8: float | None


COLUMNS: tuple[str, ...] = tuple(field.name for field in fields(Row))

MEANINGS: dict[str, str] = {
    "source": "the series as given: folder, file, or the files' common folder",
    "frame": "index in the series, from 0",
    "step": "of the dump",
    "time": "of the dump",
    "strain": "axial strain 1 - L/L0 along the loading axis, positive in compression",
    "variant": "a whole sample, b without rattlers, c RV, d RV without rattlers",
    "grains": "solid in this variant, centre in the window",
    "rattlers": "grains with too few contacts, centre in the window",
    "contacts": "contacts between grains that enter gc_*",
    "contacts_from": "file or geometric",
    "coordination": "mean number of contacts of the grains counted in grains, boundary's included",
    "solid_fraction": "of this variant's solids in the RV or periodic cell; else empty",
    "directions": "axes of the direction rule, in each replicate",
    "replicates": "number of replicates",
    "lines": "scan lines that meet the window (for the whole: any solid)",
    "segments": "void segments kept",
    "spacing": "distance between neighbouring lines of one direction, all replicates together",
    "cutoff": "shortest void segment kept",
    "mean_length": "mean length of the kept segments, Σ w·sum / Σ w·count",
    "gvs_xx": "void fabric tensor, trace 1",
    "gvs_yy": "likewise",
    "gvs_zz": "likewise",
    "gvs_xy": "likewise",
    "gvs_xz": "likewise",
    "gvs_yz": "likewise",
    "alpha_vs": "largest minus smallest principal value of the void fabric",
    "alpha_vs_axial": "signed anisotropy of the void fabric along the loading axis",
    "alpha_vs_axial_se": "its standard error from the scan, by the scatter of the replicates",
    "gc_xx": "contact fabric tensor, trace 1",
    "gc_yy": "likewise",
    "gc_zz": "likewise",
    "gc_xy": "likewise",
    "gc_xz": "likewise",
    "gc_yz": "likewise",
    "alpha_c": "largest minus smallest principal value of the contact fabric",
    "alpha_c_axial": "signed anisotropy of the contact fabric along the loading axis",
    "alpha_c_axial_se": "its standard error if contacts were independent; too large by about half "
    "in relaxed dense packings",
    "alpha_vs_axial_sample_se": "the sample's own scatter, by a jackknife over eight octants",
    "alpha_c_axial_sample_se": "likewise",
    "alpha_vs_axial_without_1": "alpha_vs_axial without the segments of octant 1 (-x, -y, -z; for "
    "an oblique loading axis the octants are turned so that one of their axes lies along it)",
    "alpha_vs_axial_without_2": "likewise, octant 2, where x counts fastest",
    "alpha_vs_axial_without_3": "likewise",
    "alpha_vs_axial_without_4": "likewise",
    "alpha_vs_axial_without_5": "likewise",
    "alpha_vs_axial_without_6": "likewise",
    "alpha_vs_axial_without_7": "likewise",
    "alpha_vs_axial_without_8": "likewise",
    "alpha_c_axial_without_1": "alpha_c_axial without the contacts of octant 1",
    "alpha_c_axial_without_2": "likewise",
    "alpha_c_axial_without_3": "likewise",
    "alpha_c_axial_without_4": "likewise",
    "alpha_c_axial_without_5": "likewise",
    "alpha_c_axial_without_6": "likewise",
    "alpha_c_axial_without_7": "likewise",
    "alpha_c_axial_without_8": "likewise",
    "gvs_axis_x": "direction of the void fabric's largest principal value, a unit vector",
    "gvs_axis_y": "likewise",
    "gvs_axis_z": "likewise",
    "gc_axis_x": "direction of the contact fabric's largest principal value, a unit vector",
    "gc_axis_y": "likewise",
    "gc_axis_z": "likewise",
    "coaxiality_deg": "angle between these two directions, 0 to 90 degrees",
    "shear_strain": "of a cell that repeats along all its vectors, since the first frame: "
    "√(2/3 e:e) of the logarithmic strain's deviator e; else empty",
    "alpha_vs_axial_half_1": "alpha_vs_axial_without_1 is the mean of two replicates: half their "
    "difference, which tells compare the scan's noise in a slope",
    "alpha_vs_axial_half_2": "likewise",
    "alpha_vs_axial_half_3": "likewise",
    "alpha_vs_axial_half_4": "likewise",
    "alpha_vs_axial_half_5": "likewise",
    "alpha_vs_axial_half_6": "likewise",
    "alpha_vs_axial_half_7": "likewise",
    "alpha_vs_axial_half_8": "likewise",
}
"""What each column holds; lengths are in the dump's unit."""


class Table(Sequence[Row]):
    """
    The rows of a computation.

    ``table["alpha_vs"]`` is a column as an array (missing numbers are NaN), ``table[0]`` a row.
    """

    def __init__(self, rows: Iterable[Row]) -> None:
        self.rows = tuple(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    @overload
    def __getitem__(self, key: int) -> Row: ...
    @overload
    def __getitem__(self, key: slice) -> Table: ...
    @overload
    def __getitem__(self, key: str) -> npt.NDArray[Any]: ...
    def __getitem__(self, key: int | slice | str) -> Row | Table | npt.NDArray[Any]:
        if isinstance(key, str):
            if key not in COLUMNS:
                raise KeyError(f"no column {key!r}; the columns are {', '.join(COLUMNS)}")
            values = [getattr(row, key) for row in self.rows]
            text = any(isinstance(value, str) for value in values)
            return np.array(values if text else [np.nan if v is None else v for v in values])
        return Table(self.rows[key]) if isinstance(key, slice) else self.rows[key]

    def select(self, **wanted: Any) -> Table:
        """The rows whose columns have the given values, for instance ``variant="a"``."""
        return Table(
            row
            for row in self.rows
            if all(getattr(row, name) == value for name, value in wanted.items())
        )

    def __repr__(self) -> str:
        return f"Table({len(self)} rows)"
