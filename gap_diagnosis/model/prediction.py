"""Local closed-loop prediction, where the rig's loop cannot be repeated.

Without the controller, or without the reference, the recorded torque drives the model, and a known
observer holds the motion to the recorded position:

    y_sim = G (D u + L (y - y_sim))

with the delay of the drive, D, and all that follows it, G. The true model then has y_sim = y
without noise, whatever the controller was; a wrong one has the prediction error
(1 + G L)^-1 (y - G D u). The observer keeps open-loop drift and sticking from growing, at a price:
below its crossover it hides part of what a wrong model does. A delay that is tried does not make it
swing, since it is not late by it, and a dead band does not swallow what it adds; what else a drive
does to the torque, it does to the observer's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.fft import next_fast_len
from scipy.signal import cont2discrete

from controller_node.transfer_function import TransferFunction
from fjr_records.periodic import RecordedExperiment
from fjr_sim_node.simulation.closed_loop import Trajectory
from fjr_sim_node.theory import linear

CROSSOVER_SHARE = 0.1
"""Crossover of the observer relative to the highest excited frequency, never below the lowest."""
LEAD = 10.0
"""Ratio of pole to zero of the observer: 55 degrees of lead where the loop gain is one."""
_HIGHEST = 0.05  # of the sample rate
_STEP, _MOST_STEPS = 2.0**0.25, 16
_MOST_SENSITIVE = 2.5
_LEAST_DECAY = 0.003  # of a motion of the loop, per radian of the crossover
_FORGOTTEN = 20.0  # time constants after which it is forgotten how a model began
_NEARLY_ZERO = 1e-2  # of the frequency of a period
_NEAR = 1.5  # lines within this factor of the crossover give the plant's gain there


def crossover_hz(recorded: RecordedExperiment) -> float:
    """Return the crossover frequency of the observer."""
    excited = np.array(recorded.experiment.excited_harmonics)
    lines = max(excited.min(), CROSSOVER_SHARE * excited.max())
    return float(lines * recorded.experiment.base_frequency_hz)


def observer(recorded: RecordedExperiment) -> TransferFunction:
    """Return a lead that crosses over with the measured response of torque to position.

    Its gain comes from the record itself, |U/Y| near the crossover, median over lines and
    realizations; so it depends on no parameter that is yet to be fitted.
    """
    description = recorded.experiment
    crossover = crossover_hz(recorded)
    lines = np.array(description.excited_harmonics)
    frequency = lines * description.base_frequency_hz
    apart = np.abs(np.log(frequency / crossover))
    near = lines[apart <= max(np.log(_NEAR), apart.min())]
    ratios = [
        np.abs(r.spectrum(r.torque, recorded.lines).mean(0)[near])
        / np.abs(r.spectrum(r.position, recorded.lines).mean(0)[near])
        for r in recorded.realizations
    ]
    return lead(float(np.median(ratios)), crossover, description.sample_rate_hz)


def lead(gain: float, crossover_hz: float, sample_rate_hz: float) -> TransferFunction:
    """Return a discretised lead (bilinear, exact at the crossover) with a gain there.

    Args:
        gain: magnitude at the crossover, N m/rad.
        crossover_hz: frequency of the greatest lead.
        sample_rate_hz: rate of the samples.
    """
    centre = np.tan(np.pi * crossover_hz / sample_rate_hz)  # w/w0 = (z-1)/(z+1)/(j centre)
    zero, pole = centre / np.sqrt(LEAD), centre * np.sqrt(LEAD)
    high = gain * np.sqrt(LEAD)
    return TransferFunction.of([high * (1.0 + zero), high * (zero - 1.0)], [1.0 + pole, pole - 1.0])


def model_observer(
    nominal: Mapping[str, float], wanted_hz: float, sample_rate_hz: float
) -> tuple[float, TransferFunction]:
    """Return the crossover of an observer that holds a model well, and the observer.

    It is the one nearest to what is wanted at which the loop of the lead and the linear nominal
    model is damped and its sensitivity peaks below 2.5; so a model that is fitted to a motion does
    not diverge for want of friction, and stays held while its parameters change. If there is none,
    it is the one whose loop grows least.

    Args:
        nominal: datasheet values by the names of PLANT.
        wanted_hz: crossover, if the model allows it.
        sample_rate_hz: rate of the samples.
    """
    highest = _HIGHEST * sample_rate_hz
    wanted = min(wanted_hz, highest)
    growths = {}
    for step in sorted(range(-_MOST_STEPS, _MOST_STEPS + 1), key=abs):
        crossover = wanted * _STEP**step
        if crossover > highest:
            continue
        gain = 1.0 / abs(complex(linear.g0(nominal, np.array(crossover), sample_rate_hz)))
        law = lead(gain, crossover, sample_rate_hz)
        growth = _growth(law, nominal, sample_rate_hz)
        decays = 1.0 - _LEAST_DECAY * 2.0 * np.pi * crossover / sample_rate_hz
        if growth < decays and _robust(law, nominal, sample_rate_hz):
            return crossover, law
        growths[growth] = crossover, law
    return growths[min(growths)]


def settles(nominal: Mapping[str, float], seconds: float) -> bool:
    """Tell whether the linear nominal model comes to rest where it began, and soon.

    As a motor does that a held link springs back: then the recorded torque alone makes its motion,
    and an observer would only lend it stiffness. Others stay wherever a torque has brought them.

    Args:
        nominal: datasheet values by the names of PLANT.
        seconds: within which it is forgotten how the model began.
    """
    slowest = float(np.linalg.eigvals(linear.motor_side(nominal)[0]).real.max())
    return slowest * seconds < -_FORGOTTEN


def _growth(law: TransferFunction, nominal: Mapping[str, float], sample_rate_hz: float) -> float:
    """Return the largest modulus of a pole of a first-order law's loop with the linear model."""
    a, b = linear.motor_side(nominal)
    position = np.zeros((1, len(a)))
    position[0, -2] = 1.0
    ad, bd, *_ = cont2discrete((a, b[:, None], position, np.zeros((1, 1))), 1.0 / sample_rate_hz)
    (b0, b1), (_, a1) = law.position, law.denominator
    # the law's state x: u = x + b0 e, then x = b1 e - a1 u, with e = -y
    closed = np.block([
        [ad - b0 * bd @ position, bd],
        [(a1 * b0 - b1) * position, np.full((1, 1), -a1)],
    ])  # fmt: skip
    return float(np.abs(np.linalg.eigvals(closed)).max())


