"""Ends of a run at which the drive is off: a closed brake holds the axis, and no torque is seen.

Such an axis stands where, at other times, it takes a torque (of a weight, of a spring). No force of
the recorded signals holds it there, so no model of the axis explains that it stands. An axis that
rests by itself, without a torque and where it takes none, is explained, and is left alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fjr_interface.experiment import RecordDescription

from .encoder_step import position_step
from .records import Record, RecordSet

_LEAST_S, _LEAST = 0.1, 20  # of the end of a run at which a drive is off; samples of it
_MARGIN_S = 0.02  # left out beside it, while brake and drive change over
_STILL = 1e-3  # of the travelled range: the most that a held axis moves
_STEPS = 1.5  # of the encoder: the most that it then reads beside one value
_NEAR = 0.05, 0.1, 0.2  # of the travelled range: passes that are told of the same place
_EACH_SIDE = 0.5  # of the torque that a place takes: the least that it takes on either side
_SMOOTH_S = 0.03  # to either side, for accelerations
_BREAKS_AWAY = 2.0  # times the friction of a motion: the most that one at rest holds
_TAKES = 0.3  # of the torque's rms while the drive is on: the least torque that a place takes
_OFF = 0.1  # of the torque's rms: the most that is seen while the drive is off
_LEFT = 0.25  # of the run: the least that is left


@dataclass(frozen=True)
class Off:
    """The ends of one run at which its drive is off.

    Attributes:
        begin: samples at its beginning.
        end: samples at its end.
        seen: rms of the torque there (N m).
        takes: torque that the axis takes at the same place at other times (N m).
    """

    begin: int
    end: int
    seen: float
    takes: float

    def told(self, rate_hz: float, unit: str = "N m") -> str:
        """Return the clause that says where the drive is off, and what shows it."""
        ends = [(self.begin, "first"), (self.end, "last")]
        where = " and ".join(f"the {at} {n / rate_hz:.3g} s" for n, at in ends if n)
        return (
            f"in {where} the position stands at a torque of {self.seen:.2g} {unit}, at a place "
            f"that takes about {self.takes:.2g} {unit} at other times: there the drive is off (a "
            "closed brake holds the axis)"
        )


def off_ends(torque: np.ndarray, position: np.ndarray, rate_hz: float) -> Off | None:
    """Find the ends of a run at which its drive is off.

    Args:
        torque: u, float64 (samples,), N m.
        position: y, likewise, rad.
        rate_hz: their rate.

    Returns:
        Whole seconds of both ends with the margin beside them; None where the drive is on at both,
        where nothing shows that it is off, or where too little of the run would be left.
    """
    travel = float(np.ptp(position))
    step = position_step([position])
    still = max(_STILL * travel, 0.0 if step is None else _STEPS * step)
    most = _OFF * float(np.sqrt(np.mean(torque**2)))
    ends = [
        _without_torque(u, y, still, most, rate_hz)
        for u, y in ((torque, position), (torque[::-1], position[::-1]))
    ]
    kept = slice(ends[0], position.size - ends[1])
    if not any(ends) or position[kept].size < _LEFT * position.size:
        return None
    passed = position[kept]
    on = _without_inertia(torque[kept], passed, rate_hz)
    takes = [_taken(on, passed, y, travel) for y in (position[0], position[-1])]
    begin, end = (n if taken else 0 for n, taken in zip(ends, takes, strict=True))
    if not begin and not end:
        return None
    off = np.concatenate([torque[:begin], torque[torque.size - end :]])
    margin = int(_MARGIN_S * rate_hz) + 1
    return Off(
        begin + margin * (begin > 0),
        end + margin * (end > 0),
        float(np.sqrt(np.mean(off**2))),
        takes[0] if begin else takes[1],
    )


def _without_torque(
    torque: np.ndarray, position: np.ndarray, still: float, most: float, rate_hz: float
) -> int:
    """Return how many samples the axis stands without a torque from the first on; 0 if briefly."""
    least = max(int(_LEAST_S * rate_hz), _LEAST)
    place = float(np.median(position[:least]))
    other = np.flatnonzero((np.abs(position - place) > still) | (np.abs(torque) > most))
    count = int(other[0]) if other.size else position.size
    return count if count >= least else 0


def _taken(torque: np.ndarray, position: np.ndarray, place: float, travel: float) -> float:
    """Return the torque that a place takes while the drive is on (N m); 0 where none is evident.

    It is what the passes of both directions have in common, as near to the place as there are both:
    friction goes both ways, and one that holds the axis may be greater than that of its motion. A
    weight or a load shows in the mean torque as well. A spring with a preload takes one torque
    above the place where it rests, the opposite one below, and none there.
    """
    mean, away = float(torque.mean()), position - place
    ways = ways_of(position, _NEAR[0] * travel)
    for near in _NEAR:
        at = np.abs(away) <= near * travel
        common, friction = _common(torque, ways * at)
        if not math.isnan(common):
            break
    beside = [_common(torque, ways * (at & (side * away >= 0.0)))[0] for side in (1.0, -1.0)]
    if math.isnan(common) or any(each * common < _EACH_SIDE * common**2 for each in beside):
        return 0.0
    least = max(_TAKES * float(np.sqrt(np.mean(torque**2))), _BREAKS_AWAY * friction)
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


def without_off_ends(records: RecordSet) -> RecordSet:
    """Return records without the ends at which the drive is off, and sentences that say so.

    Periodic runs stay as they are. Runs that repeat each other are cut alike. What a held position
    shows of its noise is kept in `Record.held`.
    """
    rate, unit = records.sample_rate_hz, "N" if records.linear else "N m"
    found = [_of_record(record, rate) for record in records.records]
    if not any(found):
        return records
    cut, notes = list(records.records), []
    for group in records.repeats:
        begin = max((off.begin for i in group if (off := found[i])), default=0)
        end = max((off.end for i in group if (off := found[i])), default=0)
        for i in group:
            cut[i] = _cut(records.records[i], begin, end)
    for record, off in zip(records.records, found, strict=True):
        if off is not None:
            notes.append(f"{record.name}: {off.told(rate, unit)}, so they are left out.")
    return replace(records, records=tuple(cut), notes=(*records.notes, *notes))


def _of_record(record: Record, rate_hz: float) -> Off | None:
    if not isinstance(record.description, RecordDescription):
        return None
    return off_ends(record.torque, record.position, rate_hz)


def _cut(record: Record, begin: int, end: int) -> Record:
    kept = slice(begin, record.samples - end)
    ends = (record.position[:begin], record.position[record.samples - end :])
    return replace(
        record,
        reference=None if record.reference is None else record.reference[kept],
        torque=record.torque[kept],
        position=record.position[kept],
        link=None if record.link is None else record.link[kept],
        held=tuple(each for each in ends if each.size),
    )
