"""Signals that are logged more often than they are refreshed: each value is seen k times.

A position that was read at 100 Hz and logged at 1 kHz stands still for nine samples and jumps at
the tenth. No axis moves so. Such files are brought to the rate at which the position was read: its
new values, and the mean of the torque until the next one, which moves the axis as the torque did.

A coarse encoder repeats values as well, but irregularly, and by one step at a time. A torque that
is held is what a slow controller makes, and is only told.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .known_torque import KNOWN
from .part import LEAST_SAMPLES
from .record_file import Samples

_FEWEST = 20  # changes that tell a rate
_REGULAR = 0.98  # of the changes: at every k-th sample
_LARGE, _OFTEN = 1.5, 0.5  # steps of an encoder that a change holds, of so many changes
_SEEN = 0.5  # of the k-th samples: at so many the value changes while the axis moves
_ANGLES = ("position", "link")


def refreshed_every(signal: np.ndarray) -> tuple[int, int]:
    """Return at every how many samples a signal changes, and at which sample first.

    Args:
        signal: float64 (samples,).

    Returns:
        k and the first of these samples, below k; (1, 0) where it may change at any sample, or
        where the steps may be those of an encoder.
    """
    steps = np.diff(signal)
    changes = np.flatnonzero(steps) + 1
    if changes.size < _FEWEST:
        return 1, 0
    between = np.diff(changes)
    k = int(np.bincount(np.minimum(between, signal.size // _FEWEST)).argmax())
    sizes = np.abs(steps[changes - 1])
    if np.mean(sizes > _LARGE * sizes.min()) < _OFTEN:
        return 1, 0
    counts = np.bincount(changes % k, minlength=k)
    first = int(counts.argmax())
    regular = counts[first] >= _REGULAR * changes.size and np.mean(between == k) >= _SEEN
    return (k, first) if regular and k > 1 else (1, 0)


def at_the_rate_of_angles(samples: Sequence[Samples], *, fixed: bool) -> list[Samples]:
    """Bring files to the rate at which their angles were refreshed, where that is slower.

    Args:
        samples: of each file.
        fixed: whether what the user says counts in samples of the files, so that all must stay.

    Returns:
        The same with notes, or with doubts where all must stay. Angles with stamps of their own
        are not looked at.
    """
    found = [_slowest(each) for each in samples]
    k = math.lcm(*(every for every, _ in found))
    long = all(each.values["position"].size >= LEAST_SAMPLES * (k + 1) for each in samples)
    if k == 1 or fixed or not long or not all(map(_together, samples)):
        return [_told(each, every) for each, (every, _) in zip(samples, found, strict=True)]
    return [_mended(each, k, first) for each, (_, first) in zip(samples, found, strict=True)]


def _together(samples: Samples) -> bool:
    """Tell whether all signals were logged at the same instants."""
    return len({id(stamps) for stamps in samples.timing.stamps_s.values()}) < 2


def _slowest(samples: Samples) -> tuple[int, int]:
    """Return at every how many samples the slowest angle changes, and at which first."""
    angles = [samples.values[each] for each in _ANGLES if each in samples.values]
    return max(map(refreshed_every, angles)) if _together(samples) else (1, 0)


def _mended(samples: Samples, k: int, first: int) -> Samples:
    """Return a file at a k-th of its rate, from one of the samples at which angles change."""
    values, timing = samples.values, samples.timing
    count = (values["position"].size - first) // k
    rows = slice(first, first + k * count, k)
    taken = {
        quantity: each[first : first + k * count].reshape(count, k).mean(axis=1)
        if quantity in ("torque", KNOWN)
        else each[rows]
        for quantity, each in values.items()
    }
    stamps = {quantity: each[rows] for quantity, each in timing.stamps_s.items()}
    if stamps:
        stamps = dict.fromkeys(stamps, stamps["position"])
    rate = timing.rate_hz / k
    note = (
        f"{_seen(timing.rate_hz, k)}; so it is brought to {rate:.6g} Hz, by the mean of the torque "
        "from each new position to the next"
    )
    slower = replace(timing, rate_hz=rate, stamps_s=stamps)
    return replace(samples, values=taken, timing=slower, notes=(*samples.notes, note))


def _told(samples: Samples, k: int) -> Samples:
    """Return a file with the sentences that say how often its signals were refreshed."""
    rate = samples.timing.rate_hz
    if k > 1:
        doubt = (
            f"{_seen(rate, k)}, and no axis moves in such steps: give every {_nth(k)} sample "
            "alone, and the samples per period in these"
        )
        return replace(samples, doubts=(*samples.doubts, doubt))
    if "torque" not in samples.values or not _together(samples):
        return samples
    k, _ = refreshed_every(samples.values["torque"])
    if k == 1:
        return samples
    held = f"the torque changes only at every {_nth(k)} sample"
    note = f"{held}, as of a controller of {rate / k:g} Hz or of a stepped excitation"
    return replace(samples, notes=(*samples.notes, note))


def _seen(rate_hz: float, k: int) -> str:
    return (
        f"the position changes only at every {_nth(k)} sample while the axis moves: it was logged "
        f"at {rate_hz:.6g} Hz, but refreshed at {rate_hz / k:.6g} Hz"
    )


def _nth(k: int) -> str:
    ending = {1: "st", 2: "nd", 3: "rd"}.get(k % 10, "th") if k % 100 // 10 != 1 else "th"
    return f"{k}{ending}"
