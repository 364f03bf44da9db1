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
        (
            "a larger `rv_center`, or fewer `max_chords`",
            "a larger --rv-center, or fewer --max-chords",
        ),
        ("name the `cell=(LX, LY, LZ)`", "name the --cell LX LY LZ"),
        ("`cell=(1, 2.5e-3, 3)`", "--cell 1 2.5e-3 3"),
        ('`contacts="geometric"`', "--contacts geometric"),
        ('`cell="FILE.csv"`', "--cell FILE.csv"),
        ('`boundary="type=2"`', '--boundary "type=2"'),
        ('`contact_columns="pos id force"`', '--contact-columns "pos id force"'),
        ("`contact_tolerance=1e-4`", "--contact-tolerance 1e-4"),
        ('`columns={"x": ..., "y": "py"}`', "--columns x=...,y=py"),
        ("`output=FILE` and `labels=NAME`", "-o FILE and --label NAME"),
        (SettingsError("rv_radius: expected a length"), "--rv-radius: expected a length"),
        # a folder may have any name
        (ReadError("frames: the folder holds no files"), "frames: the folder holds no files"),
        ("seed: passed over", "seed: passed over"),
        ("--rv: said already of `rv`", "--rv: said already of --rv"),
        ("dumps: `unheard` of, `rv` of", "dumps: `unheard` of, --rv of"),
        ("frame 3: rv is 1", "frame 3: rv is 1"),
    ],
)
def test_arguments_become_options(said, told):
    assert as_options(said) == told


def test_no_name_is_declared_twice():
    flags = [one.flag for one in DECLARED.values()]
    assert len(set(flags)) == len(flags)
    assert set(MEANINGS) < set(OPTIONS) < set(DECLARED)


def test_reading_takes_the_defaults_that_are_declared():
    """Its signature is written by hand, for those who read it."""
    signature = inspect.signature(scanfab.read_series).parameters
    options = {name: one.default for name, one in signature.items() if name != "source"}
    assert options == {name: OPTIONS[name].default for name in options}
