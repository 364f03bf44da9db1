"""Clumps from the dump to the table: what is counted, and what changes nothing."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, Settings, find_contacts
from scanfab.cli.main import run
from scanfab.packing.groupings import Grouping, Groupings
from scanfab.packing.sample import Sample
from scanfab.pipeline.calibration import calibrate
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


def test_bodies_of_one_sphere_each_give_the_same_bytes(tmp_path):
    series_of(tmp_path, np.arange(64))
    words = ["--directions", "9", "--spacing", "1rmin", "--rv", "0.6", "--seed", "3"]
    found = []
    for name, more in [("one", []), ("two", ["--bodies", "id"]), ("three", ["--bodies", "id"])]:
        folder = tmp_path / name
        out = str(tmp_path / f"{name}.csv")
        vtk = ["--vtk", str(folder)]
        assert run(["compute", str(tmp_path / "dump.txt"), *words, *more, *vtk, "-o", out]) == 0
        files = sorted(p for p in folder.rglob("*") if p.is_file())
        found.append(((tmp_path / f"{name}.csv").read_bytes(), [p.read_bytes() for p in files]))
    assert found[0] == found[1] == found[2]


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


def test_inspect_and_calibrate_count_bodies(tmp_path):
    series = series_of(tmp_path, pillars())
    (report,) = inspect_series(series, Settings())
    assert (report.grains, report.clumps, report.spheres) == (32, 32, 64)
    assert not report.warnings
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = calibrate(series, variants="c", tolerance=0.1, cutoff="0.2rmin", max_chords=1e5)
    assert found.rows


def test_manifest_and_resume_know_the_column(tmp_path):
    series_of(tmp_path, pillars(), pillars(), column="c_b")
    out = tmp_path / "table.csv"
    words = ["compute", str(tmp_path / "dump.txt"), "--directions", "9", "--spacing", "1rmin"]
    words += ["--variants", "ab", "-o", str(out)]
    assert run([*words, "--bodies", "c_b"]) == 0
    manifest = json.loads((tmp_path / "table.csv.manifest.json").read_text())
    assert manifest["settings"]["bodies"] == "c_b"
    before = out.read_bytes()
    assert run([*words, "--bodies", "c_b", "--resume"]) == 0
    assert out.read_bytes() == before
    assert run([*words, "--resume"]) != 0
    assert out.read_bytes() == before


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


def test_groupings_are_told_apart_by_who_is_with_whom():
    ids = np.array([4, 9, 2, 7])
    one = Grouping(ids, np.array([4, 4, 2, 2]))
    other_order = Grouping(ids[::-1], np.array([7, 7, 9, 9]))
    split = Grouping(ids, np.array([4, 9, 4, 9]))
    groupings = Groupings()
    assert groupings.notes(0, one) == []
    assert groupings.notes(1, other_order) == []
    assert groupings.notes(2, None) == []
    assert [note.code for note in groupings.notes(3, split)] == ["other_bodies"]
    assert groupings.notes(4, split) == []


def test_a_sample_in_other_processes_gives_the_same_rows(tmp_path):
    from concurrent.futures import ProcessPoolExecutor

    series = series_of(tmp_path, pillars(), np.roll(pillars(), 1))
    with (
        ProcessPoolExecutor(1) as pool,
        pytest.warns(scanfab.ScanfabWarning, match="other spheres"),
    ):
        there = scanfab.compute(series, variants="a", executor=pool, workers=1, **SCAN)
    with pytest.warns(scanfab.ScanfabWarning, match="other spheres"):
        assert there.rows == scanfab.compute(series, variants="a", **SCAN).rows


def test_rattlers_by_force_come_from_the_dump():
    """LIGGGHTS' own forces: which clumps are pressed by fewer than two others, walls counted."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        series = scanfab.read_series(POURED)
        options = {"variants": "a", "frames": -1, "directions": 9, "spacing": "3rmin"}
        tables = {
            limit: scanfab.compute(series, rattlers="force", min_force=limit, **options)[0]
            for limit in (0.0, 0.5, 2.0)
        }
        count = scanfab.compute(series, **options)[0]
    found = [tables[limit].rattlers for limit in (0.0, 0.5, 2.0)]
    assert count.rattlers <= found[0] < found[1] < found[2]
    packing = series[-1].read()
    sample = Sample(packing, np.zeros(len(packing), bool))
    for limit, expected in zip((0.0, 0.5, 2.0), found, strict=True):
        assert loose_by_force(sample, limit) == expected


def loose_by_force(sample, limit):
    """One contact after the other."""
    contacts, head = sample.contacts, sample.packing.bodies.head
    mean = sum(contacts.force_n.tolist()) / len(contacts)
    others = {int(one): set() for one in head}
    for (one, two), force in zip(head[contacts.pairs].tolist(), contacts.force_n, strict=True):
        if force > limit * mean:
            others[one].add(two)
            others[two].add(one)
    walls = np.bincount(head, sample.packing.wall_contacts, len(head))
    return sum(len(held) + walls[one] < 2 for one, held in others.items())
