"""Which particles are boundary: every operator, errors that help, and the class that encloses."""

import numpy as np
import pytest

from scanfab.base.errors import SettingsError
from scanfab.packing.boundary import BoundaryRule, select_boundary, unnamed_boundary
from scanfab.packing.packing import Packing
from scanfab.pipeline.compute import compute
from tests.helpers.lattices import unit_vectors
from tests.helpers.packed import along_x

COUNT = 6


@pytest.fixture
def packing():
    """Six grains with the ids 10 to 60 and some columns."""
    position = along_x(3 * np.arange(COUNT))
    return Packing(
        position,
        np.linspace(0.5, 1.0, COUNT),
        id=[10, 20, 30, 40, 50, 60],
        columns={
            "type": [1, 1, 2, 2, 3, 3],
            "c_ca[1]": [0.0, 1, 2, 3, 4, 5],
            "element": ["Si", "O", "O", "O", "O", "Si"],
            "v": position,
        },
    )


def chosen(packing, *expressions):
    rules = [BoundaryRule.parse(text) for text in expressions]
    return packing.id[select_boundary(packing, rules)].tolist()


@pytest.mark.parametrize(
    "text", ["", "type", "=2", "type=two", "type=1,,2", "type>1,2", "type=1..2..3", "id=40..20"]
)
def test_other_texts_are_errors_that_show_what_is_expected(text):
    with pytest.raises(SettingsError, match=r"boundary: expected COLUMN=VALUE.*found") as error:
        BoundaryRule.parse(text)
    assert repr(text) in str(error.value)


def test_selecting_everything_in_every_frame_is_an_error_that_repeats_the_expressions(packing):
    message = "type=1 or type>1 selects all particles of every frame: no grain is left"
    with pytest.raises(SettingsError, match=message):
        compute(packing, boundary=["type=1", "type>1"])


def test_the_radius_is_that_of_the_grains_whatever_the_file_calls_it():
    """And no particles select nothing."""
    packing = Packing([[0, 0, 0], [5, 0, 0]], [1.0, 2.0], columns={"radius": [9.0, 9.0]})
    assert chosen(packing, "radius>1.5") == [1]
    assert chosen(Packing(np.zeros((0, 3)), np.zeros(0)), "radius>1.5") == []


# the class that encloses

SPHERE = unit_vectors(np.random.default_rng(2), 150)


def cloud(shell, **columns):
    random = np.random.default_rng(1)
    inner = random.uniform(-1, 1, (200, 3)) * 0.5
    return Packing(np.vstack([inner, shell]), 0.01, columns=columns)


def box_shell():
    random, count = np.random.default_rng(2), 150
    points = random.uniform(-1, 1, (count, 3))
    points[np.arange(count), random.integers(0, 3, count)] = random.choice([-1, 1], count)
    return points


@pytest.mark.parametrize("shell", [SPHERE, box_shell()])
@pytest.mark.parametrize("name", ["type", "mask", "Type", "matId", "materialId"])
def test_a_class_that_encloses_the_rest_is_named(shell, name):
    values = np.r_[np.ones(200), np.full(len(shell), 3)]
    (note,) = unnamed_boundary(cloud(shell, **{name: values}))
    assert f"{name}=3" in note.text


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("type", np.arange(350) % 2),
        ("type", np.ones(350)),
        ("type", np.arange(350)),
        ("type", np.where(np.arange(350) < 200, "grain", "wall")),
        ("c_ca", np.r_[np.ones(200), np.full(150, 3)]),
    ],
)
def test_other_columns_enclose_nothing(name, values):
    """Mixed classes, one class, very many, words, and a column that is no class."""
    assert unnamed_boundary(cloud(SPHERE, **{name: values})) == []


def test_a_few_particles_are_not_judged():
    position = np.vstack([0.1 * SPHERE[:10], SPHERE[:10]])
    packing = Packing(position, 0.01, columns={"type": np.repeat([1, 3], 10)})
    assert unnamed_boundary(packing) == []


def test_a_column_that_does_not_do_is_named(packing):
    for text, told in (
        ("mask=2", r"no column .mask.; the columns are id, radius, x, y, z, type, c_ca"),
        ("element=2", "the column 'element' does not hold numbers"),
        ("v>1", "no column 'v'"),
    ):
        with pytest.raises(SettingsError, match=told):
            chosen(packing, text)


@pytest.mark.parametrize(
    ("expressions", "ids"),
    [
        ([], []),
        (["  type == 2  "], [30, 40]),
        (["type!=1,3"], [30, 40]),
        (["id>40"], [50, 60]),
        (["id>=40"], [40, 50, 60]),
        (["id<20"], [10]),
        (["id<=20"], [10, 20]),
        (["id=40.."], [40, 50, 60]),
        (["id=..20"], [10, 20]),
        (["id!=20.."], [10]),
        (["id=10,30..40,60"], [10, 30, 40, 60]),
        (["radius>9.5e-1"], [60]),
        (["c_ca[1]=-1..1"], [10, 20]),
        (["type=2", "id=10", "x>14"], [10, 30, 40, 60]),
    ],
)
def test_expressions_select_and_are_joined_by_or(packing, expressions, ids):
    assert chosen(packing, *expressions) == ids
