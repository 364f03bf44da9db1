"""A fabric of another package: its columns stand behind the own ones, in every kind of file."""

import re

import numpy as np
import pytest

import scanfab
from scanfab import Column, ScanfabError, ScanfabWarning
from scanfab.table import columns
from scanfab.table.columns import COLUMNS
from scanfab.table.formats import read_rows
from tests.helpers.lattices import simple_cubic
from tests.helpers.plugins import offer


class Cubic:
    """Σ n⁴ over contact normals, 1 for a simple cubic packing."""

    columns = (Column("c_fourth", float, "", "mean of x⁴ + y⁴ + z⁴ over the contact normals"),)

    def values(self, measured):
        return {"c_fourth": float(np.mean(np.sum(measured.normals**4, axis=1)))}


@pytest.fixture
def offered(monkeypatch):
    columns.installed_fabrics.cache_clear()
    yield lambda name, plugin: offer(monkeypatch, "scanfab.fabrics", name, lambda: plugin)
    columns.installed_fabrics.cache_clear()


def test_its_columns_are_computed_and_stand_behind_the_own_ones(offered):
    offered("cubic", Cubic())
    packing = scanfab.Packing(simple_cubic(5).position, 0.5)
    table = scanfab.compute(packing, variants="a", tolerance=0.05, contact_tolerance=1e-4)
    own, parts = list(COLUMNS[:-24]), list(COLUMNS[-24:])
    assert list(table[0]) == [*own, "c_fourth", *parts]
    assert all(re.search(r"_(without|half)_[1-8]$", name) for name in parts)
    assert table[0].c_fourth == pytest.approx(1.0)


class Foreign:
    """A fabric of another package that gives what a test says."""

    def __init__(self, values=None, name="foreign", kind=float):
        self.columns = (Column(name, kind, "", ""),)
        self.found = {name: 1.0} if values is None else values

    def values(self, measured):
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def computed():
    packing = scanfab.Packing(simple_cubic(4).position, 0.5)
    return scanfab.compute(packing, variants="a", tolerance=0.1, contact_tolerance=1e-4)


BROKEN = [
    (Foreign(name="alpha_vs"), "there is already a column 'alpha_vs'"),
    (Foreign(kind=list), "columns that hold int, float or str"),
]


@pytest.mark.parametrize(("plugin", "told"), BROKEN)
def test_a_broken_one_is_left_out_with_a_warning(offered, plugin, told):
    offered("bad", plugin)
    with pytest.warns(ScanfabWarning, match=f"fabric 'bad' of made-up cannot be loaded: .*{told}"):
        (row,) = computed()
    assert tuple(row) == COLUMNS
    assert row.alpha_vs < 0.5


def test_of_two_with_one_column_the_second_is_left_out(offered):
    offered("one", Foreign())
    offered("two", Foreign())
    with pytest.warns(ScanfabWarning, match="'two' of made-up .*already a column 'foreign'"):
        assert [one.name for one in columns.table_columns()].count("foreign") == 1


@pytest.mark.parametrize("value", [np.nan, -np.inf, None])
def test_a_value_that_is_not_finite_is_none(offered, tmp_path, value):
    offered("fabric", Foreign({"foreign": value}))
    computed().save(tmp_path / "t.json")
    assert read_rows(tmp_path / "t.json")[0]["foreign"] is None


WRONG = [
    ({}, r"expected a value for each of \['foreign'\], found {}"),
    ({"foreign": 1.0, "other": 2.0}, "expected a value for each .* 'other': 2.0"),
    ({"foreign": "high"}, "'fabric': TypeError"),
    ({"foreign": 1.5}, "foreign: expected int or None, found 1.5"),
    (ZeroDivisionError("by 0"), "'fabric': ZeroDivisionError: by 0"),
    (3, "'fabric': TypeError"),
]


@pytest.mark.parametrize(("values", "told"), WRONG)
def test_a_wrong_value_is_an_error_that_names_the_fabric(offered, values, told):
    fabric = Foreign({"foreign": 1}, kind=int)
    fabric.found = values
    offered("fabric", fabric)
    with pytest.raises(ScanfabError, match=told):
        computed()
