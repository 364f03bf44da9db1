"""Settings: what users write, and one error for each value that cannot be used."""

from __future__ import annotations

import dataclasses
import inspect

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.base.option import options_of
from scanfab.io.options import parse_frames
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Length, parse_axis, parse_length
from scanfab.scan.directions import direction_rule
from tests.helpers.dumps import write

RADII = {"rmin": 0.5, "rmean": 1.0, "rmax": 2.0}


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("0.5", 0.5),
        (0.5, 0.5),
        (3, 3.0),
        ("1e-3", 1e-3),
        ("1rmin", 0.5),
        ("0.2rmean", 0.2),
        ("1.5rmax", 3.0),
        (" 2 rmax ", 4.0),
        ("1e-1rmin", 0.05),
        (".5rmin", 0.25),
        ("0", 0.0),
        (Length(3.0, "rmax"), 6.0),
    ],
)
def test_lengths_are_numbers_or_relative_to_a_radius(text, length):
    assert parse_length("cutoff", text).resolve(RADII) == pytest.approx(length)


@pytest.mark.parametrize("text", ["", "rmin", "1rmed", "long", "1 mm", "nan", "inf", "1,5", None])
def test_other_lengths_are_errors_that_show_what_is_expected(text):
    with pytest.raises(SettingsError, match=r"cutoff: expected a length such as.*found"):
        parse_length("cutoff", text)


@pytest.mark.parametrize(
    ("text", "axis"),
    [
        ("x", (1, 0, 0)),
        ("z", (0, 0, 1)),
        ("0,0,2", (0, 0, 1)),
        ("1, 1, 0", (2**-0.5, 2**-0.5, 0)),
        ((0, -3.0, 0), (0, -1, 0)),
    ],
)
def test_axes_are_unit_vectors(text, axis):
    np.testing.assert_allclose(parse_axis(text), axis)


@pytest.mark.parametrize(
    "text", ["", "w", "Z", "1,2", "1,2,3,4", "0,0,0", "a,b,c", "nan,0,1", (1, 2)]
)
def test_other_axes_are_errors(text):
    with pytest.raises(SettingsError, match="axis: expected x, y, z or three numbers"):
        parse_axis(text)


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        (None, range(10)),
        ("2:5", [2, 3, 4]),
        (":3", [0, 1, 2]),
        ("7:", [7, 8, 9]),
        ("::4", [0, 4, 8]),
        ("-2:", [8, 9]),
        (":-8", [0, 1]),
        ("3", [3]),
        ("-1", [9]),
        ("-3", [7]),
        ("::-1", range(9, -1, -1)),
        ("1 : 3", [1, 2]),
        (slice(1, 3), [1, 2]),
    ],
)
def test_frames_are_slices(text, frames):
    assert list(range(10)[parse_frames(text)]) == list(frames)


@pytest.mark.parametrize("text", ["", "a", "1:2:3:4", "1.5", "::0", "1,2", "all"])
def test_other_frames_are_errors(text):
    with pytest.raises(SettingsError, match="frames: expected a slice such as"):
        parse_frames(text)


def test_the_defaults_are_those_of_the_command_line():
    settings = Settings()
    assert settings.variants == "abcd"
    assert settings.rv == 0.7
    assert settings.cutoff == Length(1.0, "rmin")
    assert settings.spacing is None
    assert settings.directions is None
    assert settings.tolerance == 1e-4
    assert settings.min_contacts == 2
    assert settings.rattlers == "count"
    assert settings.contact_tolerance == 0
    assert settings.axis == (0, 0, 1)
    assert settings.strain == "auto"
    assert settings.seed == 0
    assert settings.boundary == ()


def test_variants_are_always_in_the_same_order():
    assert Settings(variants="dca").variants == "acd"
    assert Settings(variants="aab").variants == "ab"


@pytest.mark.parametrize(("variants", "window"), [("ab", False), ("cd", True), ("ad", True)])
def test_variants_say_what_is_needed(variants, window):
    assert Settings(variants=variants).needs_window == window


def test_directions_are_a_number_a_rule_or_auto():
    assert len(Settings(directions=25).directions) >= 25
    assert Settings(directions="fibonacci:40").directions.name.startswith("fibonacci")
    rule = direction_rule("lebedev:7")
    assert Settings(directions=rule).directions is rule


