"""Messages of a loop as an observer sees them, drawn as timelines."""

from __future__ import annotations

import numpy as np

from fjr_bringup.rehearsal.timing import RECORD

RATE = 500.0
PERIOD_NS = 2_000_000
EPOCH_NS = 1_760_000_000_000_000_000


def messages(stamps, lateness_ns=0, transport_ns=100_000, value=0.1):
    """Return messages sent `lateness_ns` after their sample instants."""
    out = np.zeros(len(stamps), RECORD)
    out["stamp"] = stamps
    out["sent"] = EPOCH_NS + out["stamp"] + lateness_ns
    out["received"] = out["sent"] + transport_ns
    out["value"] = value
    return out


def grid(samples):
    return PERIOD_NS * np.arange(1, samples + 1)


def loop(samples=1000, latency_ns=600_000):
    """Return (r, y, u) of a loop that runs well."""
    stamps = grid(samples)
    return (
        messages(stamps, -1_000_000_000),
        messages(stamps, 5_000),
        messages(stamps, 5_000 + latency_ns - 100_000, value=3.0),
    )
