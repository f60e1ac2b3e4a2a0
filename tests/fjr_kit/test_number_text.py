"""Numbers as people read them."""

import pytest

from fjr_kit.number_text import formatted, three_digits


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        (134.6, ".2g", "135"),
        (9.87, ".2g", "9.9"),
        (99.7, ".2g", "100"),
        (0.00012, ".2g", "0.00012"),
        (-4321.0, ".3g", "-4321"),
        (2.5e7, ".3g", "2.5e+07"),
        (1e-9, ".2g", "1e-09"),
        (-33.24, ".1f", "-33.2"),
    ],
)
def test_what_is_below_a_million_has_no_exponent(value, form, text):
    assert formatted(value, form) == text


def test_what_is_not_known_is_a_dash():
    assert [three_digits(v) for v in (None, float("nan"), float("inf"))] == ["-"] * 3
    assert [three_digits(v) for v in (0.0, 12.345, -0.00012345)] == ["0", "12.3", "-0.000123"]
