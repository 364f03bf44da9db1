"""Columns declared as fields of a dataclass, and what is told of one that does not exist."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scanfab.base.column import LENGTH, Column, NoColumnError, columns_of_fields


@dataclass
class Disc:
    name: Annotated[str, "what it is called"]
    radius: Annotated[float | None, "of its rim", LENGTH]
    corners: Annotated[list[list[float]] | None, "if it has any"]


def test_fields_are_columns_with_kind_unit_and_meaning():
    assert columns_of_fields(Disc) == (
        Column("name", str, "", "what it is called"),
        Column("radius", float, "length", "of its rim"),
        Column("corners", list, "", "if it has any"),
    )


def test_a_column_that_does_not_exist_is_told_without_quotes_with_those_that_do():
    error = NoColumnError(3, ["frame", "alpha_vs"])
    assert isinstance(error, KeyError)
    assert isinstance(error, AttributeError)
    assert str(error) == "there is no column 3: the columns are frame, alpha_vs"
