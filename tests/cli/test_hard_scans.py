"""Scans that cannot succeed, or only with effort: an answer or a reason, and always an end."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from scanfab import Packing, ScanfabWarning, compute
from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, write


@pytest.fixture
def answer(capsys, tmp_path):
    """Exit code, rows and messages of compute on 64 grains in a cube."""
    write(tmp_path / "dump_0.txt", dump_text(cubic_rows(), box=((0, 4),) * 3))

    def ask(*words):
        code = run(["compute", str(tmp_path), *map(str, words)])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return code, list(csv.DictReader(io.StringIO(out))), err

    return ask


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--tolerance", "0"), 2, "tolerance: expected a number above 0, found 0"),
        (("--tolerance", "-1e-4"), 2, "tolerance: expected a number above 0, found -0.0001"),
        (("--directions", "fibonacci:1"), 2, "the 1 axes of fibonacci:1 lie in one plane"),
        (("--max-chords", "0"), 2, "max-chords: expected a number of at least 1"),
        (("--max-chords", "5"), 1, "max-chords: 5 chords are fewer than"),
        (("--spacing", "50", "--directions", "20"), 1, "spacing: expected a length from"),
        (("--spacing", "50"), 1, "spacing: expected a length from"),
        (("--spacing", "1e-6", "--directions", "20"), 1, "choose a wider spacing"),
    ],
)
def test_what_cannot_be_scanned_is_refused_with_a_reason(answer, words, code, message):
    found, rows, err = answer(*words)
    assert (found, rows) == (code, [])
    assert message in err


def test_target_out_of_reach_is_told_with_the_error_that_was_reached(answer):
    code, rows, err = answer("--tolerance", "1e-9", "--max-chords", "1e6", "--cutoff", "0.1rmin")
    assert code == 0
    assert "chords before the tolerance 1e-09 was met: alpha_vs_axial_se is what it reached" in err
    assert " times as many lines would be needed (--max-chords, --tol" in err
    assert all(float(row["alpha_vs_axial_se"]) > 1e-9 for row in rows)


def test_directions_that_meet_nothing_give_rows_without_a_fabric(answer):
    """No gap is as long as the cut-off."""
    code, rows, err = answer("--cutoff", "100", "--directions", "20", "--spacing", "0.1")
    assert code == 1
    assert [row["alpha_vs"] for row in rows] == [""] * 4
    assert [row["segments"] for row in rows] == ["0"] * 4
    assert "no void segment reaches the cut-off" in err


def test_rule_with_a_bias_warns_on_the_command_line(answer):
    _, rows, err = answer("--directions", "equal-angle:30", "--spacing", "0.1", "--variants", "c")
    assert len(rows) == 1
    assert "directions equal-angle:30: an isotropic sample would get alpha = 0." in err


@pytest.mark.filterwarnings("ignore:no contact at all by geometry")
def test_size_ratio_of_a_thousand():
    """Large grains apart in a dust of small ones: void is what the volumes leave."""
    random = np.random.default_rng(0)
    lattice = np.stack(np.meshgrid(*3 * [np.arange(4.0)]), axis=-1).reshape(-1, 3) * 3.0
    dust = random.uniform(0, 9, (3000, 3))
    distance = np.linalg.norm(dust[:, None] - lattice, axis=2).min(axis=1)
    dust = dust[distance > 1.01]
    position = np.vstack([lattice, dust])
    radius = np.append(np.ones(len(lattice)), np.full(len(dust), 0.001))
    row = compute(
        Packing(position, radius), variants="c", tolerance=1e-3, cutoff=0.5, rv_radius=4.0
    )[0]
    assert row.alpha_vs_axial_se <= 1e-3
    inside = solid_in_ball(lattice - 4.5, 1.0, 4.0)
    assert row.solid_fraction == pytest.approx(inside, abs=0.01)


def solid_in_ball(position, radius, reach):
    """Fraction of a ball that spheres without overlap fill, by random points."""
    random = np.random.default_rng(1)
    points = random.uniform(-reach, reach, (400_000, 3))
    points = points[np.linalg.norm(points, axis=1) < reach]
    solid = np.zeros(len(points), bool)
    for center in position:
        solid |= np.linalg.norm(points - center, axis=1) < radius
    return solid.mean()


def test_many_grains_at_nearly_one_place_end_as_their_union():
    """20,000 grains within a hair of one another: whole, no gap; in the RV no void."""
    random = np.random.default_rng(2)
    position = random.normal(size=(20_000, 3)) * 1e-6
    packing = Packing(position, random.uniform(0.5, 1.5, 20_000), contacts=[[0, 1]])
    with pytest.warns(ScanfabWarning, match="no void segment reaches the cut-off"):
        rows = compute(packing, variants="ac", tolerance=1e-2)
    assert [row.segments for row in rows] == [0, 0]
    assert [row.alpha_vs for row in rows] == [None, None]
    assert rows[1].solid_fraction == pytest.approx(1.0)
