"""Few damages of each file: campaigns try very many."""

import pytest

from scanfab.testing import readers


@pytest.fixture(autouse=True)
def few_damages(monkeypatch):
    monkeypatch.setattr(readers, "DAMAGES", 30)
