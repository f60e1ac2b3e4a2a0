"""Times of a run at which the drive is off: a closed brake holds the axis, and no torque is seen.

Such an axis stands where, at other times, it takes a torque (of a weight, of a spring). No force of
the recorded signals holds it there, so no model of the axis explains that it stands. An axis that
rests by itself, without a torque and where it takes none, is explained, and is left alone.

What is left is joined, since the axis stands on both sides of such a time: no model needs a state
to begin with there. Its position goes on from where it stood, less what it gave way or drifted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from fjr_interface.experiment import RecordDescription

from .encoder_step import position_step
from .records import Record, RecordSet

_LEAST_S, _LEAST = 0.1, 20  # of a time at which a drive is off; samples of it
_MARGIN_S = 0.02  # left out on either side of it, while brake and drive change over
_CAUGHT_S, _GIVES = 0.5, 0.01  # after it an axis that gives way is caught; of the travelled range
_STILL = 1e-3  # of the travelled range: the most that a held axis moves
_STEPS = 1.5  # of the encoder: the most that it then reads beside one value
_NEAR = 0.05, 0.1, 0.2  # of the travelled range: passes that are told of the same place
_EACH_SIDE = 0.5  # of the torque that a place takes: the least that it takes on either side
_SMOOTH_S = 0.03  # to either side, for accelerations
_BREAKS_AWAY = 2.5  # times the friction of a motion: the most that one at rest holds
_TAKES = 0.3  # of the torque's rms while the drive is on: the least torque that a place takes
_OFF = 0.1  # of the torque's rms: the most that is seen while the drive is off
_LEFT = 0.25  # of the run: the least that is left


@dataclass(frozen=True)
class Off:
    """The times of one run at which its drive is off.

    Attributes:
        at: the samples of these times, bool (samples,).
        seen: rms of the torque there (N m).
        takes: torque that the axis takes at the same places at other times, on the average (N m).
    """

    at: np.ndarray
    seen: float
    takes: float

    @property
    def begin(self) -> int:
        """Samples of it at the beginning of the run."""
        return int(self.at.argmin())

    @property
    def end(self) -> int:
        """Samples of it at the end of the run."""
        return int(self.at[::-1].argmin())

    def told(self, rate_hz: float, unit: str = "N m") -> str:
        """Return the clause that says where the drive is off, and what shows it."""
        ends = [(self.begin, "first"), (self.end, "last")]
        where = [f"the {at} {n / rate_hz:.3g} s" for n, at in ends if n]
        within = spans_of(self.at[self.begin : self.at.size - self.end])
        if within:
            lasts = sum(span.stop - span.start for span in within) / rate_hz
            times = f"{len(within)} times" if len(within) > 1 else "once"
            first = (self.begin + within[0].start) / rate_hz
            where.append(f"{lasts:.3g} s between ({times}; from {first:.3g} s on)")
        places = " and ".join(", ".join(where).rsplit(", ", 1))
        return (
            f"in {places} the position stands at a torque of {self.seen:.2g} {unit}, "
            f"at a place that takes about {self.takes:.2g} {unit} at other times: there the drive "
            "is off (a closed brake holds the axis)"
        )


def off_times(torque: np.ndarray, position: np.ndarray, rate_hz: float) -> Off | None:
    """Find the times of a run at which its drive is off.

    Args:
        torque: u, float64 (samples,), N m.
        position: y, likewise, rad.
        rate_hz: their rate.

    Returns:
        All of them, with the margins; None where nothing shows that the drive is off, or where too
        little of the run would be left.
    """
    travel = float(np.ptp(position))
    step = position_step([position])
    still = max(_STILL * travel, 0.0 if step is None else _STEPS * step)
    most = _OFF * float(np.sqrt(np.mean(torque**2)))
    least = max(int(_LEAST_S * rate_hz), _LEAST)
    stands = _stands_without_torque(torque, position, still, most, least)
    spans = [s for s in spans_of(stands) if s.stop - s.start >= least]
    on = np.ones(position.size, dtype=bool)
    for span in spans:
        on[span] = False
    if not spans or on.sum() < _LEFT * position.size:
        return None
    passed = position[on]
    driven, ways = _without_inertia(torque[on], passed, rate_hz), ways_of(passed, _NEAR[0] * travel)
    places = [float(np.median(position[span])) for span in spans]
    takes = [_taken(driven, passed, ways, place, travel) for place in places]
    if not any(takes):
        return None
    margin = int(_MARGIN_S * rate_hz) + 1
    at = np.zeros(position.size, dtype=bool)
    for span, place, taken in zip(spans, places, takes, strict=True):
        if not taken:
            continue
        stop = span.stop + margin
        if span.start:
            after = position[stop : stop + int(_CAUGHT_S * rate_hz)] - place
            stop += _until_it_turns(after, _GIVES * travel)
        at[max(span.start - margin, 0) : stop] = True
    for between in spans_of(~at):  # too short to show anything
        at[between] |= between.stop - between.start < least
    seen = float(np.sqrt(np.mean(torque[at & ~on] ** 2)))
    return Off(at, seen, float(sum(takes) / np.count_nonzero(takes)))


def _stands_without_torque(
    torque: np.ndarray, position: np.ndarray, still: float, most: float, least: int
) -> np.ndarray:
    """Return the samples about which the axis stands without a torque for long, bool (samples,)."""
    window = min(least, position.size) | 1
    moves = ndimage.maximum_filter1d(position, window) - ndimage.minimum_filter1d(position, window)
    acts = ndimage.maximum_filter1d(np.abs(torque), window)
    inside = (moves <= 2.0 * still) & (acts <= most)
    return ndimage.maximum_filter1d(inside, window)


def _until_it_turns(away: np.ndarray, most: float) -> int:
    """Return after how many samples an axis stands or turns; 0 if it goes away further before.

    Args:
        away: its distance from where it stood (samples,), rad.
        most: the furthest that it gives way.
    """
    steps = np.diff(away)
    turns = np.flatnonzero(steps[1:] * steps[:-1] <= 0.0)
    count = int(turns[0]) + 1 if turns.size else 0
    return count if (np.abs(away[: count + 1]) <= most).all() else 0


def spans_of(at: np.ndarray) -> list[slice]:
    """Return the stretches of samples that are true in a bool array (samples,)."""
    ends = np.flatnonzero(np.diff(at.astype(np.int8), prepend=0, append=0))
    return [slice(int(a), int(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def _taken(
    torque: np.ndarray, position: np.ndarray, ways: np.ndarray, place: float, travel: float
) -> float:
    """Return the torque that a place takes while the drive is on (N m); 0 where none is evident.

    It is what the passes of both directions have in common, as near to the place as there are both:
    friction goes both ways, and one that holds the axis may be greater than that of its motion. A
    weight or a load shows in the mean torque as well. A spring with a preload takes one torque
    above the place where it rests, the opposite one below, and none there.
    """
    mean, size = float(torque.mean()), float(np.sqrt(np.mean(torque**2)))
    if abs(mean) < _TAKES * size:
        return 0.0
    away = position - place
    for near in _NEAR:
        at = np.abs(away) <= near * travel
        common, friction = _common(torque, ways * at)
        if not math.isnan(common):
            break
    beside = [_common(torque, ways * (at & (side * away >= 0.0)))[0] for side in (1.0, -1.0)]
    if math.isnan(common) or any(each * common < _EACH_SIDE * common**2 for each in beside):
        return 0.0
    rubs = np.nanmax([friction, _common(torque, ways)[1]])
    least = max(_TAKES * size, _BREAKS_AWAY * rubs)
    return common if common * mean > 0.0 and min(abs(common), abs(mean)) >= least else 0.0


def _without_inertia(torque: np.ndarray, position: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return a torque, smooth, less what goes with the acceleration, (samples,) in N m.

    Where an axis turns it accelerates alike before and after: that is no torque of the place.
    """
    half = min(max(int(_SMOOTH_S * rate_hz), 2), (position.size - 1) // 2)
    window = np.hanning(2 * half + 3)[1:-1]
    smooth, u = (
        np.convolve(np.pad(signal, half, mode="edge"), window / window.sum(), "valid")
        for signal in (position, torque)
    )
    acceleration = np.gradient(np.gradient(smooth))
    off_mean = acceleration - acceleration.mean()
    inertia = max(float(off_mean @ u) / max(float(off_mean @ off_mean), 1e-300), 0.0)
    return u - inertia * acceleration


def _common(torque: np.ndarray, ways: np.ndarray) -> tuple[float, float]:
    """Return what the torques of both directions have in common, and half of what they differ by.

    Both are in N m, and NaN where one of the directions is not passed.
    """
    passes = [torque[ways == way] for way in (1.0, -1.0)]
    if not all(each.size for each in passes):
        return math.nan, math.nan
    there, back = (float(np.median(each)) for each in passes)
    return (there + back) / 2.0, abs(there - back) / 2.0


def ways_of(position: np.ndarray, least: float) -> np.ndarray:
    """Return in which direction each sample goes further than its move did before; 0 where none.

    A move is from where the axis turns to where it turns next. It turns where it then comes back by
    `least`. So noise and steps of an encoder at rest, and friction that gives way, are no passes.

    Args:
        position: y, float64 (samples,), rad.
        least: the least move (rad).

    Returns:
        float64 (samples,): 1, -1 or 0.
    """
    ways, way, begin, low, high = np.zeros(position.size), 0, 0, 0, 0
    moves: list[tuple[int, int, int]] = []
    values = position.tolist()
    for now, value in enumerate(values):
        low = now if value < values[low] else low
        high = now if value > values[high] else high
        if way >= 0 and values[high] - value >= least:
            moves.append((way, begin, high))
            way, begin, low = -1, high, now
        elif way <= 0 and value - values[low] >= least:
            moves.append((way, begin, low))
            way, begin, high = 1, low, now
    moves.append((way, begin, position.size - 1))
    for sign, first, last in moves:
        furthest = np.maximum.accumulate(sign * position[first : last + 1])
        ways[first + 1 : last + 1] = sign * (np.diff(furthest) > 0.0)
    return ways


def without_off_times(records: RecordSet) -> RecordSet:
    """Return records without the times at which the drive is off, and sentences that say so.

    Periodic runs stay as they are. Runs that repeat each other are cut alike. What a held position
    shows of its noise is kept in `Record.held`.
    """
    rate, unit = records.sample_rate_hz, "N" if records.linear else "N m"
    found = [_of_record(record, rate) for record in records.records]
    if not any(found):
        return records
    cut, notes = list(records.records), []
    for group in records.repeats:
        off = [each.at for i in group if (each := found[i]) is not None]
        for i in group if off else ():
            cut[i] = _cut(records.records[i], np.logical_or.reduce(off))
    for record, one in zip(records.records, found, strict=True):
        if one is not None:
            notes.append(f"{record.name}: {one.told(rate, unit)}, so they are left out.")
    return replace(records, records=tuple(cut), notes=(*records.notes, *notes))


def _of_record(record: Record, rate_hz: float) -> Off | None:
    if not isinstance(record.description, RecordDescription):
        return None
    return off_times(record.torque, record.position, rate_hz)


def _cut(record: Record, off: np.ndarray) -> Record:
    """Return a record without the samples of a bool array (samples,)."""
    drift = _drift(record.position, off)
    return replace(
        record,
        reference=None if record.reference is None else record.reference[~off] - drift,
        torque=record.torque[~off],
        position=record.position[~off] - drift,
        link=None if record.link is None else record.link[~off] - drift,
        held=tuple(record.position[span] for span in spans_of(off)),
    )


def _drift(position: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Return how far the axis went in what was left out before each sample that is left.

    At a joint it then goes on as fast as beside it, by whole steps of a coarse encoder.

    Args:
        position: y, float64 (samples,), rad.
        off: what is left out, bool (samples,).

    Returns:
        float64 (samples left,), rad.
    """
    kept = np.flatnonzero(~off)
    steps = np.diff(position[kept])
    joints = np.flatnonzero(np.diff(kept) > 1)
    beside = steps[np.maximum(joints - 1, 0)] + steps[np.minimum(joints + 1, steps.size - 1)]
    drift = np.zeros(kept.size)
    drift[joints + 1] = steps[joints] - 0.5 * beside
    step = position_step([position])
    return np.cumsum(drift if step is None else step * np.rint(drift / step))
