"""One declaration an option, from which the other places derive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from scanfab.base.errors import SettingsError
from scanfab.base.option import (
    number,
    one_of,
    option,
    optional,
    options_of,
    refuse_unknown,
    takes_options,
    whole,
)


@dataclass(frozen=True)
class Weather:
    wind_speed: float = option(help="How hard it blows.", group="sample", default=3.0)
    rain: str = option(help="Of `wind_speed`.", group="scan", spelling="--wet", takes="int")


WIND, RAIN = options_of(Weather)


def test_fields_declare_options_by_their_names():
    assert (WIND.name, WIND.flag, WIND.default) == ("wind_speed", "--wind-speed", 3.0)
    assert (RAIN.name, RAIN.flag, RAIN.default) == ("rain", "--wet", None)
    assert Weather() == Weather(3.0, None)


def test_a_group_is_one_of_those_of_the_help():
    with pytest.raises(AssertionError, match="weather"):
        replace(WIND, group="weather")


def test_a_function_says_what_its_options_mean_and_refuses_others():
    @takes_options(options_of(Weather))
    def forecast(*, wind_speed: float = 3.0, rain: int = 0) -> float:
        """
        What comes.

        Parameters
        ----------
        {options}
        """
        return wind_speed + rain

    assert forecast(rain=2) == 5
    assert forecast.__doc__ == (
        "What comes.\n\nParameters\n----------\n"
        "wind_speed : str, optional\n    How hard it blows.\n"
        "rain : int, optional\n    Of `wind_speed`."
    )
    with pytest.raises(TypeError, match=r"^forecast has no option 'rian': did you mean 'rain'\?$"):
        forecast(rian=2)


def test_where_no_name_is_near_all_are_named():
    with pytest.raises(TypeError, match=r"^forecast has no option 'z': there are wind, rain$"):
        refuse_unknown("forecast", ["z"], ["wind", "rain"])


@pytest.mark.parametrize("value", ["x", None, 0, -1, float("nan"), [1]])
def test_what_is_no_such_number_is_named_with_what_was_expected(value):
    with pytest.raises(SettingsError, match=r"^wind: expected a speed, found "):
        number("a speed", lambda speed: speed > 0)("wind", value)


@pytest.mark.parametrize("value", ["x", None, 1.5, "2.5", -1, float("inf")])
def test_what_is_no_whole_number_is_named(value):
    with pytest.raises(SettingsError, match=r"^days: expected 0 or more, found "):
        whole("0 or more", lambda days: days >= 0)("days", value)


def test_large_whole_numbers_stay_as_they_are():
    assert whole("any", lambda _: True)("seed", 2**60 + 1) == 2**60 + 1


def test_words_and_options_that_need_not_be_given():
    assert one_of("stop", "skip")("on_error", "skip") == "skip"
    with pytest.raises(SettingsError, match=r"^on_error: expected stop or skip, found 'go'$"):
        one_of("stop", "skip")("on_error", "go")
    assert optional(one_of("stop", "skip"))("on_error", None) is None
