"""Settings: what users write, an error for each unusable value, and options told in their words."""

import dataclasses
import inspect
import warnings

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabNote, ScanfabWarning
from scanfab.base.errors import SettingsError, SkippedFrameWarning
from scanfab.base.option import options_of
from scanfab.pipeline.options import OPTIONS, as_options, listening
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Length
from scanfab.scan.directions import direction_rule
from tests.helpers.truth import SHEAR

NAN, INF = float("nan"), float("inf")


WAYS = [
    # a number, or relative to a radius
    ("cutoff", lambda length: length.resolve({"rmin": 0.5, "rmean": 1.0, "rmax": 2.0}), [
        ("0.5", 0.5), (3, 3.0), ("1e-3", 1e-3), ("1rmin", 0.5), ("0.2rmean", 0.2),
        (" 2 rmax ", 4.0), (".5rmin", 0.25), ("0", 0.0), (Length(3.0, "rmax"), 6.0),
    ]),
    # unit vectors
    ("axis", tuple, [
        ("x", (1, 0, 0)), ("1, 1, 0", (2**-0.5, 2**-0.5, 0)), ((0, -3.0, 0), (0, -1, 0)),
    ]),
    # slices
    ("frames", range(10).__getitem__, [
        (None, range(10)), ("2:5", [2, 3, 4]), ("::4", [0, 4, 8]), ("-2:", [8, 9]), ("3", [3]),
        ("-1", [9]), ("-3", [7]), (2, [2]), (-1, [9]), ("1 : 3", [1, 2]), (slice(1, 3), [1, 2]),
    ]),
]  # fmt: skip


@pytest.mark.parametrize(("option", "meaning", "values"), WAYS)
def test_values_are_written_in_many_ways(option, meaning, values):
    for text, expected in values:
        found = meaning(getattr(Settings(**{option: text}), option))
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=0)


CUTOFFS = [
    ("0:3rmin:0.1rmin", [round(0.1 * k, 12) for k in range(31)], {"rmin"}),
    ("0.5:1:0.2", [0.5, 0.7, 0.9], {""}),
    ("2rmax:2rmax:1rmax", [2], {"rmax"}),
    # in metres
    ("0:1e-12:2.5e-13", [0, 2.5e-13, 5e-13, 7.5e-13, 1e-12], {""}),
    ("0.001,1rmin, 2rmean", [0.001, 1, 2], {"", "rmin", "rmean"}),
    ([0.5, "1rmin"], [0.5, 1], {"", "rmin"}),
    (0.5, [0.5], {""}),
    (None, [], set()),
]


@pytest.mark.parametrize(("text", "values", "units"), CUTOFFS)
def test_cutoffs_are_a_range_of_lengths_with_both_ends_or_a_list(text, values, units):
    cutoffs = Settings(cutoffs=text).cutoffs
    assert [one.value for one in cutoffs] == values
    assert {one.unit for one in cutoffs if one.value} == units


def test_values_are_kept_as_they_are_meant():
    assert [Settings(variants=text).variants for text in ("dca", "aab")] == ["acd", "ab"]
    assert [Settings(variants=text).needs_window for text in ("ab", "cd", "ad")] == [0, 1, 1]
    assert len(Settings(directions=25).directions) >= 25
    assert len(Settings(directions=1).directions) == 3
    rule = direction_rule("lebedev:7")
    assert Settings(directions=rule).directions is rule
    boundary = ["type=2", "id>5"]
    assert [one.text for one in Settings(boundary=boundary).boundary] == boundary
    for text in ("1,2,3", "1 2 3", "1, 2, 3", [1, 2, 3], np.array([1, 2, 3])):
        found = Settings(rv_shape="box", rv_size=text, rv_center=text)
        assert found.rv_size == found.rv_center == (1.0, 2.0, 3.0)
    assert Settings().rows_per_frame == 4
    assert Settings(variants="c", cutoffs="0:3rmin:0.1rmin").rows_per_frame == 31
    assert Settings(variants="acd", cutoffs="0,1", rv=[0.7, 0.4]).rows_per_frame == 10
    assert (Settings().lists_gaps, Settings(moment=2).lists_gaps) == (False, True)


