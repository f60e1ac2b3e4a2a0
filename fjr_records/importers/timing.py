"""When the samples of a file were taken, and its signals on one even grid.

Signals of a jittered clock are resampled as those of a bag are. Where no clock can be followed at
all, samples are joined by straight lines. The error is stated either way.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fjr_interface.resampling.accuracy import LEAST_SAMPLES, Survey
from fjr_interface.resampling.grid_stream import Grid, GridStream
from fjr_kit.errors import InputError

from .stamps import GIVE_RATE, Clock, read_clock

GREATEST_ERROR = 0.2
"""Greatest rms error of the position by straight lines, relative to its rms; with stamps of its
own, of the reference too."""
MOST_SAMPLES = 16
"""Most samples of the grid for each sample of the file."""
_PIECE = 4096


@dataclass(frozen=True)
class Timing:
    """When the samples of a file were taken.

    Attributes:
        rate_hz: mean sample rate, of the slowest signal if each has stamps of its own.
        stamps_s: {quantity: its stamps, strictly rising, float64 (samples,)}; empty where all
            signals are sampled evenly at the same instants.
        gaps: steps longer than 1.5 usual ones.
        longest_gap_s: the longest of them, 0 without any.
        notes: what was taken how, sentences without the file's name.
    """

    rate_hz: float
    stamps_s: Mapping[str, np.ndarray]
    gaps: int = 0
    longest_gap_s: float = 0.0
    notes: tuple[str, ...] = ()


def of_one_clock(
    path: Path,
    values: Mapping[str, np.ndarray],
    time: np.ndarray | None,
    given_hz: float | None,
    *,
    slow: bool,
) -> tuple[dict[str, np.ndarray], Timing]:
    """Understand the time column of signals that are sampled together.

    Args:
        path: the file.
        values: {quantity: (samples,)}.
        time: the time column in s, (samples,); None without one.
        given_hz: sample rate that the user gave.
        slow: whether it may be slower than `stamps.SLOWEST_HZ`.

    Returns:
        The samples to use, and when they were taken.

    Raises:
        InputError: it is no time, or not in s.
    """
    copies = time is not None and _copies(time, values.values())
    clock = read_clock(str(path), time, given_hz, slow=slow, copies=copies)
    used = {q: each if clock.kept is None else each[clock.kept] for q, each in values.items()}
    stamps = {} if clock.stamps_s is None else dict.fromkeys(used, clock.stamps_s)
    return used, Timing(clock.rate_hz, stamps, clock.gaps, clock.longest_gap_s, clock.notes)


def of_own_clocks(
    path: Path,
    values: Mapping[str, np.ndarray],
    times: Mapping[str, np.ndarray],
    given_hz: float | None,
    *,
    slow: Collection[str],
) -> tuple[dict[str, np.ndarray], Timing]:
    """Understand the stamps of signals of which each has its own.

    Args:
        path: the file.
        values: {quantity: (its samples,)}.
        times: {quantity: its stamps in s (its samples,)}.
        given_hz: rate of the grid; None takes that of the slowest signal.
        slow: quantities that may be slower than `stamps.SLOWEST_HZ`.

    Returns:
        The samples to use, and when they were taken.

    Raises:
        InputError: stamps are no time, not in s, or have no time in common.
    """
    clocks = {
        q: read_clock(f"{path}: {q}", time, None, slow=q in slow, copies=_copies(time, [values[q]]))
        for q, time in times.items()
    }
    used, stamps = {}, {}
    for quantity, clock in clocks.items():
        kept = slice(None) if clock.kept is None else clock.kept
        used[quantity] = values[quantity][kept]
        stamps[quantity] = _instants(clock, times[quantity][kept])
    begin = max(each[0] for each in stamps.values())
    end = min(each[-1] for each in stamps.values())
    if not begin < end:
        spans = "; ".join(f"{q} {each[0]:.6g} to {each[-1]:.6g} s" for q, each in stamps.items())
        raise InputError(
            f"{path}: the stamps of its signals have no time in common ({spans}); map stamps of "
            "one clock."
        )
    longest = max(clocks.values(), key=lambda clock: clock.longest_gap_s)
    rates = [float(f"{clock.rate_hz:.3g}") for clock in clocks.values()]
    notes = [f"{q}: {note}" for q, clock in clocks.items() for note in clock.notes]
    notes.append(
        f"its signals have stamps of their own ({', '.join(stamps)}): they are brought onto one "
        f"grid over the {end - begin:.6g} s that all of them cover"
    )
    gaps = sum(clock.gaps for clock in clocks.values())
    rate = given_hz or min(rates)
    return used, Timing(rate, stamps, gaps, longest.longest_gap_s, tuple(notes))


def _copies(time: np.ndarray, values: Iterable[np.ndarray]) -> bool:
    """Tell whether samples that repeat a stamp repeat all signals as well; each (samples,)."""
    repeats = np.diff(time) == 0
    return bool(repeats.any()) and not any(np.diff(each)[repeats].any() for each in values)


def _instants(clock: Clock, time: np.ndarray) -> np.ndarray:
    """Return stamps in s, those that were rounded on their straight line; both (samples,)."""
    if clock.stamps_s is not None:
        return clock.stamps_s
    numbers = np.arange(time.size) - (time.size - 1) / 2.0
    return float(time.mean()) + numbers / clock.rate_hz


def resample(
    path: Path, timing: Timing, signals: Mapping[str, np.ndarray], rate_hz: float
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Bring unevenly sampled signals onto a grid.

    Args:
        path: the file.
        timing: when they were sampled.
        signals: {quantity: float64 (its samples,)}.
        rate_hz: of the grid.

    Returns:
        The signals on the grid, {quantity: float64 (samples,)}, and sentences on the error of each.

    Raises:
        InputError: they cannot be brought there faithfully.
    """
    for stamps in timing.stamps_s.values():
        if (stamps[-1] - stamps[0]) * rate_hz > MOST_SAMPLES * stamps.size + LEAST_SAMPLES:
            raise InputError(
                f"{path}: {stamps.size} samples in {stamps[-1] - stamps[0]:g} s are too few for "
                f"{rate_hz:g} Hz; give a lower sample rate."
            )
    try:
        return _as_bags_are(path, timing.stamps_s, signals, rate_hz)
    except InputError as why:
        return _by_lines(path, timing.stamps_s, signals, rate_hz, str(why))


