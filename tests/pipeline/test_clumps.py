"""Clumps from the dump to the table: what is counted, and what changes nothing."""

import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, ScanfabWarning, Settings, find_contacts
from scanfab.pipeline.inspection import inspect_series
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic
from tests.helpers.truth import SAMPLE_DATA

SCAN = {"directions": 9, "spacing": "1rmin", "cutoff": "0.2rmin", "contact_tolerance": 0.02}
POURED = SAMPLE_DATA / "liggghts_clumps"
BOX = ((0, 4), (0, 4), (0, 4))


SPHERES = shaken_cubic(np.random.default_rng(0), 4)


def made(bodies, **more):
    return Packing(*SPHERES, bodies=bodies, **more)


def pillars(shift=0):
    """The body of each of 4 x 4 x 4 grains: two neighbours along z are one."""
    steps = np.arange(64)
    return 10 * (steps // 4) + (steps % 4) // 2 + shift


def rows_of(bodies):
    numbers = zip(SPHERES.position.tolist(), SPHERES.radius.tolist(), bodies, strict=True)
    return [(k, 1, *place, size, body) for k, (place, size, body) in enumerate(numbers, start=1)]


def series_of(tmp_path, *bodies, column="clump", leave=()):
    texts = []
    for step, numbers in enumerate(bodies):
        rows = [row for row in rows_of(numbers) if step == 0 or row[0] not in leave]
        texts.append(dump_text(rows, f"{NAMES} {column}", step=step, box=BOX))
    return scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))


@pytest.mark.parametrize("cell", [None, Cell([4.0, 4.0, 4.0])])
def test_bodies_of_one_sphere_each_give_the_same_rows(cell):
    number = np.random.default_rng(1).permutation(64)
    one, *others = (
        scanfab.compute(made(bodies, cell=cell), rv=0.6, variants="bd", **SCAN)
        for bodies in (None, number, np.full(64, -1))
    )
    assert others == [one, one]


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
    # the lines know nothing of bodies: a union of spheres is a solid
    for one, two in zip(table, scanfab.compute(made(None), rv=0.6, **SCAN), strict=True):
        if one.variant in "ac":
            assert (one.mean_length, one.alpha_vs_axial) == (two.mean_length, two.alpha_vs_axial)


def test_boundary_bodies_are_no_grains(tmp_path):
    series = series_of(tmp_path, pillars())
    (row,) = scanfab.compute(series, boundary="id=1,5", variants="a", **SCAN)
    assert row.grains == 30
    (report,) = inspect_series(series, Settings(boundary="id=1,5"))
    assert (report.grains, report.boundary, report.clumps, report.spheres) == (30, 2, 30, 60)


@pytest.mark.parametrize(
    ("bodies", "leave", "grains", "told"),
    [
        # other numbers of the same bodies are nothing to tell
        ((pillars(), pillars(shift=7)), (), [32, 32], []),
        # grains that leave are told once; of a clump a part of which stays, the rest is a grain
        (
            3 * (pillars(),),
            (1, 2, 5),
            [32, 31, 31],
            ["1: 31 grains of 61 spheres, where frame 0 has 32 grains of 64 spheres"],
        ),
        ((pillars(), np.roll(pillars(), 1)), (), [32, 32], ["1: other spheres are one body"]),
    ],
)
def test_bodies_that_change_are_told(tmp_path, bodies, leave, grains, told):
    series = series_of(tmp_path, *bodies, leave=leave)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = scanfab.compute(series, variants="a", **SCAN)
    texts = [str(one.message) for one in caught if issubclass(one.category, ScanfabWarning)]
    texts = [text for text in texts if "frames" not in text[:6] and "reach through" not in text]
    assert len(texts) == len(told)
    assert all(one in text for one, text in zip(told, texts, strict=True))
    assert table["grains"].tolist() == grains
