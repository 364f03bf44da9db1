"""Which particles are boundary: expressions such as ``type=2`` or ``id>=13723`` on the columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import Note, SettingsError
from scanfab.base.typing import BoolArray
from scanfab.packing.packing import Packing

# A message lists at most so many values one by one.
MOST_LISTED = 10
# A column may name the boundary if it has no more classes, and the frame no fewer particles.
MOST_CLASSES, FEWEST = 20, 50
# Columns that sort particles into classes, by their names in lower case.
CLASS_COLUMNS = ("type", "mask", "material", "matid", "materialid", "mat", "group")


@dataclass(frozen=True)
class BoundaryRule:
    """
    One expression: column, operator, and value, list of values (``3,4``) or range (``100..200``).

    Examples
    --------
    >>> from scanfab import Packing
    >>> from scanfab.packing.boundary import BoundaryRule
    >>> packing = Packing([[0, 0, 0], [3, 0, 0]], 1.0, columns={"type": [1, 2]})
    >>> BoundaryRule.parse("type=2").select(packing)
    array([False,  True])
    """

    text: str
    column: str
    ranges: tuple[tuple[float, float], ...]
    """Smallest and largest value of each range."""
    is_negated: bool
    """Whether the rule selects the particles outside the ranges."""

    @classmethod
    def parse(cls, text: str) -> BoundaryRule:
        """Read an expression; SettingsError if the text is no expression."""
        match = re.fullmatch(r"\s*([^<>=!]+?)\s*(>=|<=|!=|==|=|>|<)\s*(.+?)\s*", text)
        try:
            if match is None:
                raise ValueError
            operator, ranges = match[2], tuple(_range(part) for part in match[3].split(","))
            if any(low > high for low, high in ranges):
                raise ValueError
            if operator[0] in "<>":
                ((value, same),) = ranges
                if value != same:
                    raise ValueError
                end = np.inf if operator[0] == ">" else -np.inf
                value = value if operator.endswith("=") else float(np.nextafter(value, end))
                ranges = ((min(value, end), max(value, end)),)
        except ValueError:
            raise SettingsError(
                f"boundary: expected COLUMN=VALUE, COLUMN=V1,V2, COLUMN=FROM..TO, or one of "
                f'> >= < <= !=, such as `boundary="id>=13723"`, found {text!r}'
            ) from None
        return cls(text, match[1], ranges, operator == "!=")

    def select(self, packing: Packing) -> BoolArray:
        """
        The particles for which the expression holds, shape (N,).

        Raises
        ------
        SettingsError
            If there is no such column, or some particles have no value in it.
        """
        if len(packing) == 0:
            return np.zeros(0, dtype=bool)  # an empty frame may have lost its columns
        values = _column(packing, self.column)
        gaps = np.isnan(values)
        if gaps.any():
            raise SettingsError(
                f"boundary: the column {self.column} has no value for {np.count_nonzero(gaps)} of "
                f"{len(gaps)} particles (the first is in row {np.argmax(gaps) + 1})"
            )
        within = [(values >= low) & (values <= high) for low, high in self.ranges]
        return np.asarray(np.any(within, axis=0) != self.is_negated)


def select_boundary(packing: Packing, rules: Sequence[BoundaryRule]) -> BoolArray:
    """
    The particles for which any of the expressions holds, shape (N,).

    Raises
    ------
    SettingsError
        If a column does not exist.
    """
    none = np.zeros(len(packing), dtype=bool)
    return np.asarray(np.any([none, *(rule.select(packing) for rule in rules)], axis=0))


def spelt_rules(rules: Sequence[BoundaryRule], packing: Packing) -> str:
    """Spell rules, and the values that a packing has in their columns."""
    named = " or ".join(rule.text for rule in rules)
    if len(packing) == 0:
        return f"{named}: there are no particles"
    told = []
    for name in dict.fromkeys(rule.column for rule in rules):
        found = [f"{value:g}" for value in np.unique(_column(packing, name))]
        is_short = len(found) <= MOST_LISTED
        told.append(f"{name} is {' or '.join(found) if is_short else f'{found[0]} to {found[-1]}'}")
    return f"{named}: {'; '.join(told)}"


def unnamed_boundary(packing: Packing) -> list[Note]:
    """
    A note on a class of particles that encloses the others, in a packing without a boundary.

    All its particles are farther from the centre than 98 % of the others. Distances are in half the
    sample's extents, and either Euclidean or the largest coordinate, for round or square samples.
    """
    classes: list[tuple[str, npt.NDArray[Any], npt.NDArray[Any]]] = []
    for name, values in packing.columns.items():
        if name.lower() in CLASS_COLUMNS and values.ndim == 1 and values.dtype.kind in "iuf":
            # a side column may have gaps
            found = np.unique(values[values == values])
            classes += [(name, values, found)] if 2 <= found.size <= MOST_CLASSES else []
    if len(packing) < FEWEST or not classes:
        return []
    low, high = packing.position.min(axis=0), packing.position.max(axis=0)
    scaled = (packing.position - 0.5 * (low + high)) / np.maximum(high - low, 1e-300)
    distances = np.linalg.norm(scaled, axis=1), np.abs(scaled).max(axis=1)
    for name, values, found in classes:
        for value in found:
            inside = values != value
            if any(d[~inside].min() > np.quantile(d[inside], 0.98) for d in distances):
                named = f"{name}={value:g}"
                text = f"the particles with {named} enclose the others: if they are a boundary, "
                return [Note("unnamed_boundary", f'{text}name them: `boundary="{named}"`')]
    return []


def _range(text: str) -> tuple[float, float]:
    low, dots, high = text.partition("..")
    if not dots:
        return float(text), float(text)
    return float(low) if low.strip() else -np.inf, float(high) if high.strip() else np.inf


def _column(packing: Packing, name: str) -> npt.NDArray[Any]:
    """A column of numbers by name; id, radius and coordinates included."""
    known: dict[str, npt.NDArray[Any]] = {
        "id": packing.id,
        "radius": packing.radius,
        **dict(zip("xyz", packing.position.T, strict=True)),
    }
    for other, values in packing.columns.items():
        if values.ndim == 1:
            known.setdefault(other, values)
    if name not in known:
        raise SettingsError(
            f"boundary: there is no column {name!r}; the columns are {', '.join(known)}"
        )
    if known[name].dtype.kind not in "iufb":
        raise SettingsError(f"boundary: the column {name!r} does not hold numbers")
    return known[name]
