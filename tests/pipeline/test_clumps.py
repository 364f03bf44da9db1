"""Clumps from the dump to the table, of discs against a naive twin; and rules for rattlers."""

from itertools import product

import numpy as np
import pytest

import scanfab
from scanfab import Cell, ContactList, Packing, ScanfabWarning, Settings, find_contacts
from scanfab.packing import rattlers
from scanfab.pipeline.inspection import inspect_series
from scanfab.viz.scene import look_at
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic, simple_cubic
from tests.helpers.naive_bodies import NaiveBodies
from tests.helpers.plugins import offer

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


def test_boundary_bodies_are_no_grains(tmp_path):
    series = series_of(tmp_path, pillars())
    (row,) = scanfab.compute(series, boundary="id=1,5", variants="a", **SCAN)
    assert row.grains == 30
    (report,) = inspect_series(series, Settings(boundary="id=1,5"))
    assert (report.grains, report.boundary, report.clumps, report.spheres) == (30, 2, 30, 60)


CHANGES = [
    # other numbers of the same bodies are nothing to tell
    ((pillars(), pillars(shift=7)), (), [32, 32], []),
    # grains that leave are told once; of a clump a part of which stays, the rest is a grain
    (3 * (pillars(),), (1, 2, 5), [32, 31, 31], ["1: 31 grains of 61 spheres, where frame 0 has"]),
    ((pillars(), np.roll(pillars(), 1)), (), [32, 32], ["1: other spheres are one body"]),
]


@pytest.mark.parametrize(("bodies", "leave", "grains", "told"), CHANGES)
def test_bodies_that_change_are_told(tmp_path, recwarn, bodies, leave, grains, told):
    series = series_of(tmp_path, *bodies, leave=leave)
    table = scanfab.compute(series, variants="a", **SCAN)
    texts = [str(one.message) for one in recwarn if issubclass(one.category, ScanfabWarning)]
    texts = [text for text in texts if "frames" not in text[:6] and "reach through" not in text]
    assert len(texts) == len(told)
    assert all(one in text for one, text in zip(told, texts, strict=True))
    assert table["grains"].tolist() == grains


def test_the_lines_know_nothing_of_bodies():
    """A union of spheres is a solid."""
    words = {"rv": 0.6, "variants": "ac", **SCAN}
    tables = (scanfab.compute(Packing(*SPHERES, bodies=one), **words) for one in (pillars(), None))
    for one, two in zip(*tables, strict=True):
        assert (one.mean_length, one.alpha_vs_axial) == (two.mean_length, two.alpha_vs_axial)


LOOSE = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.1rmin", "variants": "ab"}
RADIUS = 0.55


@pytest.fixture
def series(tmp_path):
    """A block in which all grains touch three or more, on it a tail of two, and one alone."""
    random = np.random.default_rng(1)
    block = simple_cubic(4).position + random.uniform(-0.03, 0.03, (64, 3))
    places = [*block.tolist(), (0.5, 0.5, 4.55), (0.5, 0.5, 5.6), (3.5, 3.5, 5.2)]
    rows = [(k, 1, *place, RADIUS) for k, place in enumerate(places, start=1)]
    return scanfab.read_series(write(tmp_path / "dump.txt", dump_text(rows, box=((-1, 7),) * 3)))


def untouched(sample):
    """A made-up rule: only what nothing touches."""
    return sample.contact_numbers == 0


@pytest.fixture
def made_up(monkeypatch):
    offer(monkeypatch, "scanfab.rattlers", "untouched", lambda: untouched)
    rattlers.installed_rules.cache_clear()
    yield
    rattlers.installed_rules.cache_clear()


@pytest.mark.usefixtures("made_up")
@pytest.mark.parametrize(("rule", "expected"), [("count", 2), ("recursive", 3), ("untouched", 1)])
def test_tables_inspect_and_views_tell_the_rattlers_of_the_rule(series, rule, expected):
    whole, without = scanfab.compute(series, rattlers=rule, **LOOSE)
    assert whole.rattlers == without.rattlers == expected
    assert without.grains == whole.grains - expected == 67 - expected
    # the one alone has no contact, the tail has two
    assert without.contacts == whole.contacts - (expected - 1)
    assert without.coordination == pytest.approx(2 * without.contacts / without.grains)
    assert without.solid_fraction is None
    assert without.alpha_vs_axial is not None

    settings = Settings(rattlers=rule, variants="c")
    assert next(inspect_series(series, settings)).rattlers == expected
    assert look_at(series, settings).scene.grains.rattler.sum() == expected


# clumps of discs in a cell that leans, with all rules at once, against naive ways to count

