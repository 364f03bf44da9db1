"""Options, columns and notes, each declared once."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from scanfab.base.errors import Note, SettingsError, joined
from scanfab.base.option import number, one_of, option, optional, options_of, takes_options, whole
from scanfab.io import ReadOptions


@dataclass(frozen=True)
class Weather:
    wind_speed: float = option(group="sample", default=3.0, form="KNOTS")
    """How hard it blows."""
    rain: int | None = option(group="scan", spelling="--wet", form="N|auto")
    """
    Of
    `wind_speed`.
    """


def test_a_function_says_what_its_options_mean_and_refuses_others():
    @takes_options(options_of(Weather))
    def forecast(*, wind_speed: float = 3.0, rain: int = 0) -> float:
        """{options}"""
        return wind_speed + rain

    assert [(one.flag, one.kind) for one in options_of(Weather)] == [
        ("--wind-speed", float), ("--wet", int)
    ]  # fmt: skip
    assert forecast(rain=2) == 5
    assert forecast.__doc__ == (
        "wind_speed : float, optional\n    How hard it blows.\n"
        "rain : int, optional\n    Of `wind_speed`. Written as ``N|auto``."
    )
    with pytest.raises(TypeError, match=r"^forecast has no option 'rian': did you mean 'rain'\?$"):
        forecast(rian=2)
    with pytest.raises(TypeError, match=r"'z': the options are wind_speed, rain$"):
        forecast(z=2)


def test_types_of_options_may_be_evaluated_in_their_module_or_not():
    """The reader's are objects, because its module has no future import; those above are texts."""
    numbers = {one.name: one.kind for one in options_of(ReadOptions) if one.kind is not str}
    assert numbers == {"skip": int, "radius": float, "max_unpacked": float}
    assert "beside" not in {one.name for one in options_of(ReadOptions)}


SPEED, DAYS = number("a speed", lambda speed: speed > 0), whole("0 or more", lambda days: days >= 0)
WORD = optional(one_of("stop", "skip"))


@pytest.mark.parametrize(
    ("parse", "expected", "values"),
    [
        (SPEED, "a speed", ["x", None, 0, -1, float("nan"), [1]]),
        (DAYS, "0 or more", ["x", None, 1.5, "2.5", -1, float("inf")]),
        (WORD, "stop or skip", ["go", 3]),
    ],
)
def test_an_unusable_value_is_named_with_what_was_expected(parse, expected, values):
    for value in values:
        with pytest.raises(SettingsError, match=rf"^wind: expected {expected}, found "):
            parse("wind", value)


def test_usable_values_stay_as_they_are():
    assert (WORD("on_error", "skip"), WORD("on_error", None)) == ("skip", None)
    assert DAYS("seed", 2**60 + 1) == 2**60 + 1


def test_a_sentence_is_said_once_of_all_its_variants():
    notes = [Note("a", "dense", ("b",)), Note("a", "loose", ("c",)), Note("a", "dense", ("d",))]
    assert joined(notes) == (Note("a", "dense", ("b", "d")), Note("a", "loose", ("c",)))


def test_without_a_place_it_says_the_sentence_alone():
    assert Note("a", "dense", ("c",)).told("") == "dense"