def test_boundary_is_one_expression_or_several():
    assert [rule.text for rule in Settings(boundary="type=2").boundary] == ["type=2"]
    assert len(Settings(boundary=["type=2", "id>5"]).boundary) == 2


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("variants", ""),
        ("variants", "abe"),
        ("variants", "a,b"),
        ("rv", 0),
        ("rv", -0.5),
        ("rv", float("nan")),
        ("rv", float("inf")),
        ("rv_radius", 0),
        ("rv_radius", -1),
        ("rv_radius", float("nan")),
        ("rv_center", (0, 0, float("nan"))),
        ("rv_center", (0, 0, float("inf"))),
        ("rv_center", (0, 0)),
        ("rv_center", (0, 0, 0, 0)),
        ("cutoff", -1),
        ("cutoff", "-1rmin"),
        ("spacing", 0),
        ("spacing", "-1rmin"),
        ("directions", 0),
        ("directions", -5),
        ("directions", "many"),
        ("tolerance", 0),
        ("tolerance", -1e-3),
        ("tolerance", float("nan")),
        ("min_contacts", -1),
        ("rattlers", "loose"),
        ("rattlers", None),
        ("contact_tolerance", -1e-9),
        ("contact_tolerance", float("inf")),
        ("strain", "volume"),
        ("strain", "nowhere.csv"),
        ("seed", -1),
        ("workers", 0),
        ("workers", -2),
        ("axis", "w"),
        ("frames", "x"),
        ("boundary", "type"),
    ],
)
def test_a_value_that_cannot_be_used_is_an_error_with_its_name(option, value):
    with pytest.raises(SettingsError, match=f"^{option}: (expected|no rule|at least)"):
        Settings(**{option: value})


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("rv", "wide"),
        ("tolerance", "low"),
        ("min_contacts", 1.5),
        ("seed", "x"),
        ("rv_radius", "a"),
    ],
)
def test_a_value_of_the_wrong_kind_is_an_error_of_the_settings(option, value):
    with pytest.raises(SettingsError):
        Settings(**{option: value})


def test_a_strain_file_must_exist(tmp_path):
    path = write(tmp_path / "strain.csv", "step,strain\n0,0\n")
    assert Settings(strain=path).strain == str(path)
    with pytest.raises(SettingsError, match="a CSV file that exists"):
        Settings(strain=tmp_path)


def test_an_option_that_does_not_exist_is_an_error():
    with pytest.raises(TypeError, match="windows"):
        Settings(windows=3)


def test_settings_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Settings().rv = 0.5


@pytest.mark.parametrize(
    ("text", "values", "unit"),
    [
        ("0:3rmin:0.1rmin", [round(0.1 * k, 12) for k in range(31)], "rmin"),
        ("0:1rmean:0.5rmean", [0, 0.5, 1], "rmean"),
        ("0.5:1:0.2", [0.5, 0.7, 0.9], ""),
        ("1rmin", [1], "rmin"),
        ("2rmax:2rmax:1rmax", [2], "rmax"),
    ],
)
def test_cutoffs_are_a_range_of_lengths_with_both_ends(text, values, unit):
    cutoffs = Settings(cutoffs=text).cutoffs
    assert [one.value for one in cutoffs] == values
    assert {one.unit for one in cutoffs if one.value} <= {unit}


def test_cutoffs_may_be_listed_in_different_units():
    cutoffs = Settings(cutoffs="0.001,1rmin, 2rmean").cutoffs
    assert [(one.value, one.unit) for one in cutoffs] == [(0.001, ""), (1, "rmin"), (2, "rmean")]


@pytest.mark.parametrize(
    "text",
    [
        "",
        ",",
        "1rmin,",
        "0:1rmin",
        "0:1rmin:0",
        "0:1rmin:-0.1rmin",
        "0:1rmin:0.1",
        "0:3rmin:0.1rmean",
        "2rmin:1rmin:0.1rmin",
        "0:1:1e-9",
        "a:b:c",
        "-1rmin,1rmin",
        "nan",
        "0:inf:1",
        "0:1:1:1",
    ],
)
def test_cutoffs_that_mean_nothing_are_refused_by_name(text):
    with pytest.raises(SettingsError, match=r"^cutoffs: "):
        Settings(cutoffs=text)