UNUSABLE = [
    ("variants", ["", "abe", "a,b", None]), ("rattlers", ["loose", None]),
    ("rv", [0, -0.5, NAN, INF, "wide", None, "", "0.4,0.4", "0.4,x", [0.4, -1], [0.4, NAN]]),
    ("rv_radius", [0, -1, NAN, "a"]), ("rv_shape", ["cone", "none.stl"]),
    ("rv_center", [(0, 0, NAN), (0, 0, INF), (0, 0), (0, 0, 0, 0), 5, "1,2"]),
    ("rv_size", ["1,0,3", "1,-1,3", "1,nan,3", "1", "a", 5, ""]), ("rv_follows", ["cell"]),
    ("cutoff", [-1, "-1rmin", "", "rmin", "1rmed", "long", "1 mm", "nan", "inf", "1,5", None]),
    ("spacing", [0, "0rmin", "-1rmin"]), ("directions", [0, -5, "many"]),
    ("tolerance", [0, -1e-3, NAN, INF, "low"]), ("max_chords", [0, -1, "many", NAN]),
    ("moment", [0, 3, 1.5, "x"]), ("min_contacts", [-1, 1.5]),
    ("contact_tolerance", [-1e-9, INF]), ("strain", ["volume", "nowhere.csv", SHEAR]),
    ("seed", [-1, "x"]), ("workers", [0, -2]), ("boundary", ["type", None, 5]),
    ("axis", ["", "w", "Z", "1,2", "1,2,3,4", "0,0,0", "a,b,c", "nan,0,1", (1, 2)]),
    ("frames", ["", "a", "1:2:3:4", "1.5", "::0", "1,2", "all", 1.5]),
    ("with_", ["weather", "forces,stress", 3]),
    ("cutoffs", ["", ",", "1rmin,", "0:1rmin", "0:1rmin:0", "0:1rmin:-0.1rmin", [None]]),
    ("cutoffs", ["0:1rmin:0.1", "0:3rmin:0.1rmean", "2rmin:1rmin:0.1rmin", "0:1:1e-9"]),
    ("cutoffs", ["a:b:c", "-1rmin,1rmin", "nan", "0:inf:1", "0:1:1:1", "1,2:3"]),
]  # fmt: skip


@pytest.mark.parametrize(("option", "values"), UNUSABLE)
def test_a_value_that_cannot_be_used_is_an_error_with_its_name(option, values):
    for value in values:
        with pytest.raises(SettingsError, match=f"^{option}: (expected|no rule|at least)"):
            Settings(**{option: value})


CONTRADICTIONS = [
    ({"directions": "fibonacci:2"}, "directions: .* of fibonacci:2 lie in one plane"),
    ({"directions": direction_rule("equal-angle-full:90")}, "directions: .* lie in one plane"),
    ({"strain": SHEAR / "fabric.txt", "rv_follows": "strain"}, "rv_follows: a file of strains"),
    ({"min_force": 0.5}, "min_force: .* `rattlers=.force.`"),
    ({"edge": "ends", "moment": 2}, "moment: .* choose `edge=start`"),
    ({"rv_size": "1,2,3"}, "rv_size: has no meaning if `rv_shape` is sphere"),
    ({"rv_shape": "cylinder", "rv_size": "1,2,3"}, "rv_size: expected R,H.* found 1,2,3"),
    ({"rv_shape": "ellipsoid", "rv_radius": 2.0}, "rv_radius: .* `rv_shape` is ellipsoid"),
    ({"rv_shape": "box", "rv_axis": "x"}, "rv_axis: .* choose `rv_shape=.cylinder.`"),
    ({"rv": "0.4,0.5", "rv_radius": 1}, "rv_radius: .* `rv` asks for 2"),
    ({"rv": [0.4, 0.5], "rv_shape": "box", "rv_size": "1,2,3"}, "rv_size: .*`rv` asks for 2"),
]


@pytest.mark.parametrize(("options", "words"), CONTRADICTIONS)
def test_settings_must_go_together(options, words):
    with pytest.raises(SettingsError, match=words):
        Settings(**options)


def test_the_signature_and_the_help_of_compute_have_every_option():
    signature = inspect.signature(scanfab.compute).parameters
    options = {name: one for name, one in signature.items() if name not in ("source", "executor")}
    declared = {one.name: one.default for one in options_of(Settings)}
    assert {name: one.default for name, one in options.items()} == declared
    assert {one.kind for one in options.values()} == {inspect.Parameter.KEYWORD_ONLY}
    text = inspect.getdoc(scanfab.compute)
    helps = {one.name: one.help[:20] for one in options_of(Settings)}
    for name, one in options.items():
        assert f"\n{name} : {one.annotation}, optional\n    {helps[name]}" in text


def test_settings_are_checked_again_where_they_are_replaced():
    """Also the axis, which would lose its last digit if it were divided by its length again."""
    settings = Settings(axis="1,2,3", cutoffs="1,2rmin", boundary="type=2", directions=9)
    again = dataclasses.replace(settings, seed=1)
    assert dataclasses.replace(again, seed=0) == settings
    assert Settings(directions=13) != Settings(directions=25)
    # from the text of a manifest, too
    for axis in (Settings(axis="1,1,0").axis, settings.axis):
        assert Settings(axis=",".join(map(repr, axis))).axis == axis
    with pytest.raises(SettingsError, match=r"^cutoff: expected"):
        dataclasses.replace(settings, cutoff=Length(-1.0))


SAID = [
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
]


@pytest.mark.parametrize(("said", "told"), SAID)
def test_arguments_become_options(said, told):
    assert as_options(said) == told


def test_reading_takes_the_declared_defaults():
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


FILTERS = [
    ({"message": "nothing"}, ALL),
    ({"category": ScanfabWarning}, [ALL[1]]),
    ({"category": ScanfabNote}, [ALL[0], *ALL[2:]]),
    ({"module": __name__.replace(".", r"\.")}, []),
]


@pytest.mark.parametrize(("hidden", "shown"), FILTERS)
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
