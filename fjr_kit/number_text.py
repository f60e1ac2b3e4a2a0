"""Numbers as text for people."""

from __future__ import annotations


def unsigned_zero(text: str) -> str:
    """Return a number as text, without the sign of what is rounded to zero."""
    return text.lstrip("+-") if float(text) == 0.0 else text
