"""Whole numbers of a bus that were logged without regard to their sign."""

from __future__ import annotations

import numpy as np

_HALF = 2**15
_SIGN_BITS = range(7, 15)  # the bit that tells the direction
_PASSES = 3  # of the bit, at least
_SMOOTHER = 0.3  # of the steps at which the bit changes: what is left of them with the right sign
_BOTH_WAYS = 0.02  # of the samples, at least, in each direction


def with_sign(quantity: str, column: np.ndarray) -> tuple[np.ndarray, str | None]:
    """Return a column with its sign, and the clause that says what was taken how, or None.

    Args:
        quantity: what it is mapped as.
        column: float64 (samples,), NaN where a row holds none.
    """
    if _complement(column):
        signed = np.where(column >= _HALF, column - 2 * _HALF, column)
        return signed, (
            f"{quantity} is a 16-bit word that was read without its sign: 65535 is taken as -1"
        )
    bit = _sign_bit(column) if quantity == "torque" else None
    if bit is None:
        return column, None
    return _by_magnitude(column, bit), (
        f"{quantity} is a word of a magnitude and a bit for the direction: {bit} and above are "
        f"taken as the other direction, {bit + 1} as -1"
    )


def _complement(column: np.ndarray) -> bool:
    """Tell whether whole numbers up to 65535 crowd at both ends, with nothing between."""
    column = column[np.isfinite(column)]
    if column.size < 2 or column.min() < 0 or not _HALF <= column.max() < 2 * _HALF:
        return False
    between = (column > _HALF // 2) & (column < 3 * _HALF // 2)
    return not between.any() and bool((column < _HALF).any()) and bool((column % 1 == 0).all())


def _sign_bit(column: np.ndarray) -> int | None:
    """Return the bit that tells the direction of a magnitude; None where it is none.

    As a direction it makes the signal smoother: about zero the word jumps by the whole bit.
    """
    column = column[np.isfinite(column)]
    if column.size < 2 or column.min() < 0 or (column % 1 != 0).any():
        return None
    place = int(np.log2(max(column.max(), 1.0)))
    bit = 2**place
    high = float(np.mean(column >= bit))
    if place not in _SIGN_BITS or not _BOTH_WAYS < high < 1.0 - _BOTH_WAYS:
        return None
    passes = np.diff(column >= bit)
    steps = (np.abs(np.diff(each)[passes]).mean() for each in (_by_magnitude(column, bit), column))
    right, read = steps
    return bit if passes.sum() >= _PASSES and right < _SMOOTHER * read else None


def _by_magnitude(column: np.ndarray, bit: int) -> np.ndarray:
    return np.where(column >= bit, bit - column, column)
