"""Ripples over the motor angle that could explain what a fit leaves of records.

A ripple acts as a torque along the recorded motion: it lies there though the model is a ripple
further. What it does to the position is predicted linearly, by the response of plant and controller
(or observer), G/(1 + G C_y); back through that response goes what the fit leaves, and pulls at each
number of ripples. How much is the transform of the pull over the angle, one for all numbers. Those
that it pulls at most are calculated, and only the best are simulated. The torque is made at each
sample and then averaged over as many as the lines of the evidence allow. Along a steady period it
is periodic as the motion is; along any other record the response is that from rest.

A strong ripple of a number that is off by a thousandth drifts against the true one, which shows on
slow lines long before it does at the ripple itself. So a number counts as well that gains far more
on the lines from one of their octaves upwards (`upper_bands`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from scipy import ndimage
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from fjr_sim_node import effects as fx
from fjr_sim_node.theory.linear import g0

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.small_changes import averaged_over, changes, pulls
from ..model.steady_runs import SteadyRuns
from .over_angle import ripple_of, transformed, waves
from .promising import ALL, leading, promising
from .upper_bands import Gains, UpperBands

_PARTS = (0.5, 0.25, 0.125)  # of a step, by which the best numbers are moved
_LEAST_FIRST = 0.1  # of the second harmonic: a smaller first one is no ripple of that number
_REST, _RESTS_S = 0.001, 0.1  # of the rms velocity: below it an axis rests, for as long at least
_FREE_HZ = 1e-3  # below, a free body has no response
_FORGOTTEN = 1e-6  # of the energy of an impulse response: what is left of it then is no memory


class Ripples:
    """What ripples could do about the errors that a fit leaves."""

    def __init__(
        self,
        evidence: Evidence,
        parts: Sequence[int],
        model: Model,
        weight: np.ndarray,
        residuals: np.ndarray,
        jacobian: np.ndarray,
    ) -> None:
        """Simulate the model's motion once.

        Args:
            evidence: the records.
            parts: that are fitted.
            model: beside which ripples are sought.
            weight: (errors,), one over the standard deviation of each error.
            residuals: (errors,), the model's errors, times their weight.
            jacobian: (errors, parameters), of these by the parameters that may follow.
        """
        self._evidence, self._parts, self._weight = evidence, tuple(parts), weight
        self._runs = sorted({evidence.parts[i].record for i in parts})
        records = evidence.records
        self._run_in = records.run_in if isinstance(records, SteadyRuns) else 0
        whole = evidence.simulator.run([model], self._runs)[0]
        motion = [run[:, self._run_in :] for run in whole]
        self._angles = [records.records[i].position[self._run_in :] for i in self._runs]
        self._torque = [run[1].astype(np.float32) for run in motion]
        self._twist = [(run[2] - run[0]).astype(np.float32) for run in motion]
        self._direction = [np.sign(np.gradient(run[0])).astype(np.float32) for run in motion]
        least = max(int(_RESTS_S * records.sample_rate_hz), 1)
        self._moves = [_moves(run[0], least) for run in motion]
        self._every = averaged_over(evidence.hop, evidence.lines, self._whole_blocks())
        self._responses = [self._response(model, index, run.size // self._every) for index, run
                           in zip(self._runs, self._angles, strict=True)]  # fmt: skip
        self._bands = UpperBands(evidence, self._parts, jacobian, residuals)
        self._stiffness = model.plant.get("k0", 0.0)

    def _whole_blocks(self) -> int:
        """Return how many samples averages must divide: those of a steady period; 0 for any."""
        return math.gcd(self._run_in, self._angles[0].size) if self._run_in else 0

    def seeds(self, effect: str, tried: np.ndarray, most: int) -> list[dict[str, float]]:
        """Return the ripples that promise most, by full parameter names, best first.

        They have the sizes and phases that explain most. Those that promise most on all lines come
        first, then those that the slow lines speak against.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            tried: numbers of cycles per turn to try, ascending.
            most: how many to return on all lines, each a maximum of its own.
        """
        likely, step = self._likely(effect, tried, 1), float(np.ptp(tried)) / max(len(tried) - 1, 1)
        falls = np.array([self._gains(effect, (c,)).falls for c in likely])
        found = [
            self._refined(effect, likely[i], falls[i], step, lowest)
            for i, lowest in leading(falls, most)
        ]
        return [ripple_of(effect, cycles, sizes) for cycles, sizes in dict(found).items()]

    def _refined(
        self, effect: str, cycles: float, falls: np.ndarray, step: float, lowest: int
    ) -> tuple[float, np.ndarray]:
        """Return the number of cycles that gains most on lines from a band up, and its sizes.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            cycles: a number that gains more than its neighbours.
            falls: (bands,), what it gains.
            step: from one number that was tried to the next.
            lowest: band from which upwards lines are counted.
        """
        gain = falls[lowest]
        for part in _PARTS:
            sides = [cycles + sign * part * step for sign in (-1.0, 1.0)]
            gains = [self._gains(effect, (side,)).falls[lowest] for side in sides]
            if max(gains) > gain:
                cycles, gain = sides[int(np.argmax(gains))], max(gains)
        return float(cycles), self._gains(effect, (cycles,)).sizes[lowest]

    def harmonics(self, effect: str, tried: np.ndarray, most: int) -> list[dict[str, float]]:
        """Return the ripples with a second harmonic that promise most, best first.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            tried: numbers to try, ascending.
            most: how many to return on all lines, each a maximum of its own.

        Returns:
            values by the names of the effect's parameters.
        """
        tried = self._likely(effect, tried, 2)
        gains = [self._gains(effect, (float(c), 2.0 * float(c))) for c in tried]
        names = fx.EFFECTS[effect].names
        found = []
        for i, lowest in leading(np.array([gain.falls for gain in gains]), most):
            sizes = gains[i].sizes[lowest]
            first, second = complex(*sizes[:2]), complex(*sizes[2:])
            phase, size = cmath.phase(first), max(abs(first), _LEAST_FIRST * abs(second))
            bend = math.remainder(cmath.phase(second) - 2.0 * phase, 2.0 * math.pi)
            values = (size, float(tried[i]), phase, abs(second) / size, bend)
            found.append(dict(zip(names, values, strict=True)))
        return found

    def _gains(self, effect: str, cycles: Sequence[float]) -> Gains:
        """Return what sine and cosine of each number of cycles gain from each band upwards."""
        own = []
        for number in cycles:
            moved = {
                index: self._moved(k, self._torques(effect, k, number))
                for k, index in enumerate(self._runs)
            }
            moves = changes(self._evidence, moved, self._parts, self._every)
            own.append(moves * self._weight)
        return self._bands.gains(np.concatenate(own))

    def _likely(self, effect: str, tried: np.ndarray, harmonics: int) -> np.ndarray:
        """Return the numbers of cycles that are worth a calculation of their own, ascending.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            tried: numbers to try, ascending in even steps.
            harmonics: of a ripple, which count together.
        """
        if len(tried) <= ALL:
            return tried
        numbers = [h * tried for h in range(1, harmonics + 1)]
        bands = range(len(self._bands))
        pulls = np.array([[self._pulled(effect, n, k) for n in numbers] for k in bands])
        return promising(tried, pulls, lambda c: self._gains(effect, (c,)).squares)

    def _pulled(self, effect: str, tried: np.ndarray, lowest: int = 0) -> np.ndarray:
        """Return the squares of what pulls at sine and cosine of numbers of cycles.

        Args:
            effect: identifier of an effect that is periodic in the motor angle.
            tried: numbers of cycles in even steps, at least two.
            lowest: band from which upwards lines are counted.
        """
        found = np.zeros(len(tried), complex)
        for k, pull in enumerate(self._pulls[lowest]):
            angle = self._angles[k][: pull.shape[1]]
            for place, of_slope, factor in self._factors(effect, k):
                sums = transformed(factor[: angle.size] * pull[place], angle, tried)
                found += 1j * tried * sums if of_slope else sums
        return np.abs(found) ** 2

    @cached_property
    def _pulls(self) -> list[list[np.ndarray]]:
        """What pulls at torques from each band upwards, of each run.

        Each (2, N): at a torque on the motor, and between link and motor.
        """
        return [self._pulls_from(lowest) for lowest in range(len(self._bands))]

    def _pulls_from(self, lowest: int) -> list[np.ndarray]:
        left, found = self._bands.left(lowest), []
        of_runs = pulls(self._evidence, left * self._weight, self._parts, self._every)
        for k, index in enumerate(self._runs):
            pull = of_runs[index][self._run_in // self._every :]
            size = self._size(k, pull.size)
            spectra = self._responses[k].conj() * rfft(pull, size)
            blocks = irfft(spectra, size)[:, : pull.size] / self._every
            found.append(np.repeat(blocks, self._every, axis=1).astype(np.float32))
        return found

    def _torques(self, effect: str, k: int, cycles: float) -> np.ndarray:
        """Return the torques by ripples of size 1 along the motion.

        Returns:
            (2, N) on the motor; (4, N) where the link feels torques too: the last two act between
            link and motor.
        """
        turns = waves(cycles, self._angles[k])
        slopes = np.float32(cycles) * np.array([turns[1], -turns[0]])
        found = [factor * (slopes if of_slope else turns)
                 for _, of_slope, factor in self._factors(effect, k)]  # fmt: skip
        return np.concatenate(found)

    def _factors(self, effect: str, k: int) -> list[tuple[int, bool, np.ndarray]]:
        """Return what makes torques of a ripple's waves, or of their slopes over the angle.

        Returns:
            0 for a torque on the motor, 1 for one between link and motor, in this order; whether
            slopes make it; (N,), what they are multiplied by.
        """
        acts_on, direction = fx.EFFECTS[effect].acts_on, self._direction[k]
        if acts_on == "motor":
            return [(0, False, -direction)]
        if acts_on == "transmission":
            stiffness = np.full_like(direction, self._stiffness)
            return [(0, True, -stiffness * self._twist[k]), (1, False, stiffness)]
        moves = self._moves[k]
        if not fx.EFFECTS[effect].full_parameters[0].unit:  # a share of the torque, not a torque
            return [(0, False, moves * self._torque[k])]
        return [(0, False, moves)]

    def _moved(self, k: int, torques: np.ndarray) -> np.ndarray:
        """Return the changes of the position by `_torques`, averaged, (2, N // every)."""
        count, samples = len(torques), torques.shape[1] // self._every
        blocks = torques[:, : samples * self._every].reshape(count, samples, self._every)
        averaged = blocks @ np.full(self._every, 1.0 / self._every, np.float32)
        response, size = self._responses[k], self._size(k, samples)
        spectra = rfft(averaged, size).reshape(-1, 2, response.shape[1])
        moved = irfft(np.einsum("fnl,fl->nl", spectra, response[: len(spectra)]), size)
        return np.pad(moved[:, :samples], ((0, 0), (self._run_in // self._every, 0)))

    def _response(self, model: Model, index: int, samples: int) -> np.ndarray:
        """Return position per torque on the motor, and per torque between link and motor.

        Returns:
            complex (2, lines), at the lines of a steady period, or of a record that is padded by
            what the loop remembers.
        """
        if self._run_in:
            return self._response_of(model, index, samples)
        whole = self._response_of(model, index, 2 * next_fast_len(samples, real=True))
        memory = max(_memory(irfft(row)[:samples]) for row in whole)
        return self._response_of(
            model, index, 2 * next_fast_len((samples + memory + 1) // 2, real=True)
        )

    def _response_of(self, model: Model, index: int, size: int) -> np.ndarray:
        rate = self._evidence.records.sample_rate_hz
        frequency = np.maximum(rfftfreq(size, self._every / rate), _FREE_HZ)
        plant_response = g0(model.whole_plant, frequency, rate)
        holds = np.nan_to_num(self._evidence.simulator.response(frequency, index))
        response = plant_response / (1.0 + plant_response * holds)
        pair = np.array([np.ones(frequency.size), of_pair(model.plant, frequency)])
        return (response * pair).astype(np.complex64)

    def _size(self, k: int, samples: int) -> int:
        """Return of how many samples the transforms of a record are."""
        return samples if self._run_in else 2 * (self._responses[k].shape[1] - 1)


def _moves(motion: np.ndarray, least: int) -> np.ndarray:
    """Return 1 where an axis moves, float32 (samples,), and 0 where it rests: friction holds it.

    Args:
        motion: (samples,), rad.
        least: samples of a rest; where it only turns round it stands for less.
    """
    speed = np.gradient(motion)
    stands = np.abs(speed) <= _REST * np.sqrt(np.mean(speed**2))
    return (~ndimage.binary_opening(stands, np.ones(least))).astype(np.float32)


def _memory(impulse: np.ndarray) -> int:
    """Return after how many samples an impulse response is forgotten."""
    left = np.cumsum(impulse[::-1].astype(np.float64) ** 2)[::-1]
    return int(np.count_nonzero(left > _FORGOTTEN * left[0]))


def of_pair(p: Mapping[str, float], frequency_hz: np.ndarray) -> np.ndarray:
    """Return the motor torque that acts as 1 N m on the motor against the link does, complex.

    Args:
        p: the plant's parameters by name; without k0 the transmission is rigid, without j the link
            is held.
        frequency_hz: float64 (n,).
    """
    if "k0" not in p or "j" not in p:
        return np.ones(frequency_hz.size)
    s = 2j * np.pi * frequency_hz
    free = p["j"] * s**2 + p["fv"] * s
    return free / (free + p["k0"])
