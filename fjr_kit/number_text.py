"""Numbers as text for people."""

from __future__ import annotations


def unsigned_zero(text: str) -> str:
    """Return a number as text, without the sign of what is rounded to zero."""
    return text.lstrip("+-") if float(text) == 0.0 else text


def formatted(value: float, form: str) -> str:
    """Return a number by a format; below a million without exponent: 130 and not 1.3e+02."""
    text = format(value, form)
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e6 else text