def _as_bags_are(
    path: Path,
    stamps_s: Mapping[str, np.ndarray],
    signals: Mapping[str, np.ndarray],
    rate_hz: float,
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    origin_s = max(each[0] for each in stamps_s.values())
    end_s = min(each[-1] for each in stamps_s.values())
    last = math.floor((end_s - origin_s) * rate_hz + 1e-6)
    out, sentences = {}, []
    for name, values in signals.items():
        stamps = np.rint((stamps_s[name] - origin_s) * 1e9).astype(np.int64)
        pieces = [slice(at, at + _PIECE) for at in range(0, stamps.size, _PIECE)]
        survey = Survey(str(path), name, name)
        for piece in pieces:
            survey.add(stamps[piece], values[piece])
        found = survey.finish()
        stream = GridStream(found, Grid(0, rate_hz, 0, last))
        for piece in pieces:
            stream.add(stamps[piece], values[piece])
        stream.finish()
        out[name] = stream.take(last + 1)
        named = replace(found, topic="uneven stamps")
        sentences.append(named.sentence.rstrip("."))
    return out, tuple(sentences)


def _by_lines(
    path: Path,
    stamps_s: Mapping[str, np.ndarray],
    signals: Mapping[str, np.ndarray],
    rate_hz: float,
    why: str,
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Join the samples by straight lines; each sample left out in turn shows the error."""
    begin = max(each[0] for each in stamps_s.values())
    end = min(each[-1] for each in stamps_s.values())
    grid = begin + np.arange(math.floor((end - begin) * rate_hz + 1e-6) + 1) / rate_hz
    together = all(each is stamps_s["position"] for each in stamps_s.values())
    out, errors = {}, []
    for name, values in signals.items():
        stamps = stamps_s[name]
        before, here, after = stamps[:-2], stamps[1:-1], stamps[2:]
        share = (here - before) / (after - before)
        left_out = values[:-2] + share * (values[2:] - values[:-2]) - values[1:-1]
        error, rms = float(np.sqrt(np.mean(left_out**2))), float(np.std(values))
        relative = error / rms if rms else 0.0
        limited = name == "position" or (name == "reference" and not together)
        if limited and relative > GREATEST_ERROR:
            raise InputError(
                f"{why.rstrip('.')}; nor do straight lines between the samples do: their error is "
                f"{relative:.0%} of the {name}'s rms; {GIVE_RATE}."
            )
        out[name] = np.interp(grid, stamps, values)
        errors.append(f"{name} {relative:.2g}")
    return out, (
        "its stamps follow no clock, so the samples are joined by straight lines; a sample that is "
        f"left out is met to this part of the signal's rms: {', '.join(errors)}",
    )
