"""Columns declared as fields of a dataclass, and what is told of one that does not exist."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest

from scanfab.base.column import LENGTH, Column, NoColumnError, columns_of_fields, no_column
from scanfab.base.errors import ScanfabError


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


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("alpha_v", "there is no column 'alpha_v': did you mean alpha_vs?"),
        ("qqq", "there is no column 'qqq': the columns are frame, alpha_vs"),
        (3, "there is no column 3: the columns are frame, alpha_vs"),
    ],
)
def test_the_nearest_column_is_named(name, told):
    assert no_column(name, ["frame", "alpha_vs"]) == told


def test_the_error_is_caught_as_what_python_expects_and_speaks_without_quotes():
    error = NoColumnError("there is no column 'x'")
    assert isinstance(error, ScanfabError)
    assert isinstance(error, KeyError)
    assert isinstance(error, AttributeError)
    assert str(error) == "there is no column 'x'"
