"""The words of the command line for what the library says of its arguments."""

from __future__ import annotations

import inspect

import pytest

import scanfab
from scanfab.base.errors import ReadError, SettingsError
from scanfab.pipeline.options import DECLARED, MEANINGS, OPTIONS, as_options


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("a `rv_center`, or fewer `max_chords`", "a --rv-center, or fewer --max-chords"),
        ("name the `cell=(LX, LY, LZ)`", "name the --cell LX LY LZ"),
        ('`contacts="geometric"`', "--contacts geometric"),
        ('`boundary="type=2"`', '--boundary "type=2"'),
        ('`contact_columns="pos id force"`', '--contact-columns "pos id force"'),
        ("`contact_tolerance=1e-4`", "--contact-tolerance 1e-4"),
        ('`columns={"x": ..., "y": "py"}`', "--columns x=...,y=py"),
        ("`output=FILE` and `labels=NAME`", "-o FILE and --label NAME"),
        (SettingsError("rv_radius: expected a length"), "--rv-radius: expected a length"),
        # a folder may have any name
        (ReadError("frames: the folder holds no files"), "frames: the folder holds no files"),
        ("--rv: said already of `rv`", "--rv: said already of --rv"),
        ("dumps: `unheard` of, rv of", "dumps: `unheard` of, rv of"),
    ],
)
def test_arguments_become_options(said, told):
    assert as_options(said) == told


def test_no_name_is_declared_twice_and_reading_takes_the_declared_defaults():
    flags = [one.flag for one in DECLARED.values()]
    assert len(set(flags)) == len(flags)
    assert set(MEANINGS) < set(OPTIONS) < set(DECLARED)
    signature = inspect.signature(scanfab.read_series).parameters
    options = {name: one.default for name, one in signature.items() if name != "source"}
    assert options == {name: OPTIONS[name].default for name in options}
