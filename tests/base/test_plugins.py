"""What other packages offer: found, broken, or twice."""

from types import SimpleNamespace

import pytest

from scanfab.base import plugins
from scanfab.base.errors import ScanfabError, ScanfabWarning
from scanfab.base.plugins import load_plugins
from scanfab.io.reader import installed_readers
from scanfab.io.writer import installed_writers
from scanfab.packing import rattlers
from scanfab.table import formats
from scanfab.table.columns import installed_fabrics
from scanfab.table.plots import installed_figures
from tests.helpers.plugins import offer


def point(name, load, package="one"):
    return SimpleNamespace(name=name, value=name, load=load, dist=SimpleNamespace(name=package))


@pytest.fixture
def offered(monkeypatch):
    points = []
    monkeypatch.setattr(plugins, "entry_points", lambda group: points)
    return points


def test_they_come_by_name_with_their_package_and_a_broken_one_is_a_warning(offered):
    offered += [point("b", lambda: 2), point("bad", lambda: 1 / 0), point("a", lambda: 1)]
    with pytest.warns(ScanfabWarning, match="the thing 'bad' of one .*ZeroDivisionError: div"):
        found = load_plugins("some.group", "thing", str)
    said = [(name, offer.plugin, offer.package) for name, offer in found.items()]
    assert said == [("a", "1", "one"), ("b", "2", "one")]


def test_one_name_twice_is_an_error_that_names_both_packages(offered):
    offered += [point("a", lambda: 1), point("a", lambda: 2, "two")]
    with pytest.raises(ScanfabError, match="two packages offer a thing called 'a': one and two"):
        load_plugins("some.group", "thing", str)


@pytest.mark.parametrize(
    ("group", "installed"),
    [
        ("scanfab.rattlers", rattlers.installed_rules),
        ("scanfab.table_formats", formats.foreign_formats),
        ("scanfab.fabrics", installed_fabrics),
        ("scanfab.figures", installed_figures),
        ("scanfab.readers", installed_readers),
        ("scanfab.writers", installed_writers),
    ],
)
@pytest.mark.parametrize("plugin", [3, dict])
def test_what_is_no_plugin_is_a_warning_in_every_group(monkeypatch, group, installed, plugin):
    expected = list(installed())
    offer(monkeypatch, group, "bad", lambda: plugin)
    installed.cache_clear()
    with pytest.warns(ScanfabWarning, match="'bad' of made-up cannot be loaded: TypeError"):
        assert list(installed()) == expected
    installed.cache_clear()
