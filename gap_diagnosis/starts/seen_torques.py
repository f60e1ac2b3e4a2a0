"""Ripples, loads and frictions, seen along the recorded motion in the torque that the model lacks.

A ripple that holds a motor at rest, or decides where it stops, moves it far from where the model
without it goes; what it does cannot be predicted along the model's motion. Nor can a load that the
integrator of a loop takes over: the motion hardly shows it. Of two laws of friction that a
datasheet lacks, each fitted alone does what both do, and a fit that begins there seldom gets to
where both are. But an observer that holds the model to the recorded motion says which torque the
model lacks at each recorded angle and speed: size, number and phase follow by least squares, and
are starting points as they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from fjr_sim_node import effects as fx

from ..model.evidence import Evidence
from ..model.rig_model import Model
from .over_angle import peaks, ripple_of, transformed
from .seen_inertia import SeenInertia
from .seen_resonance import hidden, torque_of_mass, with_mass
from .seen_together import LAWS, Seen, heavier, load_parameters, load_torques, solved

FRICTIONS = tuple(name.split(".")[0] for name in LAWS)
"""Laws of friction that are seen."""

_PER_CROSSOVER = 8.0  # averages in a period of the observer's crossover
_FASTEST = 1.0  # ripples of a higher frequency, over the crossover, the observer does not follow
_REST, _FALLS, _SLIDES = 0.03, 0.05, 0.2
"""Of the rms velocity: below the first friction is whatever holds, above the second it may fall
from breakaway; above the third it slides, though it yields before."""
_PEAKS = 2
_MOST_SEEN = 400  # numbers of ripples, of which each is fitted
_NEARLY, _ALIKE = 0.95, 4  # of the best; how many of those that explain so much


class SeenTorques:
    """The torque that a model lacks along the recorded motion of the fitted parts."""

    def __init__(self, evidence: Evidence, parts: Sequence[int], model: Model) -> None:
        """Hold the model to the recorded motion.

        Args:
            evidence: the records.
            parts: indices of the fitted parts; what others show is not looked at.
            model: the fit beside which a ripple is looked for.
        """
        simulator, self._model = evidence.simulator, model
        rate, records = evidence.records.sample_rate_hz, evidence.records.records
        self._crossover_hz = simulator.crossover_hz
        every = max(int(rate / (_PER_CROSSOVER * simulator.crossover_hz)), 1)
        runs = sorted({evidence.parts[p].record for p in parts})
        self._added, self._every = simulator.added(model), every
        self._swings_free = evidence.records.swings_free
        self._ends = np.cumsum([records[index].samples for index in runs])[:-1]
        self._angles = [records[index].position for index in runs]
        self._rate = rate
        self._places, columns, motions = [], [], []
        for index, missing in zip(runs, simulator.missing_torque(model, runs), strict=True):
            record = records[index]
            seen = np.zeros(record.samples, bool)
            for part in (evidence.parts[p] for p in parts if evidence.parts[p].record == index):
                begin = evidence.hop * part.windows.start + evidence.hop // 2
                seen[begin : begin + evidence.hop * (part.windows.stop - part.windows.start)] = True
            velocity = np.gradient(_averaged(record.position, every)) * rate / every
            smooth = uniform_filter1d(missing, every)  # as the motion that it is compared with
            signals = [
                _averaged(s, every) for s in (record.position, record.torque, missing, smooth)
            ]
            rows = _averaged(seen.astype(float), every) > 0.5
            acceleration = np.gradient(velocity) * rate / every
            columns.append(np.array([*signals, velocity, acceleration])[:, rows])
            self._places.append(rows)
            motions.append(_motion(record.position, every, rate))
        found: np.ndarray = np.concatenate(columns, axis=1)
        self._angle, self._torque, self._missing, self._smooth = found[:4]
        self._velocity, self._acceleration = found[4:]
        self._motion: np.ndarray = np.concatenate(motions, axis=1)
        self._usual_speed = float(np.sqrt(np.mean(self._velocity**2) + 1e-300))

    @property
    def enough(self) -> bool:
        """Whether enough is seen to solve for anything, and the model keeps to the motion."""
        return self._angle.size >= 4 * _PER_CROSSOVER and bool(np.isfinite(self._missing).all())

    def _seen(self, torque: np.ndarray) -> np.ndarray:
        """Return what is seen of a torque that the model lacks along the motion, (places,).

        Args:
            torque: (samples,) of all runs, N m.
        """
        pieces = zip(np.split(torque, self._ends), self._places, strict=True)
        return np.concatenate(
            [_averaged(self._added(piece), self._every)[rows] for piece, rows in pieces]
        )

    def load(self, effect: str) -> list[dict[str, float]]:
        """Return the starting point of a torque that depends on the angle alone, or on nothing.

        Args:
            effect: one of `LOADS`.
        """
        if not self.enough:
            return []
        angle, velocity, acceleration = self._motion
        columns = load_torques(effect, angle)
        every = [*columns, velocity, np.sign(velocity)]
        every += [] if self._swings_free else [acceleration]
        sizes, _ = solved([self._seen(column) for column in every], self._smooth)
        seed = load_parameters(effect, sizes[: len(columns)])
        return [] if seed is None else [seed]

    def together(self, effects: Sequence[str]) -> list[tuple[tuple[str, ...], Model]]:
        """Return frictions and a load that only together explain what is seen; see `Seen`.

        Args:
            effects: identifiers of what may be there.
        """
        if not np.isfinite(self._missing).all():
            return []
        found = []
        for slowest, explained in ((_SLIDES, Seen.together), (_FALLS, Seen.falling)):
            rows = np.abs(self._velocity) > slowest * self._usual_speed
            if rows.sum() >= 8 * _PER_CROSSOVER:
                found += explained(self._at(rows), effects)
        return found

    def _at(self, rows: np.ndarray) -> Seen:
        """Return what is seen at some places."""
        angle, velocity, acceleration = self._motion
        return Seen(
            self._model, angle, velocity, acceleration, self._smooth[rows],
            lambda torque: self._seen(torque)[rows], not self._swings_free,
        )  # fmt: skip

    def friction(self, effect: str) -> list[Model]:
        """Return models with a law of friction more: alone, and with those of the fit solved anew.

        First with the inertia solved, too, since a fit that lacks friction may have bent it, then
        with the fit's, since a motor that play frees from its load now and then seems lighter. At
        rest friction is whatever holds, so only what moves is looked at.

        Args:
            effect: one of `FRICTIONS`.
        """
        own = next(name for name in LAWS if name.startswith(f"{effect}."))
        there = [name for name in LAWS if name != own and self._model.effects.get(name)]
        groups = [[own], [own, *there]] if there else [[own]]
        rows = np.abs(self._velocity) > _SLIDES * self._usual_speed
        if rows.sum() < 4 * _PER_CROSSOVER or not np.isfinite(self._missing).all():
            return []
        found = [model for names in groups if (model := self._solved(names, rows)) is not None]
        return [*found, *(Model(self._model.plant, model.effects) for model in found)]

    def _solved(self, names: Sequence[str], rows: np.ndarray) -> Model | None:
        """Return the model with sizes of laws of friction solved; None if one is below zero."""
        plant, effects = self._model.plant, self._model.effects
        angle, velocity, acceleration = self._motion
        follow = [n for n in LAWS if n not in names and plant.get(fx.parameter(n).adds_to)]
        torques = [LAWS[name](velocity) for name in (*names, *follow)]
        torques += [np.ones(velocity.size), angle]
        torques += [] if self._swings_free else [-acceleration]
        columns = [self._seen(torque)[rows] for torque in torques]
        added, _ = solved(columns, self._smooth[rows])
        inertia = 0.0 if self._swings_free else added[-1]
        sizes = {n: effects.get(n, 0.0) + size for n, size in zip(names, added, strict=False)}
        return None if min(sizes.values()) <= 0.0 else heavier(self._model, inertia, sizes)

    def resonance(self) -> list[Model]:
        """Return models of a rigid axis with a mass behind a spring more, see `seen_resonance`."""
        if not self.enough:
            return []
        angle, velocity, acceleration = self._motion
        torques = [np.ones(angle.size), angle, velocity, np.sign(velocity), -acceleration]
        beside = [self._seen(torque) for torque in torques]
        found = hidden(
            self._angles, self._rate, self._crossover_hz, beside, self._smooth, self._seen
        )
        models = [with_mass(self._model, mass) for mass in found]
        return [model for model in models if model is not None]

    def inertia(self, turns: bool) -> SeenInertia | None:
        """Return what is seen of the inertia of a rigid axis; None where too little is.

        Args:
            turns: whether the axis is rotary, so that weight goes with the sine of its angle.
        """
        if not self.enough:
            return None
        angle, velocity, acceleration = self._motion
        rows = np.abs(self._velocity) > _SLIDES * self._usual_speed
        beside = [np.ones(angle.size), angle, *([np.sin(angle), np.cos(angle)] if turns else [])]
        beside += [velocity, np.sign(velocity), velocity * np.abs(velocity)]

        def at_rows(torque: np.ndarray) -> np.ndarray:
            return self._seen(torque)[rows]

        seen = SeenInertia(
            self._model.plant["jm"], self._torque[rows], self._smooth[rows], at_rows(acceleration),
            np.array([at_rows(torque) for torque in beside]),
            lambda w, zeta: at_rows(torque_of_mass(w, zeta, self._angles, self._rate)),
        )  # fmt: skip
        return seen if seen.enough else None

    def seeds(self, effect: str, tried: np.ndarray) -> list[dict[str, float]]:
        """Return starting points of a ripple, by full parameter names.

        Args:
            effect: a ripple that acts as a torque on the motor; of others nothing is seen.
            tried: numbers of ripples per turn, ascending.
        """
        factor = self._factor(effect)
        fastest = 2.0 * np.pi * self._crossover_hz * _FASTEST
        tried = tried[tried * self._usual_speed < fastest]
        if factor is None or tried.size < 3 or not np.isfinite(self._missing).all():
            return []
        rows = factor != 0.0
        if rows.sum() < 4 * _PER_CROSSOVER:
            return []
        angle, factor, velocity = self._angle[rows], factor[rows], self._velocity[rows]
        base = [np.ones(angle.size), velocity, np.sign(velocity), angle, self._acceleration[rows]]
        basis = np.linalg.qr(np.array(base).T)[0]
        missing = _beyond(basis, self._missing[rows])
        tried = _likely(missing * factor, angle, tried)

        def fitted(cycles: float) -> tuple[float, np.ndarray]:
            waves = factor[:, None] * np.array([np.sin(cycles * angle), np.cos(cycles * angle)]).T
            waves = _beyond(basis, waves)
            sizes = np.linalg.lstsq(waves, missing, rcond=1e-6)[0]
            return float(missing @ (waves @ sizes)), sizes

        explained = np.array([fitted(cycles)[0] for cycles in tried])
        return [ripple_of(effect, tried[k], fitted(tried[k])[1]) for k in _best(explained)]

    def _factor(self, effect: str) -> np.ndarray | None:
        """Return what the sine of a ripple is multiplied by to be a torque on the motor."""
        entry = fx.EFFECTS[effect]
        if entry.acts_on == "transmission" or not entry.ripple:
            return None
        if entry.acts_on == "motor":
            moving = np.abs(self._velocity) > _REST * self._usual_speed
            return np.where(moving, -np.sign(self._velocity), 0.0)
        if not entry.full_parameters[0].unit:  # a share of the torque, not a torque
            return self._torque
        return np.ones(self._angle.size)


def _likely(pull: np.ndarray, angle: np.ndarray, tried: np.ndarray) -> np.ndarray:
    """Return numbers of cycles from all over, and those that a torque pulls at most, ascending.

    Args:
        pull: what a torque at each time gains, (samples,).
        angle: (samples,), rad.
        tried: numbers per turn, ascending in even steps.
    """
    if tried.size <= _MOST_SEEN:
        return tried
    half = _MOST_SEEN // 2
    even = np.linspace(0, tried.size - 1, half).astype(int)
    strongest = peaks(np.abs(transformed(pull, angle, tried)))[:half]
    return tried[np.union1d(even, strongest)]


def _best(explained: np.ndarray) -> list[int]:
    """Return the places of the highest peaks, and some of all that explain nearly as much.

    What moves over less than a ripple or two cannot tell one number of ripples from the next.
    """
    highest = peaks(explained)[:_PEAKS]
    near = np.flatnonzero(explained >= _NEARLY * explained.max())
    some = near[np.linspace(0, near.size - 1, min(near.size, _ALIKE)).astype(int)]
    return sorted({*highest.tolist(), *some.tolist()})


def _motion(position: np.ndarray, every: int, rate: float) -> np.ndarray:
    """Return angle, velocity and acceleration, averaged over as many samples, (3, samples)."""
    angle = uniform_filter1d(position, every)
    return np.array([savgol_filter(angle, 5, 4, deriv=n, delta=1.0 / rate) for n in range(3)])


def _averaged(signal: np.ndarray, every: int) -> np.ndarray:
    count = signal.size // every
    return signal[: count * every].reshape(count, every).mean(axis=1)


def _beyond(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values - basis @ (basis.T @ values)
