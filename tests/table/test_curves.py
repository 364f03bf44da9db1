"""Rows and curves of tables that stand side by side."""

import math
import re

import pytest

from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.pipeline.calibration import STEP_COLUMNS
from scanfab.pipeline.inspection import REPORT_COLUMNS
from scanfab.table import curves
from scanfab.table.compare import DIFFERENCES, FRAMES, SUMMARY
from scanfab.table.row import number_of
from scanfab.table.selection import choose_rows
from tests.helpers.tables import curve, sheared


def changed(source="one", frame=None, **values):
    """The rows of a curve with other values, in one frame or in all."""
    return [{**row, **values} if frame in (None, row["frame"]) else row for row in curve(source)]


# a strain that differs by rounding errors, and one that is small
ROUNDED = [{**row, "strain": 0.25 + 1e-12 * row["frame"]} for row in curve("one")]
SMALL = [{**row, "strain": 1e-6 * row["frame"]} for row in curve("one")]
SHEARED_TOO = [{**row, "shear_strain": row["strain"]} for row in curve("one")]
FRAME, SHEAR = "the number of the frame is used", "the shear strain is used"


ABSCISSAS = [
    ([*curve("one"), *curve("two", "d")], "strain", None),
    (SMALL, "strain", None),
    (curve("one")[2:3], "strain", None),
    ([], None, None),
    (changed(strain=None), None, None),
    ([*curve("one"), *changed("two", strain=None)], None, f"{FRAME}, because two has no axial st"),
    (changed(frame=3, strain=None), None, f"{FRAME}, because one has no axial strain in frame 3: "),
    (changed(frame=3, strain=None, alpha_vs_axial=None), "strain", None),
    (changed(strain=0.25), None, "because the axial strain of one is 0.25 in all frames: "),
    (ROUNDED, None, "because the axial strain of one is 0.25 in all frames: "),
    (sheared(), "shear_strain", f"{SHEAR}, because the axial strain of shear is 0 in"),
    ([*sheared(), *curve("one")], None, FRAME),
    ([*sheared(), *SHEARED_TOO], "shear_strain", SHEAR),
    (changed(strain=0.25, shear_strain=0.0), None, FRAME),
]


@pytest.mark.parametrize(("rows", "column", "hint"), ABSCISSAS)
def test_a_strain_that_all_frames_have_is_the_abscissa_and_a_hint_tells_of_any_other(
    rows, column, hint
):
    assert curves.strain_column(rows) == column
    found = curves.why_not_strain(rows)
    assert found is None if hint is None else re.search(hint, found)


def test_a_single_frame_has_the_strain_that_is_not_zero():
    for axial, shear, column in (
        (0.1, 0.2, "strain"),
        *((axial, 0.2, "shear_strain") for axial in (0.0, 1e-12, None)),
        *((0.0, shear, "strain") for shear in (0.0, None)),
        (None, None, None),
    ):
        assert curves.frame_strain_column({"strain": axial, "shear_strain": shear}) == column


def test_sources_are_called_by_the_last_part_of_their_path():
    for first, second in (("runs/dense", "runs/loose"), ("one/x", "two/x")):
        named = [one.source for one in curves.curves_of([*curve(first), *curve(second)])]
        assert named == [name.removeprefix("runs/") for name in (first, second)]


@pytest.mark.parametrize(("axial", "turned"), [(0.9, False), (0.4, True)])
def test_the_most_certain_frame_tells_whether_the_axes_are_turned(axial, turned):
    rows = [{**row, "alpha_c_axial": axial * row["alpha_c"]} for row in sheared()]
    rows[0].update(alpha_c=1.0, alpha_c_axial=0.0, alpha_c_axial_se=1.0)
    assert curves.is_turned(rows) == turned
    assert curves.is_turned(curve()) is False


def test_long_names_are_cut_in_the_middle_and_stay_different():
    names = [f"{'a' * 60}{end}" for end in "xy"]
    short = [f"{'a' * 14}...{'a' * 13}{end}" for end in "xy"]
    assert [*curves.short_names(names).items()] == [*zip(names, short, strict=True)]
    alike = [f"{'a' * 30}{end}{'b' * 30}" for end in "xy"]
    assert len(set(curves.short_names(alike).values())) == 2