VECTORS = np.array([[11.0, 0, 0], [4.0, 10.0, 0], [0, 0, 50.0]])
AREA = 11.0 * 10.0
CLUMPS = 30


def random_clumps(random):
    """Bodies of one to four discs, with a force on each contact; and their twin."""
    number = random.permutation(np.repeat(np.arange(CLUMPS), random.integers(1, 5, CLUMPS)))
    centre = random.random((CLUMPS, 2)) @ VECTORS[:2, :2]
    places = centre[number] + random.normal(0, 0.45, (len(number), 2))
    radius = random.uniform(0.3, 0.7, len(number))
    bare = find_contacts(Packing(places, radius, bodies=number, cell=Cell(VECTORS)))
    pairs, image, normal = bare.contacts.pairs, bare.contacts.image, bare.contacts.normal
    size = random.exponential(1.0, (len(pairs), 1)) - 0.1
    across = np.cross(normal, [0, 0, 1.0]) * random.normal(0, 0.2, (len(pairs), 1))
    packing = bare.with_contacts(ContactList(pairs, image, size * normal + across))
    return packing, NaiveBodies(packing.position, radius, number, VECTORS, dimension=2)


def branches_of(packing, twin):
    """Of each contact, from body to body."""
    contacts = packing.contacts
    apart = [twin.place(two) - twin.place(one) for one, two in contacts.pairs]
    return np.array(apart) + contacts.image @ VECTORS


def pressing_neighbours(packing, twin, least):
    """Of each body the number of neighbours that press on it, at however many points."""
    contacts, met = packing.contacts, set()
    presses = contacts.force_n > least * contacts.force_n.mean()
    branches = branches_of(packing, twin)[presses]
    for (one, two), apart in zip(contacts.pairs[presses], branches, strict=True):
        one, two = twin.body[one], twin.body[two]
        if one > two:
            one, two, apart = two, one, -apart
        met.add((one, two, *(np.round(apart, 6) + 0.0)))
    return np.bincount([body for one in met for body in one[:2]], minlength=CLUMPS)


def solid_area(packing, twin, steps=300):
    """Of all bodies, what discs of one body share once, on a fine grid."""
    at = (np.arange(steps) + 0.5) / steps
    points = np.stack(np.meshgrid(at, at, indexing="ij"), -1).reshape(-1, 2) @ VECTORS[:2, :2]
    found = 0
    for rows in twin.members:
        inside = np.zeros(len(points), bool)
        for row, shift in product(rows, product((-1, 0, 1), repeat=2)):
            place = packing.position[row, :2] + shift @ VECTORS[:2, :2]
            inside |= ((points - place) ** 2).sum(axis=1) < packing.radius[row] ** 2
        found += np.count_nonzero(inside)
    return found / len(points) * AREA


# where so few clumps are left, lines stay in channels and densities of contacts fall below 0
@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
def test_counts_areas_and_stress_are_those_of_the_twin():
    packing, twin = random_clumps(np.random.default_rng(1))
    words = {"rattlers": "force", "min_force": 0.2, "with_": "state,forces", "workers": 1}
    words |= {"spacing": 0.1, "directions": 12}
    whole, without = (scanfab.compute(packing, variants=name, **words)[0] for name in "ab")
    held = pressing_neighbours(packing, twin, 0.2) >= 2
    numbers = np.array(twin.numbers(np.zeros(len(packing), int)))
    assert whole.grains == CLUMPS
    assert whole.rattlers == np.count_nonzero(~held) > 3
    assert without.grains == np.count_nonzero(held)
    assert whole.contacts == twin.contacts
    assert whole.coordination == pytest.approx(numbers.mean())
    assert whole.coordination_mechanical == pytest.approx(numbers[numbers >= 2].mean())
    bodies = np.vectorize(twin.body.get)(packing.contacts.pairs)
    normal = packing.contacts.normal[held[bodies].all(axis=1)]
    assert without.contacts == len(normal)
    assert without.gc_xy == pytest.approx(np.mean(normal[:, 0] * normal[:, 1]))

    solid = solid_area(packing, twin)
    assert whole.void_ratio == pytest.approx((AREA - solid) / solid, rel=2e-3)
    moment = packing.contacts.force.T @ branches_of(packing, twin) / AREA
    stress = 0.5 * (moment + moment.T)
    found = whole.stress_xx, whole.stress_yy, whole.stress_xy
    np.testing.assert_allclose(found, (stress[0, 0], stress[1, 1], stress[0, 1]), rtol=1e-9)
    assert (whole.stress_zz, whole.stress_xz) == (0.0, 0.0)
    assert whole.p == pytest.approx(0.5 * np.trace(stress))
    assert whole.q == pytest.approx(stress[1, 1] - stress[0, 0])
