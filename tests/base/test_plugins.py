"""What other packages offer: found, broken, or twice."""

import pytest

from scanfab.base.errors import ScanfabError, ScanfabWarning
from scanfab.base.plugins import load_plugins
from scanfab.io.reader import installed_readers
from scanfab.io.writer import installed_writers
from scanfab.packing import rattlers
from scanfab.table import formats
from scanfab.table.columns import installed_fabrics
from scanfab.table.plots import installed_figures
from tests.helpers.plugins import offer


def test_they_come_by_name_with_their_package_and_a_broken_one_is_a_warning(monkeypatch):
    for name, load in (("b", lambda: 2), ("bad", lambda: 1 / 0), ("a", lambda: 1)):
        offer(monkeypatch, "some.group", name, load)
    with pytest.warns(ScanfabWarning, match="the thing 'bad' of made-up .*ZeroDivisionError: div"):
        found = load_plugins("some.group", "thing", str)
    said = [(name, offer.plugin, offer.package) for name, offer in found.items()]
    assert said == [("a", "1", "made-up"), ("b", "2", "made-up")]
    # one name twice is an error that names both packages
    offer(monkeypatch, "some.group", "a", lambda: 2)
    with pytest.raises(ScanfabError, match="offer a thing called 'a': made-up and made-up"):
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
