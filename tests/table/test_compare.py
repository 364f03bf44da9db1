"""Comparison of variants: normalised curves, fits, differences."""

import math

import numpy as np
import pytest

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SettingsError
from scanfab.fabric.errors import variance_without_noise
from scanfab.table.compare import compare_tables
from tests.helpers.tables import CONTACT, STRAIN, VOID, curve, sheared

OCTANTS = range(1, 9)


def summary_of(rows, **options):
    (row,) = compare_tables(rows, **options).summary
    return row


def test_each_curve_of_a_source_and_variant_is_divided_by_its_own_largest_absolute_value():
    rows = [*curve("one", "c"), *curve("one", "d", 2.0), *curve("two", "c", 4.0)]
    comparison = compare_tables(rows)
    groups = [(row.source, row.variant) for row in comparison.summary]
    assert groups == [("one", "c"), ("one", "d"), ("two", "c")]
    frames = comparison.frames
    assert frames["alpha_vs_axial"].tolist() == [row["alpha_vs_axial"] for row in rows]
    assert frames["alpha_vs_axial_norm"] == pytest.approx(3 * [x / 0.05 for x in VOID])
    assert frames["alpha_c_axial_norm"] == pytest.approx(3 * [x / 0.1 for x in CONTACT])


def test_slopes_are_those_of_least_squares():
    row = summary_of(curve())
    slope, intercept = np.polyfit(CONTACT, VOID, 1)
    residual = np.array(VOID) - slope * np.array(CONTACT) - intercept
    assert row.slope == pytest.approx(slope, rel=1e-12)
    assert row.r2 == pytest.approx(1 - residual @ residual / (5 * np.var(VOID)), rel=1e-12)
    origin = np.linalg.lstsq(np.array(CONTACT)[:, None], np.array(VOID), rcond=None)[0][0]
    assert row.slope_origin == pytest.approx(origin, rel=1e-12)
    assert (row.peak, row.peak_strain, row.final) == (-0.05, 0.02, -0.03)
    # parts of a series may come in any order
    assert summary_of([*curve()[3:], *curve()[:3]]) == row


def test_a_note_says_that_contacts_are_of_two_kinds_within_a_source():
    kinds = ("file", "geometry")
    sources = [[{**row, "contacts_from": kind} for row in curve(kind)] for kind in kinds]
    compare_tables([*sources[0], *sources[1]])
    mixed = [{**row, "contacts_from": kinds[row["frame"] > 2]} for row in curve()]
    with pytest.warns(ScanfabNote, match="the slope on the contact fabric mixes both"):
        compare_tables(mixed)


# what a value is without an octant
WITHOUT = {
    "alpha_vs_axial": lambda row, octant: (
        row["alpha_vs_axial"] * (1 + 0.01 * octant * row["frame"])
    ),
    "alpha_c_axial": lambda row, octant: row["alpha_c_axial"] + 0.001 * octant * row["frame"],
}


def with_octants(rows):
    """Rows with values without each octant, which changes them in its own way."""
    named = [(f"{name}_without_{k}", of, k) for name, of in WITHOUT.items() for k in OCTANTS]
    return [row | {name: of(row, k) for name, of, k in named} for row in rows]


def slope_without(octant, noise=0.0):
    """By least squares of the values without this octant."""
    void, contact = (np.array([of(row, octant) for row in curve()]) for of in WITHOUT.values())
    return np.polyfit(contact, void + noise, 1)[0]


def test_octants_left_out_in_all_frames_give_the_slope_its_standard_error():
    """√(7/8 Σ (slope_k - mean)²), the slopes by least squares of the values without octant k."""
    expected = math.sqrt(7 * np.var([slope_without(k) for k in OCTANTS]))
    assert expected > 1e-3
    row = summary_of(with_octants(curve()))
    assert row.slope_se == pytest.approx(expected, rel=1e-9)
    assert row.slope == pytest.approx(summary_of(curve()).slope, rel=1e-12)
    # those of frames beyond the largest strain do not count
    first = summary_of(with_octants(curve())[:3]).slope_se
    assert summary_of(with_octants(curve()), strain_max=0.02).slope_se == first


@pytest.mark.parametrize("column", ["alpha_vs_axial_without_3", "alpha_c_axial_without_8"])
def test_without_octants_of_all_frames_the_slope_has_no_error_and_why_is_told(column):
    rows = with_octants(curve())
    rows[1][column] = None
    lacking = [{name: value for name, value in row.items() if name != column} for row in rows]
    whole = (curve(), "the table has no parts")
    for some, reason in ((rows, "some frame has no fabric"), (lacking, ""), whole):
        with pytest.warns(ScanfabNote, match=f"slope_se is empty for variant c: {reason}"):
            row = summary_of(some)
        assert row.slope_se is None
        assert row.slope is not None
    assert summary_of(with_octants(curve())[:2]).slope_se is None


@pytest.mark.parametrize("count", [0, 1, 2])
def test_under_three_frames_the_slope_is_empty(count):
    comparison = compare_tables(curve()[:count])
    assert len(comparison.summary) == min(count, 1)
    for row in comparison.summary:
        assert row.frames == count
        assert row.slope is row.slope_origin is row.r2 is None
        assert row.final == VOID[count - 1]


@pytest.mark.filterwarnings("error", "ignore:slope_se is empty")
def test_frames_beyond_the_largest_strain_but_for_rounding_are_out_of_the_fit_alone():
    """Boxes of six digits make 0.1200012 of 12 %."""
    for beyond, largest, frames in ((0, 0.02, 3), (0, 0.03, 4), (2e-6, 0.03, 4), (2e-5, 0.03, 3)):
        rows = [{**row, "strain": row["strain"] + beyond} for row in curve()]
        row = summary_of(rows, strain_max=largest)
        slope = np.polyfit(CONTACT[:frames], VOID[:frames], 1)[0]
        assert (row.frames, row.final) == (frames, VOID[-1])
        assert row.slope == pytest.approx(slope, rel=1e-12)
        assert len(compare_tables(rows, strain_max=largest).frames) == 5


