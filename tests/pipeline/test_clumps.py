"""Clumps from the dump to the table: what is counted, and what changes nothing."""

import numpy as np
import pytest

import scanfab
from scanfab import Packing, ScanfabWarning, Settings
from scanfab.pipeline.inspection import inspect_series
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic

SCAN = {"directions": 9, "spacing": "1rmin", "cutoff": "0.2rmin", "contact_tolerance": 0.02}
BOX = ((0, 4), (0, 4), (0, 4))


SPHERES = shaken_cubic(np.random.default_rng(0), 4)


def pillars(shift=0):
    """The body of each of 4 x 4 x 4 grains: two neighbours along z are one."""
    steps = np.arange(64)
    return 10 * (steps // 4) + (steps % 4) // 2 + shift


def series_of(tmp_path, *bodies, column="clump", leave=()):
    texts = []
    for step, numbers in enumerate(bodies):
        listed = zip(SPHERES.position.tolist(), SPHERES.radius.tolist(), numbers, strict=True)
        rows = [(k, 1, *place, *more) for k, (place, *more) in enumerate(listed, start=1)]
        rows = [row for row in rows if step == 0 or row[0] not in leave]
        texts.append(dump_text(rows, f"{NAMES} {column}", step=step, box=BOX))
    return scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))


def test_the_lines_know_nothing_of_bodies():
    """A union of spheres is a solid."""
    words = {"rv": 0.6, "variants": "ac", **SCAN}
    tables = (scanfab.compute(Packing(*SPHERES, bodies=one), **words) for one in (pillars(), None))
    for one, two in zip(*tables, strict=True):
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
def test_bodies_that_change_are_told(tmp_path, recwarn, bodies, leave, grains, told):
    series = series_of(tmp_path, *bodies, leave=leave)
    table = scanfab.compute(series, variants="a", **SCAN)
    texts = [str(one.message) for one in recwarn if issubclass(one.category, ScanfabWarning)]
    texts = [text for text in texts if "frames" not in text[:6] and "reach through" not in text]
    assert len(texts) == len(told)
    assert all(one in text for one, text in zip(told, texts, strict=True))
    assert table["grains"].tolist() == grains
