"""A chart of characters: magnitudes in dB over a logarithmic frequency axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_COLUMNS, _ROWS = 64, 14


def chart(frequency_hz: np.ndarray, curves: Mapping[str, np.ndarray]) -> str:
    """Return lines of text that show curves.

    Args:
        frequency_hz: (F,), positive and rising.
        curves: magnitudes of shape (F,) by the character that marks them; the first lies on top.
            Zeros and what is not finite are left out.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        decibels = {mark: 20.0 * np.log10(values) for mark, values in curves.items()}
    there = np.concatenate([each[np.isfinite(each)] for each in decibels.values()])
    if not there.size:
        return "(nothing to show)"
    low, high = float(there.min()), max(float(there.max()), float(there.min()) + 1.0)
    position = np.log(frequency_hz / frequency_hz[0])
    span = float(position[-1]) or 1.0
    columns = np.rint(position / span * (_COLUMNS - 1)).astype(int)
    field = np.full((_ROWS, _COLUMNS), " ")
    for mark, values in reversed(decibels.items()):
        shown = np.isfinite(values)
        rows = np.rint((high - values[shown]) / (high - low) * (_ROWS - 1)).astype(int)
        field[rows, columns[shown]] = mark
    labels = {0: f"{high:7.1f} |", _ROWS - 1: f"{low:7.1f} |"}
    lines = [labels.get(row, "        |") + "".join(field[row]).rstrip() for row in range(_ROWS)]
    ends = f"{frequency_hz[0]:g}", f"{frequency_hz[-1]:g}"
    lines.append(" " * 9 + ends[0] + ends[1].rjust(_COLUMNS - len(ends[0])))
    return "\n".join(lines)
