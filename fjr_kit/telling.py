"""Functions that are told how far work is, whoever shows it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str], None]
"""Takes what is being done, a phrase."""
CountedProgress = Callable[[int, int, str], None]
"""Takes how many are done, of how many, and what is done."""
