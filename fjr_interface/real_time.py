"""Real time: the mode of the nodes, settings of their processes, and the count of late samples."""

from __future__ import annotations

import ctypes
import gc

import numpy as np

from .parameters import Parameter

LOCKSTEP, REAL_TIME = "lockstep", "realtime"

NEVER = 2**62
"""An instant in ns that is never reached."""

MODE_PARAMETER = Parameter(
    "mode",
    LOCKSTEP,
    "",
    "lockstep: each sample waits for the torque of the one before; realtime: samples come by the "
    "steady clock and nobody waits. Read when the node starts",
    choices=(LOCKSTEP, REAL_TIME),
)

_PR_SET_TIMERSLACK = 29
_BIN_NS = 10_000
_BINS = 20_000


def keep_pauses_out() -> None:
    """Keep the garbage collector and the kernel's timer slack out of the loop.

    For the start of a realization: garbage is collected now, and then no more.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
    gc.disable()
    ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1)


class Histogram:
    """Counts of durations in bins of 10 us up to 0.2 s, cheap enough for every sample."""

    def __init__(self) -> None:
        """Start empty."""
        self._counts = np.zeros(_BINS + 1, np.int64)
        self.worst_ns = 0

    def add(self, duration_ns: int) -> None:
        """Count one duration; a negative one counts as zero."""
        self._counts[min(max(duration_ns, 0) // _BIN_NS, _BINS)] += 1
        if duration_ns > self.worst_ns:
            self.worst_ns = duration_ns

    @property
    def counts(self) -> np.ndarray:
        """Counts, int64 of shape (bins,); the last bin holds everything longer."""
        return self._counts.copy()

    def quantile_s(self, share: float) -> float:
        """Return the duration in s that this share of all stays below, never above the worst."""
        total = np.cumsum(self._counts)
        if not total[-1]:
            return 0.0
        at = int(np.searchsorted(total, max(share * total[-1], 1)))
        return (self.worst_ns if at == _BINS else min((at + 1) * _BIN_NS, self.worst_ns)) * 1e-9

    def describe(self) -> str:
        """Return median, p99, p99.9 and the worst in ms, as a phrase."""
        marks = (("p50", 0.5), ("p99", 0.99), ("p99.9", 0.999))
        parts = [f"{name} {self.quantile_s(share) * 1e3:.2f}" for name, share in marks]
        return ", ".join([*parts, f"worst {self.worst_ns * 1e-6:.2f} ms"])
