"""Plugins that a package would offer, made up by a test."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from scanfab.base import plugins


def offer(monkeypatch: pytest.MonkeyPatch, group: str, name: str, load: Callable[[], Any]) -> None:
    """One more entry point of a group; what is kept of the group has to be forgotten."""
    point = SimpleNamespace(name=name, value=name, load=load, dist=SimpleNamespace(name="made-up"))

    before = plugins.entry_points

    def found(group: str, asked: str = group) -> list[Any]:
        return [*before(group=group), *([point] if group == asked else [])]

    monkeypatch.setattr(plugins, "entry_points", found)