CUTOFFS = (0.0, 0.00080000001, 0.0016)
OF_CUTOFFS = [
    {**one, "cutoff": cutoff, "alpha_vs_axial": one["alpha_vs_axial"] * (1 + place)}
    for one in curve()
    for place, cutoff in enumerate(CUTOFFS)
]


@pytest.mark.parametrize("asked", [0.0, 0.0008, 0.00160001])
def test_the_rows_of_one_cutoff_are_chosen_to_three_digits(asked):
    """A frame without grains has no cut-off, and stays once."""
    empty = {"cutoff": None, "alpha_vs_axial": None}
    rows = [{**row, **empty} if row["frame"] == 0 else row for row in OF_CUTOFFS]
    (chosen,) = choose_rows([("t.csv", rows)], cutoff=asked)
    cutoffs = [row["cutoff"] for row in chosen[1:]]
    assert cutoffs == [pytest.approx(asked, rel=1e-3)] * 4
    assert [row["frame"] for row in chosen] == [0, 1, 2, 3, 4]


LABELS = [
    ([curve(), curve()], ["coarse", "fine"], [{"coarse"}, {"fine"}]),
    # the label of a table of several sources stands before them
    ([[*curve("one"), *curve("two")]], ["new"], [{"new, one", "new, two"}]),
]


@pytest.mark.parametrize(("tables", "labels", "sources"), LABELS)
def test_labels_tell_two_runs_of_one_sample_apart(tables, labels, sources):
    chosen = choose_rows([("t.csv", rows) for rows in tables], labels=labels)
    assert [{row["source"] for row in rows} for rows in chosen] == sources


@pytest.mark.parametrize("source", ["one", "./one", "two/../one/"])
def test_rows_that_are_there_already_count_once_with_one_warning(source):
    with pytest.warns(ScanfabWarning) as caught:
        first, second = choose_rows([("1.csv", curve("one")), ("2.csv", curve(source))])
    assert (len(first), second) == (5, [])
    (text,) = {str(one.message) for one in caught}
    assert text == f"2.csv: rows of {source} that 1.csv also holds are used once"


VALUES = ["abc", True, [1], {"a": [1]}, float("nan"), float("inf"), 10**400, b"x"]
NUMBERS = ("frame", "strain", "alpha_vs_axial", "alpha_c_axial_without_3", "coaxiality_deg")
WRONG = [
    *((name, value, "a number") for name in NUMBERS for value in VALUES),
    *((name, value, "a name") for name in ("source", "variant") for value in (1, True, ["c"], {})),
    *(("frame", value, "a whole number") for value in (None, 1.5)),
]


@pytest.mark.parametrize(("column", "value", "expected"), WRONG, ids=lambda one: repr(one)[:12])
def test_a_value_of_another_kind_is_named_by_table_row_and_column(column, value, expected):
    rows = [*curve()[:2], {**curve()[2], column: value}]
    message = f"^t.csv: row 3: {column}: expected {expected}, found .{{,90}}$"
    with pytest.raises(SettingsError, match=message):
        choose_rows([("t.csv", rows)])
    assert expected != "a number" or number_of({"a": value}, "a") is None


OTHERS = [(FRAMES, "a table"), (SUMMARY, "the summary"), (DIFFERENCES, "the differences")]
OTHERS += [(columns, "no column strain") for columns in (STEP_COLUMNS, REPORT_COLUMNS)]
REFUSED = [
    *(([dict.fromkeys(one.name for one in columns)], {}, name) for columns, name in OTHERS),
    ([{f"column_{k}": k for k in range(100)}], {}, "no column source"),
    ([*curve(), {"source": "one"}], {}, "row 6: there is no column frame"),
    ([dict.fromkeys(curve()[0].keys() - {"alpha_c_axial"})], {}, "no column alpha_c_axial"),
    *((OF_CUTOFFS, {"cutoff": c}, "0, 0.0008, 0.0016") for c in (8.1e-4, 1.0, -1, math.nan)),
    (curve(), {"cutoff": 1.0}, "none in this table"),
    (curve(), {"labels": ["a", "b"]}, "one per table: 1, found 2"),
]


@pytest.mark.parametrize(("rows", "options", "words"), REFUSED)
def test_rows_that_cannot_be_chosen_are_refused_in_words(rows, options, words):
    with pytest.raises(SettingsError, match=re.escape(words)) as caught:
        choose_rows([("t.csv", rows)], **options)
    assert str(caught.value).startswith(("t.csv: ", "labels: "))
