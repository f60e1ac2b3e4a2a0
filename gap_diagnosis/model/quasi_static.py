"""Records so slow that inertia moves nothing: their torque over the angle is the evidence.

A position that is held step after step, or a sweep that takes minutes, is often recorded at a rate
at which no motion of the rig could be followed. Nothing is lost by that: what the torque must
overcome is known from angle, direction and speed alone. So no motion is played; the torque that a
model needs along the recorded motion is compared with the recorded one (inverse dynamics without
inertia). Each run is averaged over equal ways first, its **stations**: rest counts no more than
motion, and where the motion has just turned round nothing is compared (`sliding`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet
from fjr_sim_node.plant.statics import torque_along

from .record_loop import RecordLoop
from .rig_model import Model
from .sliding import behind_play, sliding, yields_over

NOTE = (
    "Of motion as slow as this only what acts at rest or in slow motion can be seen: friction, "
    "gravity, springs, ripples over the angle, a constant torque."
)

_INERTIA_SHARE = 0.05  # of the rms torque: the most that inertia may take,
_QUICK = 0.1  # but for such a part of the time: a sweep turns round
_NOISE_SHARE = 0.2  # of that torque: what noise alone may feign once the position is averaged,
_CLEAR = 2.0  # times what noise feigns: more is motion
_LONGEST_S = 0.2  # over no longer than that,
_HIDDEN = 0.3  # and no longer than leaves out this much of the torque: inertia may take that
_STATIONS = 4000  # of all runs together
_FEWEST = 256
_JITTER, _LEAST_MOVE = 3.0, 1e-4  # times the median move, times the range: less is no travel


@dataclass(frozen=True)
class Stations:
    """Slow runs, averaged over equal ways.

    Attributes:
        records: their angle and torque, a sample for each station.
        speeds: of each run, float64 (stations,), rad/s.
        directions: of travel, likewise: 1 or -1.
    """

    records: RecordSet
    speeds: tuple[np.ndarray, ...]
    directions: tuple[np.ndarray, ...]


def stations(records: RecordSet, nominal: Mapping[str, float]) -> Stations | None:
    """Return the stations of records; None where inertia counts, or too little is travelled.

    Args:
        records: the runs.
        nominal: datasheet values by the names of PLANT.
    """
    plant = Model.nominal(nominal).plant
    inertia = plant["jm"] + plant.get("j", 0.0)
    rate, runs = records.sample_rate_hz, records.records
    noise = record_noise(records)
    noise_rad = noise.std_rad if noise.known else 0.0
    shares = [_inertia_share(r, rate, inertia, noise_rad) for r in runs]
    slow = [share <= _INERTIA_SHARE for share in shares]
    if any(np.mean(still) < 1.0 - _QUICK for still in slow):
        return None
    travels = [_travel(r.position) for r in runs]
    length = sum(float(np.abs(moves).sum()) for moves, _ in travels) / _STATIONS
    if not length > 0.0:
        return None

    def averaged(ways: Sequence[np.ndarray]) -> list[tuple[Record, np.ndarray, np.ndarray]]:
        each = zip(runs, travels, ways, slow, strict=True)
        return [_averaged(r, moves, way, still, length, rate) for r, (moves, _), way, still in each]

    found = averaged([sliding(moves, length) for moves, _ in travels])
    over = yields_over([(record.torque, speed, way) for record, speed, way in found])
    if over > 1.0:
        longer = averaged([sliding(moves, over * length) for moves, _ in travels])
        found = longer if _enough(longer) else found
    if not _enough(found):  # it turns round all the time: better friction on its way than nothing
        found = averaged([direction for _, direction in travels])
    if not _enough(found):
        return None
    made, speeds, directions = zip(*found, strict=True)
    seconds = sum(r.samples for r in runs) / rate
    stations_hz = sum(record.samples for record in made) / seconds
    return Stations(replace(records, sample_rate_hz=stations_hz, records=made), speeds, directions)


def _enough(found: Sequence[tuple[Record, np.ndarray, np.ndarray]]) -> bool:
    """Tell whether every run has stations enough."""
    return min(record.samples for record, *_ in found) >= _FEWEST


def _inertia_share(record: Record, rate: float, inertia: float, noise_rad: float) -> np.ndarray:
    """Return the torque that inertia takes at each sample, over the recorded rms torque.

    The position is averaged over as many samples as noise calls for, which feigns motion; over
    fewer, where most of the time more is seen than that: an axis that turns on and on swings at the
    ripples that it passes, faster than long averages show. Torque that is quicker than that may
    move the inertia unseen.
    """
    whole = max(float(np.sqrt(np.mean(record.torque**2))), 1e-300)
    for samples in range(1, max(int(_LONGEST_S * rate), 1) + 1):
        # white noise, averaged twice, in the second difference
        feigned = noise_rad * rate**2 * (np.sqrt(6.0) if samples == 1 else 2.0 / samples**2)
        feigned_share = inertia * feigned / whole
        position = _smoothed(record.position, samples)
        share = inertia * np.pad(np.abs(np.diff(position, 2)), 1, mode="edge") * rate**2 / whole
        if np.median(share) > max(_CLEAR * feigned_share, _INERTIA_SHARE):
            return share
        if feigned_share <= _NOISE_SHARE * _INERTIA_SHARE:
            hidden = record.torque - _smoothed(record.torque, samples)
            if np.sqrt(np.mean(hidden**2)) > _HIDDEN * whole:
                break
            return share
    return np.full(record.samples, np.inf)


def _smoothed(signal: np.ndarray, samples: int) -> np.ndarray:
    """Return a signal averaged twice over so many samples."""
    return np.asarray(uniform_filter1d(uniform_filter1d(signal, samples), samples))


def _travel(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the move at each sample (rad), and the direction of the last: 0 before any move.

    A move counts once it leaves a play whose width is that of what is no travel.
    """
    width = max(
        _JITTER * float(np.median(np.abs(np.diff(position)))),
        _LEAST_MOVE * float(np.ptp(position)),
    )
    followed = behind_play(position, width)
    moves = np.diff(followed, prepend=followed[0])
    last = np.maximum.accumulate(np.where(moves != 0.0, np.arange(moves.size), -1))
    direction = np.where(last >= 0, np.sign(moves[last]), 0.0)
    return moves, direction


