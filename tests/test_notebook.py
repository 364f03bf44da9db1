"""The public face as a notebook uses it: from arrays, or a series of dumps, to a figure."""

from __future__ import annotations

import inspect
import pydoc

import matplotlib.pyplot as plt
import numpy as np
import pytest

import scanfab
from scanfab.base.option import options_of
from tests.helpers.dumps import dump_text, write
from tests.helpers.lattices import shaken_cubic

SPHERES = shaken_cubic(np.random.default_rng(2), 6, overlap=1.05)
FAST = {"variants": "cd", "rv": 0.6, "tolerance": 2e-3}


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    """A sample that is compressed along z, in five frames."""
    folder = tmp_path_factory.mktemp("dumps")
    for number in range(5):
        position = SPHERES.position * [1, 1, 1 - 0.02 * number]
        rows = [
            (row, 1, *place, size)
            for row, (place, size) in enumerate(
                zip(position.tolist(), SPHERES.radius.tolist(), strict=True), start=1
            )
        ]
        write(folder / f"dump_{number}.txt", dump_text(rows, step=100 * number))
    return scanfab.read_series(folder)


def test_from_arrays_to_a_figure(tmp_path):
    packing = scanfab.Packing(SPHERES.position, SPHERES.radius)
    assert repr(packing).startswith("Packing: 216 particles")
    table = scanfab.compute(packing, **FAST)
    assert [row.variant for row in table] == ["c", "d"]

    assert "±" in repr(table)
    assert table._repr_html_().startswith("<table>")
    assert table.to_polars()["alpha_vs"].to_list() == table["alpha_vs"].tolist()
    tensor = table.tensor("gvs")
    assert tensor.shape == (2, 3, 3)
    np.testing.assert_allclose(np.trace(tensor, axis1=1, axis2=2), 1.0)

    figure, ax = plt.subplots()
    assert table.plot.evolution(ax=ax) is ax
    plt.close(figure)

    table.save(tmp_path / "fabric.json")
    assert scanfab.load(tmp_path / "fabric.json") == table


def test_from_a_series_to_a_slope(series, tmp_path):
    assert len(series) == 5
    assert series[-1].read().step == 400
    table = scanfab.compute(series, strain="grains", **FAST)
    found = table.compare()
    assert found.slope.shape == (2,)
    assert np.isfinite(found.slope).all()
    assert "slope" in repr(found)

    table.save(tmp_path / "fabric.csv")
    assert scanfab.load(tmp_path / "fabric.csv") == table

    part = scanfab.compute(series[2:], strain="grains", **FAST)
    assert part == scanfab.compute(series, frames="2:", strain="grains", **FAST)
    assert part.rows == tuple(row for row in table if row.frame >= 2)

    figure, (left, right) = plt.subplots(1, 2)
    assert table.plot.evolution(ax=left) is left
    assert table.plot.correlation(ax=right) is right
    plt.close(figure)


def test_to_pandas():
    table = scanfab.compute(scanfab.Packing(SPHERES.position, SPHERES.radius), **FAST)
    frame = table.to_pandas()
    assert list(frame["variant"]) == ["c", "d"]
    assert list(frame.columns) == list(table.names)


def test_help_of_compute_shows_every_option():
    shown = pydoc.render_doc(scanfab.compute, renderer=pydoc.plaintext)
    for option in options_of(scanfab.Settings):
        assert option.name in inspect.signature(scanfab.compute).parameters
        assert option.help[:40] in shown


def test_a_wrong_option_is_named_with_the_nearest_right_one(series):
    with pytest.raises(TypeError, match="did you mean 'variants'"):
        scanfab.compute(series, variant="c")
