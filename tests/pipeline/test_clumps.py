"""Clumps from the dump to the table, and the rule for rattlers by its name, also a made-up one."""

import numpy as np
import pytest

import scanfab
from scanfab import Packing, ScanfabWarning, Settings, SettingsError
from scanfab.packing import rattlers
from scanfab.pipeline.inspection import inspect_series
from scanfab.viz.scene import look_at
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.lattices import shaken_cubic, simple_cubic
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


@pytest.mark.usefixtures("made_up")
def test_a_rule_that_there_is_not_is_told_with_those_that_there_are():
    with pytest.raises(SettingsError, match="expected count, force, recursive or untouched, f"):
        Settings(rattlers="pressed")
