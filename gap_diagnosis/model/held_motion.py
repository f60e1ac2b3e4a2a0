"""The motion that a recorded torque would make against the loop that holds the rig."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fjr_records.records import Record, RecordSet

from .lapped import lapped

_SOFT = 1e-6  # of torque over motion: the gain of a loop that holds next to nothing


def held_lines(
    records: RecordSet, response: Callable[[np.ndarray, int], np.ndarray], hop: int, lines: int
) -> list[np.ndarray]:
    """Return the lines of that motion in each run, float64 (windows, lines), rad.

    Args:
        records: the runs.
        response: takes frequencies (Hz) and the index of a run; returns the complex gain of what
            holds the rig there (N m/rad).
        hop: half the length of a window, samples.
        lines: how many lines hold a signal, from line 0 on.
    """
    frequency = (np.arange(lines) + 0.5) * 0.5 * records.sample_rate_hz / hop
    return [
        lapped(record.torque, hop)[:, :lines]
        / np.maximum(np.abs(response(frequency, index)), _least_held(record))
        for index, record in enumerate(records.records)
    ]


def _least_held(record: Record) -> float:
    """Return the gain of a loop (N m/rad) that holds next to nothing, above zero."""
    return _SOFT * float(np.std(record.torque) / max(np.std(record.position), 1e-30)) + 1e-300
