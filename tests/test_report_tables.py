"""Numbers of the report, spelt with their errors."""

from __future__ import annotations

import pytest

from scanfab.report_tables import _spell_error, _with_error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0120584, 0.00099125, "0.01206 ± 0.00099"),
        (0.0120584, 0.00099999, "0.0121 ± 0.0010"),
        (-0.3, 0.12, "-0.30 ± 0.12"),
        (12.3, 4.2, "12.3 ± 4.2"),
        (0.0120584, None, "0.01206"),
        (0.0120584, 0.0, "0.01206"),
        (None, 0.1, "-"),
    ],
)
def test_a_value_has_the_digits_that_its_error_leaves(value, error, text):
    assert _with_error(value, error) == text


@pytest.mark.parametrize(("error", "text"), [(0.001, "0.0010"), (7.41e-5, "7.4e-05"), (None, "-")])
def test_errors_have_two_digits(error, text):
    assert _spell_error(error) == text
