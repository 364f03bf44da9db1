"""The rule for rattlers, chosen by name: a made-up one of another package, too."""

import numpy as np
import pytest

import scanfab
from scanfab import Settings, SettingsError
from scanfab.packing import rattlers
from scanfab.pipeline.inspection import inspect_series
from scanfab.viz.scene import look_at
from tests.helpers.dumps import dump_text, write
from tests.helpers.lattices import simple_cubic
from tests.helpers.plugins import offer

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.1rmin", "variants": "ab"}
RADIUS = 0.55


@pytest.fixture
def series(tmp_path):
    """A block in which all grains touch three or more, on it a tail of two, and one alone."""
    random = np.random.default_rng(1)
    block = simple_cubic(4).position + random.uniform(-0.03, 0.03, (64, 3))
    places = [*block.tolist(), (0.5, 0.5, 4.55), (0.5, 0.5, 5.6), (3.5, 3.5, 5.2)]
    rows = [(k, 1, *place, RADIUS) for k, place in enumerate(places, start=1)]
    return scanfab.read_series(write(tmp_path / "dump.txt", dump_text(rows, box=((-1, 7),) * 3)))


def untouched(touching):
    """A made-up rule: only what nothing touches."""
    return touching.numbers == 0


@pytest.fixture
def made_up(monkeypatch):
    offer(monkeypatch, "scanfab.rattlers", "untouched", lambda: untouched)
    rattlers.installed_rules.cache_clear()
    yield
    rattlers.installed_rules.cache_clear()


@pytest.mark.usefixtures("made_up")
@pytest.mark.parametrize(("rule", "expected"), [("count", 2), ("recursive", 3), ("untouched", 1)])
def test_tables_inspect_and_views_tell_the_rattlers_of_the_rule(series, rule, expected):
    whole, without = scanfab.compute(series, rattlers=rule, **SCAN)
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