NO_STRAINS = [{**row, "strain": None} for row in curve()]


LARGEST = [
    (curve(), 5.0, 5, ScanfabWarning, "5 leaves out no frame: .* fractions .* 0 and 0.04"),
    (curve(), 0.5, 5, ScanfabNote, "0.5 leaves out no frame: .* fractions .* 0 and 0.04"),
    (NO_STRAINS, 1.0, 0, ScanfabWarning, "no frame has a strain"),
]


@pytest.mark.parametrize(("rows", "largest", "frames", "kind", "message"), LARGEST)
def test_a_largest_strain_that_leaves_out_nothing_is_told(rows, largest, frames, kind, message):
    assert summary_of(rows).frames == 5
    with pytest.warns(kind, match=f"strain_max`?: {message}"):
        assert summary_of(rows, strain_max=largest).frames == frames


NOT_COMPARED = [
    (curve(), {"strain_max": math.nan}, "strain_max: expected a number, found nan"),
    ([*curve(), {**curve()[2], "strain": "abc"}], {}, "row 6: strain: expected a number"),
    # rows of several cut-offs would make one curve of many
    ([*curve("two"), *curve("one"), *curve("one", "c", 2.0)], {}, "one, variant c: several rows"),
]


@pytest.mark.parametrize(("rows", "options", "message"), NOT_COMPARED)
def test_what_cannot_be_compared_is_refused(rows, options, message):
    with pytest.raises(SettingsError, match=message):
        compare_tables(rows, **options)


def test_a_sheared_cell_goes_by_its_shear_strain_and_its_turned_axes_are_told():
    with pytest.warns(ScanfabNote) as caught:
        row = summary_of(sheared(), strain_max=0.2)
    assert (row.frames, row.peak_strain) == (3, 0.4)
    told = " ".join(str(one.message) for one in caught)
    assert "the shear strain is used, because the axial strain of" in told
    assert "the loading axis is not the axis of the contact fabric" in told


def test_errors_stand_beside_their_values():
    errors = {"alpha_vs_axial_se": 3e-4, "alpha_vs_axial_sample_se": 4e-4}
    rows = [{**row, **errors, "alpha_c_axial_sample_se": 1e-3} for row in curve()]
    first = compare_tables(rows).frames[0]
    assert first.alpha_vs_axial_total_se == pytest.approx(5e-4)
    assert (first.alpha_vs_axial_se, first.alpha_c_axial_sample_se) == (3e-4, 1e-3)
    assert compare_tables(curve()).frames[0].alpha_vs_axial_total_se is None


def test_frames_without_a_value_are_left_out():
    rows = curve()
    rows[2]["alpha_vs_axial"] = None
    rows[4]["alpha_c_axial"] = None
    kept = [0, 1, 3]
    row = summary_of(rows)
    assert row.frames == 3
    expected = np.polyfit(np.array(CONTACT)[kept], np.array(VOID)[kept], 1)[0]
    assert row.slope == pytest.approx(expected, rel=1e-12)
    assert compare_tables(rows).frames[2].alpha_vs_axial_norm is None
    # nor has a curve of zeros a norm
    for column in ("alpha_vs_axial", "alpha_c_axial"):
        frames = compare_tables([{**row, column: 0.0} for row in rows]).frames
        assert {getattr(row, f"{column}_norm") for row in frames} == {None}


def test_a_constant_contact_fabric_has_no_slope():
    """The mean of three differs from them by rounding, which is no trend."""
    for rows in (curve(), curve()[:3]):
        row = summary_of([{**row, "alpha_c_axial": 0.1} for row in rows])
        assert row.slope is row.r2 is None
        assert row.slope_origin == pytest.approx(np.mean(VOID[: len(rows)]) / 0.1)


def test_differences_are_between_variants_of_a_frame():
    rows = [*curve("one", "c"), *curve("one", "a", 3.0), *curve("two", "b")]
    differences = compare_tables(rows).differences
    assert [row.variants for row in differences] == ["a-c"] * 5
    assert [row.difference for row in differences] == pytest.approx([2 * x for x in VOID])
    assert [row.strain for row in differences] == list(STRAIN)
    assert differences[0].difference_se == pytest.approx(math.sqrt(2) * 3e-4)
    rows[0]["alpha_vs_axial_se"] = None
    rows[1].pop("alpha_vs_axial_se")
    assert [row.difference_se for row in compare_tables(rows).differences[:2]] == [None, None]


HALVES = np.random.default_rng(3).normal(size=(9, 5))


def with_noise(size):
    """Rows with half the difference of two replicates of each value without an octant."""
    return [
        row | {f"alpha_vs_axial_half_{k}": size * HALVES[k, row["frame"]] for k in OCTANTS}
        for row in with_octants(curve())
    ]


def test_the_noise_of_the_scan_is_taken_off_the_error_of_the_slope():
    """Each octant has two slopes, by the two replicates, whose difference is noise."""
    noise = 3e-4 * HALVES
    slopes = [[slope_without(k, noise[k]), slope_without(k, -noise[k])] for k in OCTANTS]
    expected = math.sqrt(variance_without_noise(np.array(slopes)))
    assert summary_of(with_noise(3e-4)).slope_se == pytest.approx(expected, rel=1e-9)
    with pytest.warns(ScanfabNote, match="slope_se is empty .* hides the scatter of the octants"):
        assert summary_of(with_noise(0.1)).slope_se is None