@pytest.mark.parametrize("moment", [0, 3, 1.5, "x"])
def test_there_are_two_moments(moment):
    with pytest.raises(SettingsError, match=r"^moment: expected"):
        Settings(moment=moment)


@pytest.mark.parametrize("chords", [0, -1, "many", float("nan")])
def test_a_budget_of_chords_is_a_number_of_at_least_one(chords):
    with pytest.raises(SettingsError, match=r"^max_chords: expected"):
        Settings(max_chords=chords)


@pytest.mark.parametrize("tolerance", [0, -1e-4, float("inf"), float("nan")])
def test_a_tolerance_that_no_scan_meets_is_refused(tolerance):
    with pytest.raises(SettingsError, match=r"^tolerance: expected a number above 0"):
        Settings(tolerance=tolerance)


def test_rows_of_a_frame_are_those_of_all_variants_and_cutoffs():
    assert Settings().rows_per_frame == 4
    assert Settings(variants="c", cutoffs="0:3rmin:0.1rmin").rows_per_frame == 31
    assert not Settings().lists_gaps
    assert Settings(moment=2).lists_gaps


@pytest.mark.parametrize("rule", ["fibonacci:1", "fibonacci:2", "equal-angle-full:90"])
def test_directions_in_one_plane_are_refused(rule):
    with pytest.raises(SettingsError, match=f"directions: the . axes of {rule} lie in one plane"):
        Settings(directions=rule)
    with pytest.raises(SettingsError, match="lie in one plane"):
        Settings(directions=direction_rule(rule))


def test_three_directions_across_one_another_will_do():
    assert len(Settings(directions=1).directions) == 3


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("variants", None),
        ("boundary", None),
        ("boundary", 5),
        ("rv_center", 5),
        ("rv_center", "1,2"),
        ("frames", 1.5),
        ("cutoffs", [None]),
    ],
)
def test_what_has_the_wrong_type_is_refused_by_name(name, value):
    with pytest.raises(SettingsError, match=f"^{name}: expected"):
        Settings(**{name: value})


def test_numbers_do_where_the_command_line_has_text():
    assert Settings(frames=2).frames == Settings(frames="2").frames
    assert Settings(frames=-1).frames == Settings(frames="-1").frames
    assert Settings(cutoffs=[0.5, "1rmin"]).cutoffs == Settings(cutoffs="0.5,1rmin").cutoffs
    assert Settings(cutoffs=0.5).cutoffs == Settings(cutoffs="0.5").cutoffs


def test_the_signature_of_compute_has_every_option_and_its_default():
    signature = inspect.signature(scanfab.compute).parameters
    others = ("source", "executor")
    options = {name: one.default for name, one in signature.items() if name not in others}
    assert options == {one.name: one.default for one in options_of(Settings)}
    kinds = {one.kind for name, one in signature.items() if name != "source"}
    assert kinds == {inspect.Parameter.KEYWORD_ONLY}


def test_the_help_of_compute_says_what_every_option_means():
    text = inspect.getdoc(scanfab.compute)
    for one in options_of(Settings):
        assert f"\n{one.name} : {one.takes}, optional\n    {one.help[:20]}" in text


