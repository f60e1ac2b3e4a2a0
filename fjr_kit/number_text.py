"""Numbers as text for people."""

from __future__ import annotations

import math

SIGMA = "\N{GREEK SMALL LETTER SIGMA}"
"""What a standard deviation of noise is called."""


def unsigned_zero(text: str) -> str:
    """Return a number as text, without the sign of what is rounded to zero."""
    return text.lstrip("+-") if float(text) == 0.0 else text


def formatted(value: float, form: str) -> str:
    """Return a number by a format; below a million without exponent: 130 and not 1.3e+02."""
    text = format(value, form)
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e6 else text


def three_digits(value: float | None) -> str:
    """Return a number with three significant digits; a dash where it is not known."""
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"
