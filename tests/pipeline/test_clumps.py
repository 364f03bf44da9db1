"""Clumps from the dump to the table: what is counted, and what changes nothing."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, Settings, find_contacts
from scanfab.pipeline.inspection import inspect_series
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic
from tests.helpers.truth import SAMPLE_DATA

SCAN = {"directions": 9, "spacing": "1rmin", "cutoff": "0.2rmin", "contact_tolerance": 0.02}
POURED = SAMPLE_DATA / "liggghts_clumps"
BOX = ((0, 4), (0, 4), (0, 4))


def heap(count=4):
    return shaken_cubic(np.random.default_rng(0), count)


def made(bodies):
    spheres = heap()
    return Packing(spheres.position, spheres.radius, bodies=bodies)


def pillars(shift=0):
    """The body of each of 4 x 4 x 4 grains: two neighbours along z are one."""
    steps = np.arange(64)
    return 10 * (steps // 4) + (steps % 4) // 2 + shift


def rows_of(bodies):
    spheres = heap()
    numbers = zip(spheres.position.tolist(), spheres.radius.tolist(), bodies, strict=True)
    return [(k, 1, *place, size, body) for k, (place, size, body) in enumerate(numbers, start=1)]


def series_of(tmp_path, *bodies, column="clump", leave=()):
    texts = []
    for step, numbers in enumerate(bodies):
        rows = [row for row in rows_of(numbers) if step == 0 or row[0] not in leave]
        texts.append(dump_text(rows, f"{NAMES} {column}", step=step, box=BOX))
    return scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))


@pytest.mark.parametrize("periodic", [False, True])
def test_bodies_of_one_sphere_each_give_the_same_rows(periodic):
    spheres = heap()
    cell = Cell([4.0, 4.0, 4.0]) if periodic else None
    given = {"position": spheres.position, "radius": spheres.radius, "cell": cell}
    number = np.random.default_rng(1).permutation(64)
    tables = [
        scanfab.compute(Packing(**given, bodies=bodies), rv=0.6, **SCAN).rows
        for bodies in (None, number, np.full(64, -1))
    ]
    assert tables[0] == tables[1] == tables[2]


def test_the_void_fabric_is_that_of_the_spheres():
    """The lines know nothing of bodies: a union of spheres is a solid."""
    clumps, spheres = (
        scanfab.compute(made(bodies), rv=0.6, variants="ac", **SCAN) for bodies in (pillars(), None)
    )
    for one, two in zip(clumps, spheres, strict=True):
        assert one.mean_length == two.mean_length
        assert one.alpha_vs_axial == two.alpha_vs_axial
        assert one.contacts < two.contacts
    assert (clumps[0].grains, spheres[0].grains) == (32, 64)


def test_the_table_counts_bodies_and_points():
    table = scanfab.compute(made(pillars()), rv=0.6, **SCAN)
    packing = find_contacts(made(None), 0.02)
    body = pillars()[packing.contacts.pairs]
    outer = body[body[:, 0] != body[:, 1]]
    neighbours = {tuple(sorted(pair)) for pair in outer.tolist()}
    ends = np.bincount(np.array(sorted(neighbours)).ravel(), minlength=200)[np.unique(pillars())]
    whole, without = table.select(variant="a")[0], table.select(variant="b")[0]
    assert (whole.grains, whole.contacts) == (32, len(outer))
    assert whole.coordination == pytest.approx(ends.mean())
    assert whole.rattlers == (ends < 2).sum()
    assert without.grains == 32 - whole.rattlers


def test_boundary_bodies_are_no_grains(tmp_path):
    series = series_of(tmp_path, pillars())
    (row,) = scanfab.compute(series, boundary="id=1,5", variants="a", **SCAN)
    assert row.grains == 30
    (report,) = inspect_series(series, Settings(boundary="id=1,5"))
    assert (report.grains, report.boundary, report.clumps, report.spheres) == (30, 2, 30, 60)


def test_other_numbers_of_the_same_bodies_are_nothing_to_tell(tmp_path):
    series = series_of(tmp_path, pillars(), pillars(shift=7))
    with warnings.catch_warnings():
        warnings.simplefilter("error", scanfab.ScanfabWarning)
        one, two = scanfab.compute(series, variants="a", **SCAN)
    assert (one.grains, one.contacts) == (two.grains, two.contacts)


def test_grains_that_leave_are_told_once(tmp_path):
    """With one of them a part of its clump stays: the rest is a grain."""
    series = series_of(tmp_path, *3 * [pillars()], leave=(1, 2, 5))
    with pytest.warns(scanfab.ScanfabWarning) as told:
        table = scanfab.compute(series, variants="a", **SCAN)
    (text,) = [str(one.message) for one in told]
    assert "frame 1: 31 grains of 61 spheres, where frame 0 has 32 grains of 64 spheres" in text
    assert table["grains"].tolist() == [32, 31, 31]


def test_spheres_that_change_their_body_are_told(tmp_path):
    series = series_of(tmp_path, pillars(), np.roll(pillars(), 1))
    with pytest.warns(scanfab.ScanfabWarning, match="frame 1: other spheres are one body"):
        scanfab.compute(series, variants="a", **SCAN)