def _robust(law: TransferFunction, nominal: Mapping[str, float], sample_rate_hz: float) -> bool:
    """Tell whether the sensitivity of the loop peaks low enough."""
    frequency = np.geomspace(1e-4, 0.4999, 2000) * sample_rate_hz
    plant = linear.g0(nominal, frequency, sample_rate_hz)
    loop = law.response(frequency, sample_rate_hz)[1] * plant
    return bool(np.abs(1.0 + loop).min() >= 1.0 / _MOST_SENSITIVE)


def prediction_error(
    position: np.ndarray,
    torque: np.ndarray,
    nominal: Mapping[str, float],
    observer: TransferFunction,
    sample_rate_hz: float,
) -> np.ndarray:
    """Return the error that the linear nominal model has in repeated signals, which it predicts.

    Args:
        position: (..., N), rad.
        torque: (..., N), N m.
        nominal: datasheet values by the names of PLANT.
        observer: that holds the model.
        sample_rate_hz: rate of the samples.

    Returns:
        (1 + G L)^-1 (y - G u), (..., N) in rad.
    """
    samples = position.shape[-1]
    plant, loop = _at_lines(samples, nominal, observer, sample_rate_hz)
    error = (np.fft.rfft(position) - plant * np.fft.rfft(torque)) / (1.0 + loop)
    return np.fft.irfft(error, samples)


@dataclass(frozen=True)
class Added:
    """What an observer of a linear model adds for torques that the model lacks.

    Attributes:
        nominal: values of the model by the names of PLANT.
        observer: that holds the model.
        sample_rate_hz: rate of the samples.
    """

    nominal: Mapping[str, float]
    observer: TransferFunction
    sample_rate_hz: float
    _shares: dict[int, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    def __call__(self, torque: np.ndarray) -> np.ndarray:
        """Return G L (1 + G L)^-1 torque: itself up to the crossover, late and less above.

        Args:
            torque: (samples,) from when model and observer begin, N m.

        Returns:
            float64 (samples,), N m.
        """
        samples = next_fast_len(2 * torque.size, real=True)
        if samples not in self._shares:
            _, loop = _at_lines(samples, self.nominal, self.observer, self.sample_rate_hz)
            self._shares[samples] = loop / (1.0 + loop)
        added = np.fft.irfft(np.fft.rfft(torque, samples) * self._shares[samples], samples)
        return added[: torque.size]


def _at_lines(
    samples: int, nominal: Mapping[str, float], observer: TransferFunction, sample_rate_hz: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return G and G L at the lines of so many samples, (lines,)."""
    frequency = np.fft.rfftfreq(samples, 1.0 / sample_rate_hz)
    frequency[0] = _NEARLY_ZERO * frequency[1]  # a free axis has no gain at zero
    plant = linear.g0(nominal, frequency, sample_rate_hz)
    return plant, plant * observer.response(frequency, sample_rate_hz)[1]


def loses(recorded: RecordedExperiment) -> str:
    """Return what a diagnosis by prediction cannot say, for a reader."""
    missing = "reference" if recorded.experiment.controller is not None else "controller"
    return (
        f"The {missing} is not known, so the loop is not repeated: the recorded torque drives the "
        f"model and an observer of {crossover_hz(recorded):.3g} Hz holds it to the recorded "
        "position. Lost are the check of controller and logging, the gap in torque (it shows what "
        f"the observer adds) and sensitivity below {crossover_hz(recorded):.3g} Hz; a torque that "
        "is logged wrong, late or scaled looks like a fault of the plant."
    )


def errors(recorded: RecordedExperiment, runs: Sequence[Trajectory]) -> RecordedExperiment:
    """Return the record with its signals replaced by prediction errors.

    Args:
        recorded: the experiment.
        runs: simulation of all recorded samples of each realization.
    """
    changed = []
    for r, run in zip(recorded.realizations, runs, strict=True):
        shape = r.position.shape
        less = {"position": r.position - run.position.reshape(shape)}
        less["torque"] = r.torque - run.torque.reshape(shape)
        if r.link is not None:
            less["link"] = r.link - run.link.reshape(shape)
        changed.append(replace(r, **less))
    return replace(recorded, realizations=tuple(changed))
