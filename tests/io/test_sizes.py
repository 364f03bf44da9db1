"""Radii and diameters of one file: they agree as exactly as they are printed, or it is an error."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError
from scanfab.io.sizes import other_size
from scanfab.io.writer import installed_writers
from tests.helpers.dumps import write

RADII = np.random.default_rng(5).uniform(0.001, 30, 200)
WRITERS = {name: one.plugin for name, one in installed_writers().items()}
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")


def table(folder, sizes, name="s.csv", names="radius,diameter"):
    rows = "".join(f"{3 * place},0,0,{words}\n" for place, words in enumerate(sizes))
    return write(folder / name, f"x,y,z,{names}\n{rows}")


@pytest.mark.parametrize("format", ["%.3f", "%.2f", "%g", "%.3g", "%.2e", "%.17g", "%.9g"])
def test_numbers_that_agree_before_they_are_printed_agree(format):
    radius = RADII[RADII > 0.2]
    printed, twice = (np.array([float(format % one) for one in v]) for v in (radius, 2 * radius))
    assert other_size(printed, twice) is None
    assert other_size(np.float32(radius).astype(float), np.float32(2 * radius)) is None


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.002, 1000])
def test_those_that_do_not_are_found(factor):
    assert other_size(RADII, 2 * RADII) is None
    wrong = 2 * RADII
    wrong[17] *= factor
    assert other_size(RADII, wrong) == 17
    assert other_size(np.round(RADII, 3), np.round(2 * RADII * factor, 3)) is not None


def test_whole_numbers_are_exact():
    assert other_size(np.array([1.0, 2.0]), np.array([2, 4])) is None
    assert other_size(np.array([1.0, 2.0]), np.array([2, 5])) == 1
    assert other_size(np.array([1.0]), np.array([1.0])) == 0


def test_what_is_no_diameter_of_each_grain_says_nothing():
    radius = np.array([1.0])
    for other in (np.array(["big"]), np.array([[1.0, 2.0]]), np.array([np.nan])):
        assert other_size(radius, other) is None


@pytest.mark.parametrize("names", ["radius,diameter", "r,Diam"])
def test_a_table_that_contradicts_itself_names_both_columns_and_the_way_out(tmp_path, names):
    path = table(tmp_path, ["0.5,1", "1,1"], names=names)
    own, other = names.split(",")
    words = rf"'{own}' and '{other}' contradict each other: grain 2 has 1 and 1, .*"
    with pytest.raises(ReadError, match=words + rf'columns=.*"radius": "{own}".*"{other}"'):
        scanfab.read(path)
    assert scanfab.read(path, columns={"radius": own}).radius.tolist() == [0.5, 1]
    assert scanfab.read(path, columns={"radius": 4}).radius.tolist() == [0.5, 1]
    assert scanfab.read(path, columns={"diameter": other}).radius.tolist() == [0.5, 0.5]


@pytest.mark.filterwarnings("error")
def test_one_that_does_not_is_read_without_a_word(tmp_path):
    path = table(tmp_path, ["0.333,0.667", "1,2"])
    packing = scanfab.read(path)
    assert packing.radius.tolist() == [0.333, 1]
    assert packing.columns["diameter"].tolist() == [0.667, 2]


def test_a_dump_of_another_format_likewise(tmp_path):
    head = "2\nProperties=pos:R:3:radius:R:1:diameter:R:1\n"
    path = write(tmp_path / "a.xyz", f"{head}0 0 0 0.5 1\n3 0 0 0.5 0.5\n")
    with pytest.raises(ReadError, match="contradict each other: grain 2"):
        scanfab.read(path)
    assert scanfab.read(path, columns={"radius": "radius"}).radius.tolist() == [0.5, 0.5]
    assert scanfab.read(path, columns={"diameter": "diameter"}).radius.tolist() == [0.5, 0.25]


@pytest.mark.parametrize("name", WRITERS)
def test_what_was_chosen_stays_chosen_in_what_convert_writes(tmp_path, name):
    path = table(tmp_path, ["0.5,1", "1,1"])
    packing = scanfab.read(path, columns={"radius": "radius"})
    (out,) = scanfab.convert(packing, tmp_path / f"a{WRITERS[name].extensions[0]}", to=name)
    again = scanfab.read(out)
    assert again.radius.tolist() == [0.5, 1]
    assert again.columns["diameter_of_dump"].tolist() == [1, 1]
