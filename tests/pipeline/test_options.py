"""What the library says of its options: in the words of the command line, once, by filters."""

import inspect
import warnings

import pytest

import scanfab
from scanfab import ReadError, ScanfabNote, ScanfabWarning, SettingsError
from scanfab.base.errors import SkippedFrameWarning
from scanfab.pipeline.options import DECLARED, MEANINGS, OPTIONS, as_options, listening


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("a `rv_center`, or fewer `max_chords`", "a --rv-center, or fewer --max-chords"),
        ("name the `cell=(LX, LY, LZ)`", "name the --cell LX LY LZ"),
        ('`contacts="geometric"`', "--contacts geometric"),
        ('`boundary="type=2"`', '--boundary "type=2"'),
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
    assert set(OPTIONS) < set(DECLARED) > set(MEANINGS)
    signature = inspect.signature(scanfab.read_series).parameters
    options = {name: one.default for name, one in signature.items() if name != "source"}
    assert options == {name: OPTIONS[name].default for name in options}


ALL = ["choose another `rv`", "a note", "frame 1 skipped", "frame 2 skipped"]


def told_in_a_function():
    """As compute_file() does it: what is told is warned of where it is called."""
    kinds = [ScanfabWarning, ScanfabNote, SkippedFrameWarning, SkippedFrameWarning]
    with listening() as told:
        for text, kind in [(ALL[0], kinds[0]), *zip(ALL, kinds, strict=True)]:
            warnings.warn(text, kind, stacklevel=1)
        warnings.warn("of others", RuntimeWarning, stacklevel=1)
    return told


@pytest.mark.parametrize(
    ("hidden", "shown"),
    [
        ({"message": "nothing"}, ALL),
        ({"category": ScanfabWarning}, [ALL[1]]),
        ({"category": ScanfabNote}, [ALL[0], *ALL[2:]]),
        ({"module": __name__.replace(".", r"\.")}, []),
    ],
)
def test_each_text_is_kept_and_what_filters_leave_is_passed_on_once(hidden, shown):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", **hidden)
        told = told_in_a_function()
    assert told.warnings == ["choose another --rv", *ALL[2:]]
    assert told.notes == ["a note"]
    assert told.skipped == 2
    others = ["of others"] if "module" not in hidden else []
    assert [str(one.message) for one in caught] == [*others, *shown]
    assert all(one.filename == __file__ for one in caught)


def test_filters_may_make_errors_of_them():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        with pytest.raises(ScanfabWarning, match="choose another"):
            told_in_a_function()
