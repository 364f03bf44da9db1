"""Options of commands, made of their declarations."""

from __future__ import annotations

import re
from dataclasses import dataclass

import click
import pytest

from scanfab.base.option import GROUPS, option, options_of, takes_options, whole
from scanfab.cli import options as cli_options
from scanfab.cli.compute import compute
from scanfab.cli.options import SourceCommand
from scanfab.io import ReadOptions
from scanfab.pipeline.options import OPTIONS
from scanfab.pipeline.record import asked_for
from scanfab.pipeline.settings import Settings

TITLES = ["Most used options", *(group.capitalize() for group in GROUPS)]


def help_of(command, width=80):
    context = click.Context(command, info_name="compute", terminal_width=width)
    return command.get_help(context)


def test_every_option_of_compute_is_declared_and_stands_in_a_group():
    """The help has 80 columns."""
    names = {one.name for one in compute.params if isinstance(one, click.Option)}
    assert names - {"quiet", "verbose"} == set(OPTIONS)
    text = help_of(compute)
    assert re.findall(r"^([A-Z][\w ]+):$", text, re.M) == TITLES
    for one in OPTIONS.values():
        assert len(re.findall(rf"^  {one.flag}(?![\w-])", text, re.M)) == 1
    assert max(map(len, text.splitlines())) <= 80


@dataclass(frozen=True, init=False)
class Wider(Settings):
    """Settings with one option more, declared as the others are."""

    stray_light: int = option(whole("a number below 9", lambda n: n < 9), default=7, group="fabric")
    """How much of it, as `rv`."""


def test_a_made_up_option_takes_one_declaration(monkeypatch):
    """Help, command line, settings, their checks, manifest, and docstring have it."""
    declared = options_of(Wider)[-1]
    monkeypatch.setitem(cli_options.DECLARED, "stray_light", declared)

    @click.command(cls=SourceCommand)
    @cli_options.options("stray_light", "rv")
    def command(sources: object, **chosen: object) -> Settings:
        return Wider(**chosen)

    fabric = help_of(command).split("\nFabric:\n")[1]
    assert fabric.startswith("  --stray-light N         How much of it, as --rv.  [default: 7]\n")
    made = command.main(["-", "--stray-light", "5"], standalone_mode=False)
    assert (made.stray_light, made.rv, Wider().stray_light) == (5, 0.7, 7)
    refused = pytest.raises(click.UsageError, match=r"stray_light: expected a number below 9, fou")
    with refused, cli_options.usage_errors():
        Wider(stray_light=12)
    assert asked_for([], ReadOptions(), made)["stray_light"] == 5

    @takes_options(options_of(Wider))
    def function(*, stray_light: int = 7) -> None:
        """{options}"""

    assert function.__doc__.endswith("stray_light : int, optional\n    How much of it, as `rv`.")
