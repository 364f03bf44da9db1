"""The public face as a notebook uses it: from arrays, or a series of dumps, to a figure."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import scanfab
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.lattices import shaken_cubic

FAST = {"variants": "cd", "rv": 0.6, "tolerance": 2e-3}


def test_from_arrays_to_a_figure(tmp_path):
    spheres = shaken_cubic(np.random.default_rng(2), 6, overlap=1.05)
    table = scanfab.compute(scanfab.Packing(spheres.position, spheres.radius), **FAST)
    assert [row.variant for row in table] == ["c", "d"]
    assert "±" in repr(table)
    assert table._repr_html_().startswith("<table>")
    np.testing.assert_allclose(np.trace(table.tensor("gvs"), axis1=1, axis2=2), 1.0)
    assert list(table.to_pandas().columns) == list(table.to_polars().columns) == list(table.names)
    figure, ax = plt.subplots()
    assert table.plot.evolution(ax=ax) is ax
    plt.close(figure)
    table.save(tmp_path / "fabric.json")
    assert scanfab.load(tmp_path / "fabric.json") == table


def test_from_a_series_to_a_slope(tmp_path):
    """A sample that is compressed along z, in five frames."""
    for number in range(5):
        rows = cubic_rows(6, squeeze=1 - 0.02 * number)
        write(tmp_path / f"dump_{number}.txt", dump_text(rows, step=100 * number))
    series = scanfab.read_series(tmp_path)
    assert (len(series), series[-1].read().step) == (5, 400)
    table = scanfab.compute(series, strain="grains", **FAST)
    found = table.compare()
    assert np.isfinite(found.slope).tolist() == [True, True]
    part = scanfab.compute(series[2:], strain="grains", **FAST)
    assert part == scanfab.compute(series, frames="2:", strain="grains", **FAST)
    assert part.rows == tuple(row for row in table if row.frame >= 2)
    figure, ax = plt.subplots()
    assert table.plot.correlation(ax=ax) is ax
    plt.close(figure)
    with pytest.raises(TypeError, match="did you mean 'variants'"):
        scanfab.compute(series, variant="c")