def _averaged(
    record: Record,
    moves: np.ndarray,
    direction: np.ndarray,
    slow: np.ndarray,
    length: float,
    rate: float,
) -> tuple[Record, np.ndarray, np.ndarray]:
    """Return a run averaged over ways of a length, with the speed and direction of each.

    Where inertia takes torque, as between two speeds, it is left out.
    """
    moving = (direction != 0.0) & slow
    place = (np.cumsum(np.abs(moves)) / length).astype(int)[moving]
    direction = direction[moving]
    changes = (np.diff(place) != 0) | (np.diff(direction) != 0.0)
    station = np.concatenate([[0], np.cumsum(changes)]) if place.size else place
    count = np.maximum(np.bincount(station), 1)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(station, values) / count

    averaged = replace(
        record, reference=None, link=None, torque=mean(record.torque[moving]),
        position=mean(record.position[moving]),
        description=record.description.model_copy(update={"controller": None}),
    )  # fmt: skip
    return averaged, mean(moves[moving]) * rate, mean(direction)


class QuasiStaticSimulator:
    """Answers as `RecordSimulator` does, for stations: by torque alone, in units of the motion.

    The rig is held to the recorded angle by a stiffness of as much torque as there is, for as much
    motion as there is; so a share of the torque that a model lacks is the same share of the motion.

    Attributes:
        loop: of no run known.
        crossover_hz: up to which the torque is known along the motion.
        speeds: of each run, float64 (stations,), rad/s.
    """

    def __init__(self, found: Stations) -> None:
        """Take the stations."""
        self._found, self._records = found, found.records.records
        self.loop = RecordLoop.unknown(len(self._records))
        self.speeds = found.speeds
        self.crossover_hz = found.records.sample_rate_hz / 8.0
        torque = np.mean([np.mean(r.torque**2) for r in self._records])
        motion = np.mean([np.var(r.position) for r in self._records])
        self._stiffness = float(np.sqrt(torque / motion))

    def response(self, frequency_hz: np.ndarray, index: int) -> np.ndarray:
        """Return the stiffness that holds a run, at all frequencies; complex, N m/rad."""
        return np.full(np.shape(frequency_hz), self._stiffness, complex)

    def run(self, models: Sequence[Model], which: Sequence[int]) -> list[list[np.ndarray]]:
        """Return y, u and q of each model in each run, see `RecordSimulator.run`."""
        return [[self._run(model, index) for index in which] for model in models]

    def missing_torque(self, model: Model, which: Sequence[int]) -> list[np.ndarray]:
        """Return the torque that a model needs beyond the recorded one, N m."""
        return [self._needed(model, i) - self._records[i].torque for i in which]

    def held(self, model: Model, which: Sequence[int]) -> list[np.ndarray]:
        """Return y, u and q of a model along each recorded motion, see `RecordSimulator.held`."""
        angles = [(self._records[i].position, self._needed(model, i)) for i in which]
        return [np.array([angle, needed, angle]) for angle, needed in angles]

    def added(self, _: Model) -> Callable[[np.ndarray], np.ndarray]:
        """Return what says how a torque is seen that a model lacks: as it is."""
        return lambda torque: torque

    def _run(self, model: Model, index: int) -> np.ndarray:
        record, needed = self._records[index], self._needed(model, index)
        held = record.position - (needed - record.torque) / self._stiffness
        return np.array([held, needed, held])

    def _needed(self, model: Model, index: int) -> np.ndarray:
        angle = self._records[index].position
        torque = np.empty(angle.size)
        torque_along(
            angle, self._found.speeds[index], self._found.directions[index],
            model.plant_coefficients, model.effect_coefficients, torque,
        )  # fmt: skip
        return torque
