"""Calibration: ladders, from where on they are steady, and recommended settings that hold."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from scanfab import Packing, ScanfabWarning, SettingsError, calibrate, compute
from scanfab.pipeline.calibration import STEP_COLUMNS, first_steady, judged
from scanfab.table.columns import row_of
from scanfab.table.row import Row

QUICK = {"tolerance": 2e-3, "variants": "cd", "rv": 0.6, "workers": 1}


@pytest.fixture(scope="module")
def found(packing):
    """Of the last one of a stream."""
    return calibrate(iter([packing, packing]), **QUICK)


def ladder(found, name, variant="c"):
    return [row for row in found.rows if row.ladder == name and row.variant == variant]


def test_ladders_go_from_coarse_to_fine(found):
    values = {name: [row.value for row in ladder(found, name)] for name in ("spacing", "cutoff")}
    assert values == {"spacing": [4, 2, 1, 0.5, 0.2, 0.1], "cutoff": [k / 4 for k in range(13)]}
    assert {row.frame for row in found.rows} == {1}
    directions = ladder(found, "directions")
    assert [row.value for row in directions] == [row.directions for row in directions]
    assert [row.degree for row in directions] == [5, 9, 11, 17, 23, 31, 41]
    assert [row.value for row in ladder(found, "rv", "d")] == [0.4, 0.5, 0.6, 0.67, 0.7, 0.8]
    errors = [row.alpha_vs_axial_se for row in ladder(found, "spacing")[-3:]]
    assert errors[0] > errors[1] > errors[2]


def test_a_step_is_a_computation_with_its_settings(packing, found):
    options = {**QUICK, "spacing": "0.5rmin", "directions": "icosahedral:9"}
    for one in compute(packing, **options):
        row = ladder(found, "spacing", one.variant)[3]
        assert row.spacing == pytest.approx(0.5 * packing.radius.min())
        for name in ("alpha_vs_axial", "alpha_vs_axial_se", "segments", "mean_length"):
            assert getattr(row, name) == one[name]


def test_recommended_settings_reach_their_error(packing, found):
    best = [row for row in found.rows if row.ladder == "recommended"]
    at_cutoff = [row for row in found.rows if row.ladder == "cutoff" and row.value == 1.0]
    sample = max(row.alpha_vs_axial_sample_se or 0.0 for row in at_cutoff)
    errors = [row.alpha_vs_axial_se for row in best]
    assert max(errors) <= max(QUICK["tolerance"], 0.25 * sample)
    table = compute(packing, **QUICK, **found.options)
    assert table["alpha_vs_axial_se"].tolist() == errors


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")
@pytest.mark.parametrize("most", [2905, 12])
def test_directions_of_discs_are_equal_angles(monkeypatch, most):
    """Where more directions than are allowed would be needed, lines are closer."""
    monkeypatch.setattr("scanfab.pipeline.calibration.SPACINGS", (2.0, 1.0))
    monkeypatch.setattr("scanfab.pipeline.calibration.MOST_DIRECTIONS", most)
    random = np.random.default_rng(2)
    discs = Packing(random.random((100, 2)) * 10.0, random.uniform(0.3, 0.6, 100))
    found = calibrate(discs, variants="c", tolerance=2e-3, workers=1)
    assert [row.value for row in ladder(found, "directions")] == [3, 5, 8, 16, 32, 64, 128]
    (row,) = compute(discs, variants="c", workers=1, **found.options)
    assert found.options["directions"] == str(row.directions)
    assert row.directions <= most
    assert (found.options["spacing"] == "0.25rmin") == (most > 12)
    assert row.alpha_vs_axial_se <= 2e-3


def step(value, alpha, error, **more):
    words = {"value": value, "variant": "c", "alpha_vs_axial": alpha, "alpha_vs_axial_se": error}
    return row_of(STEP_COLUMNS, {"note": "", **words, **more})


def test_steady_is_what_differs_from_later_steps_by_no_more_than_chance():
    steps = [step(k, alpha, 0.001) for k, alpha in enumerate([0.0145, 0.0095, 0.012, 0.0105, 0.01])]
    # Student's t for 0.05 / 10 pairs is 3.03, and 3.03 √2 x 0.001 = 0.0043
    assert [row.steady for row in judged(steps)] == [0, 1, 1, 1, 1]
    far = [step(9, 0.0129, 0.001), *steps[:2], steps[4]]
    assert [row.steady for row in judged(far)] == [0, 0, 1, 1]
    for doubt in ({"alpha_vs_axial_se": None}, {"note": "few"}, {"alpha_vs_axial": None}):
        found = judged([steps[4], Row(**{**steps[4], **doubt}), steps[4]])
        assert [row.steady for row in found] == [0, 0, 1]
        assert first_steady(found) is None  # there is nothing that the last one agrees with


def test_an_rv_within_another_differs_from_it_by_less_than_two_samples_do():
    """Means over n and N > n grains, of which n are the same: (N/n - 1) of the variance of N."""
    for dimension, grains in ((3, 8), (2, 4)):
        # Student's t for 0.05 and one pair is 2.042
        for apart, is_steady in ((2.04, True), (2.05, False)):
            words = {"ladder": "rv", "alpha_vs_axial_sample_se": 0.001}
            alpha = 0.001 * apart * np.sqrt(grains - 1)
            inner, outer = step(1, alpha, 1e-9, rv_radius=1.0), step(2, 0.0, 1e-9, rv_radius=2.0)
            found = judged([Row(**{**one, **words}) for one in (inner, outer)], dimension)
            assert found[0].steady == is_steady


LEAVE_OUT = "leave out `cutoffs`, `moment`, `frames` and all but one `rv`"


REFUSED = [
    ({"frame": -2}, "no frame in -2:-1: .* has 1 frame, 0"),
    ({"moment": 2}, LEAVE_OUT),
    ({"cutoffs": "0.1,0.2"}, LEAVE_OUT), ({"rv": (0.5, 0.6)}, LEAVE_OUT),
    ({"frames": ":1"}, LEAVE_OUT),
    ({"tolerence": 0.02}, "Settings has no option 'tolerence': .*'tolerance'"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "told"), REFUSED)
def test_what_cannot_be_calibrated_is_refused(packing, options, told):
    with pytest.raises((TypeError, SettingsError), match=told):
        calibrate(packing, **{**QUICK, **options})


def test_the_sentences_say_what_the_rows_show(found):
    """Of each ladder the first step that is steady in all variants; of cut-offs the largest."""
    said = dict(sentence.split(": ", 1) for sentence in found.findings)
    assert list(said) == ["spacing", "directions", "cut-off", "rv", "recommended"]
    papers = {"spacing": " (the paper: 0.1)", "directions": "", "rv": " (the paper: 0.67 to 0.7)"}
    for name, paper in papers.items():
        steady = first_steady([row for row in found.rows if row.ladder == name])
        text = "no step agrees with all later ones"
        if steady is not None:
            text = f"from {steady:g} on, nothing changes within the errors"
        assert said[name] == text + paper
    alpha = {row.value: row.alpha_vs_axial for row in ladder(found, "cutoff") if row.alpha_vs_axial}
    best = max(alpha, key=lambda value: abs(alpha[value]))
    assert said["cut-off"] == (
        f"the anisotropy of variant c is largest ({alpha[best]:.2g}) at {best:g} r_min; "
        f"at the paper's 1 r_min it is {alpha[1.0] / alpha[best]:.0%} of that"
    )
    assert said["recommended"].startswith("error of the scan ")


def test_steps_beyond_the_budget_are_left_out_with_a_word(packing):
    chords = np.pi * np.sum(packing.radius**2) * 16 / (0.2 * packing.radius.min()) ** 2
    options = {"tolerance": 0.02, "rv": 0.6, "max_chords": 1.05 * chords}
    with pytest.warns(ScanfabWarning) as told:
        few = calibrate(packing, variants="a", **options)
    with pytest.warns(ScanfabWarning):
        # lines in the RV cut the grains that reach into it alone
        inner = calibrate(packing, variants="c", **options)
    assert [row.value for row in ladder(few, "spacing", "a")] == [4, 2, 1, 0.5, 0.2]
    assert any("spacing 0.1 is skipped: it would cut" in str(one.message) for one in told)
    assert few.options["spacing"] != "0.1rmin"
    assert ladder(inner, "spacing")[-1].value == 0.1


def test_one_ladder_is_drawn_on_the_axes_that_it_gets(found):
    ax = Figure().subplots()
    assert found.plot.calibration(ax=ax, ladder="cutoff") is ax
    assert ax.get_xlabel() == "cut-off $c/r_{min}$"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["variant c", "variant d"]
    with pytest.raises(SettingsError, match=r"ladder: expected spacing, .* found 'lines'"):
        found.plot.calibration(ax=ax, ladder="lines")