def test_compute_hands_every_option_to_the_settings(monkeypatch):
    """Each in its own place."""
    taken = {}

    def rows(source, settings, executor):
        taken.update(vars(settings))
        return iter(())

    monkeypatch.setattr("scanfab.pipeline.compute.compute_rows", rows)
    given = {
        "variants": "cd", "rv": 0.6, "rv_radius": 2.0, "rv_center": (1.0, 2.0, 3.0),
            "edge": "start",
        "boundary": ("type=2",), "cutoff": "2rmin", "cutoffs": "1,2", "moment": 2,
        "spacing": "1rmean", "directions": direction_rule("9"), "tolerance": 1e-3,
        "max_chords": 1e5, "min_contacts": 3, "rattlers": "force",
        "min_force": 0.1,
        "contact_tolerance": 1e-4, "axis": "x", "strain": "cell", "with_": "state",
        "frames": "1:2", "seed": 5, "workers": 3, "on_error": "skip",
    }  # fmt: skip
    shaped = {
        "rv_shape": "cylinder", "rv_size": (1.0, 2.0), "rv_axis": "y", "rv_follows": "strain"
    }  # fmt: skip
    usual, left = vars(Settings(workers=1)), None
    # a radius is that of a sphere
    for words in (given, {**given, **shaped, "rv_radius": None}):
        scanfab.compute(None, **words)
        assert taken == vars(Settings(**words))
        same = {name for name in taken if taken[name] == usual[name]}
        left = same if left is None else left & same
    assert left == set()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"min_force": 0.5}, "min_force: is that of the rule `rattlers=.force.`"),
        ({"rv_shape": "cone"}, "rv_shape: expected sphere, box, cylinder, ellipsoid or a closed"),
        ({"rv_shape": "none.stl"}, "rv_shape: expected sphere, .* that exists"),
        ({"rv_size": "1,2,3"}, "rv_size: the shape sphere takes none: choose `rv_radius`"),
        (
            {"rv_shape": "cylinder", "rv_size": "1,2,3"},
            "rv_size: expected R,H, radius and height .* found 1,2,3",
        ),
        ({"rv_shape": "box", "rv_size": "1,0,3"}, "rv_size: expected two or three lengths above 0"),
        ({"rv_shape": "box", "rv_size": "1,-1,3"}, "two or three lengths above 0, .* '1,-1,3'"),
        ({"rv_shape": "box", "rv_size": "1,nan,3"}, "two or three lengths above 0"),
        ({"rv_shape": "box", "rv_size": "1"}, "two or three lengths above 0"),
        ({"rv_shape": "box", "rv_size": "a"}, "two or three lengths above 0"),
        ({"rv_shape": "box", "rv_size": 5}, "two or three lengths above 0"),
        (
            {"rv_shape": "ellipsoid", "rv_radius": 2.0},
            "rv_radius: is that of a sphere, but `rv_shape` is ellipsoid: choose `rv_size`",
        ),
        ({"rv_shape": "box", "rv_axis": "x"}, "rv_axis: is that of a cylinder"),
        ({"rv_follows": "cell"}, "rv_follows: expected none or strain, found 'cell'"),
    ],
)
def test_what_is_said_of_the_window_must_go_together(options, words):
    with pytest.raises(SettingsError, match=words):
        Settings(**options)


def test_sizes_and_centres_come_with_commas_or_blanks():
    for text in ("1,2,3", "1 2 3", "1, 2, 3", [1, 2, 3], (1.0, 2.0, 3.0)):
        found = Settings(rv_shape="box", rv_size=text, rv_center=text)
        assert found.rv_size == found.rv_center == (1.0, 2.0, 3.0)
    assert Settings(rv_size=[]).rv_size == ()


def test_a_window_that_follows_a_file_of_strains_is_refused(tmp_path):
    file = tmp_path / "strain.csv"
    file.write_text("frame,strain\n0,0\n")
    with pytest.raises(SettingsError, match="rv_follows: a file of strains"):
        Settings(rv_follows="strain", strain=file)


def test_a_wrong_name_is_named_with_the_nearest():
    with pytest.raises(TypeError, match=r"^compute has no option 'varaints': did"):
        scanfab.compute(scanfab.Packing([[0, 0, 0]], 1.0), varaints="cd")
    with pytest.raises(
        TypeError, match=r"^Settings has no option 'tolerence': did you mean 'toler"
    ):
        Settings(tolerence=1e-3)


def test_there_are_no_unchecked_settings():
    with pytest.raises(SettingsError, match=r"^rv: expected a fraction above 0, or .* found -1$"):
        Settings(rv=-1)
    with pytest.raises(SettingsError, match=r"^cutoff: expected"):
        dataclasses.replace(Settings(), cutoff=Length(-1.0))


def test_settings_made_of_settings_are_the_same():
    """Also the axis, which would lose its last digit if it were divided by its length again."""
    settings = Settings(axis="1,2,3", cutoffs="1,2rmin", boundary="type=2", directions=9)
    again = dataclasses.replace(settings, seed=1)
    assert dataclasses.replace(again, seed=0) == settings


def test_an_axis_that_is_named_is_shown_even_if_it_is_that_of_spheres():
    """Of discs in x-y the default is another."""
    assert repr(Settings(axis="z")) == "Settings(axis='z')"
    assert repr(Settings()) == "Settings()"


def test_settings_with_the_same_directions_are_equal():
    assert Settings(directions=13) == Settings(directions=13)
    assert Settings(directions=13) != Settings(directions=25)
