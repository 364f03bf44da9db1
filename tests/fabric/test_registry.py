"""A fabric of another package: its columns stand behind the own ones, in every kind of file."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import Column
from scanfab.fabric import registry
from scanfab.table import columns
from scanfab.table.columns import COLUMNS, complete_row
from scanfab.table.formats.registry import OWN_FORMATS
from scanfab.table.reading import read_rows
from scanfab.table.result_file import ResultFile
from tests.helpers.lattices import simple_cubic


class Cubic:
    """Σ n⁴ over contact normals, 1 for a simple cubic packing, and the longest mean length."""

    columns = (
        Column("c_fourth", float, "", "mean of x⁴ + y⁴ + z⁴ over the contact normals"),
        Column("vs_longest", float, "length", "longest mean length of any axis"),
    )

    def values(self, measured):
        mean = measured.length.sum(axis=0) / measured.segments.sum(axis=0)
        fourth = float(np.mean(np.sum(measured.normals**4, axis=1)))
        return {"c_fourth": fourth, "vs_longest": float(mean.max())}


@pytest.fixture
def cubic(monkeypatch):
    for module in (columns, "scanfab.pipeline.variant_columns"):
        target = module if isinstance(module, str) else module.__name__
        monkeypatch.setattr(f"{target}.installed_fabrics", lambda: {"cubic": Cubic()})


def test_there_are_no_others_as_a_rule():
    assert registry.installed_fabrics() == {}
    assert tuple(column.name for column in columns.table_columns()) == COLUMNS


@pytest.mark.usefixtures("cubic")
def test_its_columns_are_computed_and_stand_behind_the_own_ones():
    packing = scanfab.Packing(simple_cubic(5).position, 0.5)
    table = scanfab.compute(packing, variants="a", tolerance=0.05, contact_tolerance=1e-4)
    assert list(table[0])[-2:] == ["c_fourth", "vs_longest"]
    assert list(table[0])[:-2] == list(COLUMNS)
    assert table[0].c_fourth == pytest.approx(1.0)
    assert table[0].vs_longest > table[0].mean_length > 0


@pytest.mark.usefixtures("cubic")
@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_its_columns_are_written_and_read_back(tmp_path, suffix):
    path = tmp_path / f"t{suffix}"
    values = dict.fromkeys(COLUMNS) | {"frame": 0, "c_fourth": 0.5, "vs_longest": None}
    with ResultFile(path, scanfab.Row).writer({}) as writer:
        writer.write(complete_row(values))
    (row,) = read_rows(path)
    assert row == values


@pytest.mark.usefixtures("cubic")
def test_a_value_that_it_forgets_is_an_error():
    with pytest.raises(TypeError, match="a value for each column, None for none: vs_longest"):
        complete_row(dict.fromkeys(COLUMNS) | {"c_fourth": 0.5})
    with pytest.raises(TypeError, match="there is no column 'c_forth': did you mean c_fourth"):
        complete_row(dict.fromkeys(COLUMNS) | {"c_forth": 0.5, "vs_longest": None})
