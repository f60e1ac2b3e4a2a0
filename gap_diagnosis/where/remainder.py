"""What the remainder looks like: with which quantity the torque goes that the best model lacks.

An observer holds the model to the recorded motion; the torque that it adds is, below its crossover,
the torque that the model lacks. How much of it a smooth function of one quantity explains is the
share that is said to go with that quantity (correlation ratio).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from fjr_records.records import Record

BINS = 24
LEAST_SHARE = 0.08
_PER_CYCLE = 12
_CYCLES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 36, 48, 72, 96, 144)


def looks_like(records: Sequence[Record], missing: Sequence[np.ndarray], smooth: int) -> list[str]:
    """Return phrases for what the missing torque goes with, strongest first.

    Args:
        records: the records.
        missing: missing torque of each, float64 (samples,), N m.
        smooth: samples over which velocity and torque are averaged.
    """
    torque = np.concatenate([uniform_filter1d(m, smooth) for m in missing])
    quantities: dict[str, np.ndarray] = {name: np.concatenate(values) for name, values in {
        "velocity": [_rate(uniform_filter1d(r.position, smooth)) for r in records],
        "angle": [r.position for r in records],
        "torque": [uniform_filter1d(r.torque, smooth) for r in records],
        "change of torque": [_rate(uniform_filter1d(r.torque, smooth)) for r in records],
        "acceleration": [_rate(_rate(uniform_filter1d(r.position, 2 * smooth))) for r in records],
        "time": [np.linspace(0.0, 1.0, r.samples) for r in records],
        "run": [np.full(r.samples, float(k)) for k, r in enumerate(records)],
    }.items()}  # fmt: skip
    centred = torque - torque.mean()
    total = float(np.mean(torque**2))
    if not total > 0.0:
        return []
    shares = {"a constant torque": float(torque.mean() ** 2) / total}
    words = {
        "velocity": "velocity (a law of friction)",
        "angle": "the angle, slowly (gravity, a spring)",
        "torque": "the torque (drive gain, load-dependent loss)",
        "change of torque": "the change of torque (timing)",
        "acceleration": "acceleration (inertia)",
        "time": "time (drift)",
        "run": "the run (scatter from run to run)",
    }
    for name, values in quantities.items():
        shares[words[name]] = _explained(values, centred) / total
    cycles, share = _periodic(quantities["angle"], centred)
    if share > 0.0:
        shares[f"the angle, {cycles} times per turn (ripple)"] = share / total
    low = _at_low_speed(quantities["velocity"], centred)
    if low is not None:
        shares["low speed (breakaway, presliding)"] = low
    ordered = sorted(shares, key=lambda name: -shares[name])
    return [f"{name}: {shares[name]:.0%}" for name in ordered if shares[name] >= LEAST_SHARE]


def share_of_velocity(
    records: Sequence[Record], missing: Sequence[np.ndarray], smooth: int
) -> float:
    """Return the share of the missing torque that a function of velocity explains, see above."""
    torque = np.concatenate([uniform_filter1d(m, smooth) for m in missing])
    velocity = np.concatenate([_rate(uniform_filter1d(r.position, smooth)) for r in records])
    total = float(np.mean(torque**2))
    return _explained(velocity, torque - torque.mean()) / total if total > 0.0 else 0.0


def _rate(signal: np.ndarray) -> np.ndarray:
    return np.gradient(signal)


def _explained(values: np.ndarray, torque: np.ndarray) -> float:
    """Return the mean square of the torque that a function of some values explains."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    if edges.size < 3:
        return 0.0
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    return _between(bins, torque)


def _between(bins: np.ndarray, torque: np.ndarray) -> float:
    count = np.bincount(bins)
    sums = np.bincount(bins, torque)
    means = np.divide(sums, count, out=np.zeros(count.size), where=count > 0)
    return float(np.sum(count * means**2) / torque.size)


def _periodic(angle: np.ndarray, torque: np.ndarray) -> tuple[int, float]:
    """Return the cycles per turn that explain most, where several cycles were travelled."""
    best, share = 0, 0.0
    turns = float(np.ptp(angle)) / (2.0 * np.pi)
    for cycles in _CYCLES:
        if cycles * turns < 2.0:
            continue
        phase = (cycles * angle / (2.0 * np.pi)) % 1.0
        found = _between((phase * _PER_CYCLE).astype(int), torque)
        if found > share:
            best, share = cycles, found
    return best, share


def _at_low_speed(velocity: np.ndarray, torque: np.ndarray) -> float | None:
    """Return the share of the torque beyond its part at a tenth of the samples, the slowest."""
    slow = np.abs(velocity) <= np.quantile(np.abs(velocity), 0.1)
    power = float(np.sum(torque**2))
    if not power > 0.0 or not slow.any():
        return None
    return max(float(np.sum(torque[slow] ** 2)) / power - float(slow.mean()), 0.0)
