"""Which column says what is a clump: the format's own, or the one that the user names."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from tests.helpers.dumps import NAMES, dump_text, write
from tests.helpers.truth import SAMPLE_DATA

CLUMPS = SAMPLE_DATA / "clumps"


def dump(tmp_path, column, values, **options):
    """Four spheres in a row with one more column."""
    rows = [(k, 1, 0.2 * k, 0.5, 0.5, 0.1, value) for k, value in enumerate(values)]
    path = write(tmp_path / "dump.txt", dump_text(rows, f"{NAMES} {column}", box=((0, 2),) * 3))
    return scanfab.read(path, **options)


def heads(packing):
    return None if packing.bodies is None else packing.bodies.head.tolist()


@pytest.mark.parametrize("column", ["id_multisphere", "clumpId", "clump_id", "clump", "CLUMP"])
def test_columns_that_number_clumps_are_taken_by_their_name(tmp_path, column):
    """Negative numbers are spheres that are no part of a clump."""
    assert heads(dump(tmp_path, column, [0, 0, -1, -1])) == [0, 0, 2, 3]


def test_molecules_are_taken_if_the_user_names_them_and_0_is_none(tmp_path):
    assert heads(dump(tmp_path, "mol", [1, 1, 0, 0])) is None
    assert heads(dump(tmp_path, "mol", [1, 1, 0, 0], bodies="mol")) == [0, 0, 2, 3]


def test_any_column_may_be_named_and_id_makes_each_sphere_a_grain(tmp_path):
    values = [5, 5, 8, 8]
    assert heads(dump(tmp_path, "c_body", values)) is None
    assert heads(dump(tmp_path, "c_body", values, bodies="c_body")) == [0, 0, 2, 2]
    assert heads(dump(tmp_path, "c_body", values, columns={"clump": "c_body"})) == [0, 0, 2, 2]
    assert heads(dump(tmp_path, "clump", values, bodies="id")) is None
    assert heads(dump(tmp_path, "clump", values, bodies="type")) == [0, 0, 0, 0]


def test_a_column_that_is_not_there_is_an_error_that_names_those_that_are(tmp_path):
    with pytest.raises(
        ReadError, match=r"dump.txt: `bodies`: there is no column 'body'; .*are id, .*clump"
    ):
        dump(tmp_path, "clump", [1, 1, 2, 2], bodies="body")


@pytest.mark.parametrize("value", [1.5, "nan", 1e300])
def test_numbers_that_are_not_whole_are_an_error(tmp_path, value):
    with pytest.raises(ReadError, match=r"the column clump: .* whole numbers"):
        dump(tmp_path, "clump", [1, 1, value, 2])


def test_an_empty_frame_has_no_bodies(tmp_path):
    text = dump_text([], f"{NAMES} clump") + dump_text([(1, 1, 0.5, 0.5, 0.5, 0.1, 3)], step=1)
    path = write(tmp_path / "dump.txt", text)
    assert scanfab.read(path, bodies="clump").bodies is None


@pytest.mark.parametrize(
    ("name", "grains", "spheres"),
    [("clumps.xml.bz2", 60, 90), ("clumps_spheres.0.vtu", 60, 90), ("multisphere_2.txt", 40, 80)],
)
def test_what_the_programs_write_of_clumps_is_read(name, grains, spheres):
    packing = scanfab.read(CLUMPS / name)
    assert (packing.bodies.count(np.ones(len(packing), bool)), len(packing)) == (grains, spheres)


SHAPES = "shapex shapey shapez blockiness1 blockiness2"


def superquadrics(tmp_path, *values):
    row = (1, 1, 0.5, 0.5, 0.5, 0.1, *values)
    return scanfab.read(write(tmp_path / "dump.txt", dump_text([row], f"{NAMES} {SHAPES}")))


def test_superquadrics_are_refused_unless_they_are_spheres(tmp_path):
    assert superquadrics(tmp_path, 0.1, 0.1, 0.1, 2, 2).radius.tolist() == [0.1]
    for values in [(0.1, 0.1, 0.08, 2, 2), (0.1, 0.1, 0.1, 4, 2), (0.06, 0.06, 0.06, 8, 8)]:
        with pytest.raises(ReadError, match=r"dump.txt, step 0: 1 of 1 particles are super"):
            superquadrics(tmp_path, *values)
