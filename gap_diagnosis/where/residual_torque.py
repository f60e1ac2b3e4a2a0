"""The residual torque: the torque on the motor that is missing to explain the measured motion.

The motion y is measured, so the motor's equation needs no simulation of the motor (paper eq. 2):

    tau_res = Jm th'' + friction(th') - (te + u)

th comes from y, differentiated in the frequency domain over the periodic steady state and
limited in band; te from the link, which the measured th drives through the compiled plant, or from
a second encoder. Where the motor hardly moves, its friction is whatever balances it, up to
breakaway, as in the plant; such samples are left out of curves. An effect on the motor side is then
a function of velocity or position at once; one behind the spring rings at the antiresonance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fjr_kit.compiled import jit
from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import advance, advance_with_effects
from fjr_sim_node.plant.places import FS, FSM, FV, K0, K1, J
from fjr_sim_node.plant.presliding import bristle_damping, has_motor_bristles
from fjr_sim_node.plant.spring import transmitted_torque
from fjr_sim_node.plant.torques import gear_load, motor_drive, motor_level, motor_viscous
from fjr_sim_node.simulation.rig import at_rest, driven

from ..model.rig_model import Model

OVERSAMPLING = 4
"""Points per sample at which the motor drives the link, along straight lines between them."""
NOISE_SHARES = (0.03, 0.002)
"""Torque noise that the band may let in: of the motor's Coulomb friction, or of the rms of u."""
REST = 0.03
"""The motor hardly moves below this share of its rms velocity."""
REVERSAL_PASSES = 6
_HELD = 1e9  # inertia (kg m2) of a motor that the link cannot move


@dataclass(frozen=True)
class ResidualTorque:
    """Residual torque over the steady period of each realization; all arrays are (n, N).

    Attributes:
        time_s: (N,), from the beginning of the period.
        level: int (n,).
        torque: tau_res (N m): the torque on the motor that the model lacks.
        velocity, position: of the motor, rad/s and rad.
        link_position: of the link, rad.
        moving: bool, whether the motor's friction is known, so that tau_res is.
        band_hz: (n,), limit of the band of all of these.
    """

    time_s: np.ndarray
    level: np.ndarray
    torque: np.ndarray
    velocity: np.ndarray
    position: np.ndarray
    link_position: np.ndarray
    moving: np.ndarray
    band_hz: np.ndarray

    @property
    def deflection(self) -> np.ndarray:
        """Deflection q - th of the transmission, rad."""
        return self.link_position - self.position

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the samples."""
        return 1.0 / (self.time_s[1] - self.time_s[0])


def residual_torque(
    recorded: RecordedExperiment,
    model: Model,
    noise: NoiseLevels | None = None,
    band_hz: float | None = None,
) -> ResidualTorque:
    """Return the residual torque of the mean period of every realization.

    Args:
        recorded: the experiment.
        model: bare or with effects; what its effects explain is no longer residual.
        noise: from `noise_levels`, to choose the band by.
        band_hz: limit of the band; None for the widest in which encoder noise keeps within
            `NOISE_SHARES`, or twice the highest line in use if noise is not known.
    """
    rows = [_one(recorded, r, model, noise, band_hz) for r in recorded.realizations]
    torque, vth, th, q, moving, bands = (np.array(column) for column in zip(*rows, strict=True))
    description = recorded.experiment
    return ResidualTorque(
        time_s=np.arange(description.samples_per_period) / description.sample_rate_hz,
        level=np.array([r.level for r in recorded.realizations]),
        torque=torque,
        velocity=vth,
        position=th,
        link_position=q,
        moving=moving,
        band_hz=bands,
    )


def _one(
    recorded: RecordedExperiment,
    r: RecordedRealization,
    model: Model,
    noise: NoiseLevels | None,
    band_hz: float | None,
):
    rate, samples = r.experiment.sample_rate_hz, r.experiment.samples_per_period
    omega = 2.0 * np.pi * rate / samples * np.arange(samples // 2 + 1)
    position, torque = (np.fft.rfft(r.kept(s).mean(0)) for s in (r.position, r.torque))
    spread = _noise_lines(noise, r.level, omega.size)
    p, e = model.plant_coefficients, model.effect_coefficients
    if band_hz is None:
        band_hz = _band(omega, spread, p, np.std(r.kept(r.torque)), recorded)
    window = taper(omega, 2.0 * np.pi * band_hz)
    applied = _applied(r.kept(r.torque).mean(0), torque, omega, rate, e)

    def fine(lines: np.ndarray) -> np.ndarray:
        return np.fft.irfft(lines * window, samples * OVERSAMPLING) * OVERSAMPLING

    th, vth, ath = (fine(position * (1j * omega) ** order) for order in range(3))
    q, vq, motor_torque, flex_state, slack = _drive(th, rate * OVERSAMPLING, p, e)
    if r.link is not None:
        link = np.fft.rfft(r.kept(r.link).mean(0))
        q, vq = fine(link), fine(link * 1j * omega)
    rest = max(REST * float(np.std(vth)), 3.0 * _rms(spread * omega * window))
    states = np.array([th, vth, ath, q, vq, motor_torque, flex_state, slack, fine(applied)])
    missing = np.fft.rfft(_balance(states, rest, window, rate, p, e))[: omega.size]
    vth = states[1]
    every = slice(None, None, OVERSAMPLING)
    return (
        np.fft.irfft(missing / OVERSAMPLING * window, samples),
        vth[every],
        th[every],
        q[every],
        np.abs(vth[every]) > rest,
        band_hz,
    )


def _noise_lines(noise: NoiseLevels | None, level: int, lines: int) -> np.ndarray:
    """Return the noise of all lines to Nyquist; beyond those estimated the last one holds."""
    if noise is None:
        return np.zeros(lines)
    known = noise.position[noise.row(level)]
    return np.concatenate([known, np.full(max(lines - known.size, 0), known[-10:].mean())])[:lines]


def _stiffness(omega: np.ndarray, p: tuple[float, ...]) -> np.ndarray:
    """Return the magnitude of tau_res per error of y, the link at rest, N m/rad."""
    jm, fvm, k0 = p[0], p[5], p[K0]
    return np.abs(k0 - jm * omega**2 + 1j * fvm * omega)


def _rms(std: np.ndarray) -> float:
    """Return the rms in time of lines of complex standard deviation `std`."""
    return float(np.sqrt(0.5 * np.sum(std[1:] ** 2) + std[0] ** 2))


def _band(
    omega: np.ndarray,
    spread: np.ndarray,
    p: tuple[float, ...],
    torque_rms: float,
    recorded: RecordedExperiment,
) -> float:
    """Return the widest band (Hz) that the noise allows, at least to the highest line in use."""
    top = recorded.lines - 1
    if not spread.any():
        return 2.0 * omega[min(top, (omega.size - 1) * 2 // 5)] / (2.0 * np.pi)
    power = np.cumsum(0.5 * (spread * _stiffness(omega, p)) ** 2)
    allowance = max(NOISE_SHARES[0] * p[FSM], NOISE_SHARES[1] * torque_rms)
    allowed = int(np.searchsorted(power, allowance**2))
    line = min(max(allowed, top * 5 // 4), omega.size * 4 // 5)
    return float(omega[line] / (2.0 * np.pi))


def taper(omega: np.ndarray, limit: float) -> np.ndarray:
    """Return 1 up to 0.7 of the limit and a half cosine down to 0 at it."""
    phase = np.clip((omega / limit - 0.7) / 0.3, 0.0, 1.0)
    return 0.5 * (1.0 + np.cos(np.pi * phase))


def _applied(
    torque: np.ndarray, lines: np.ndarray, omega: np.ndarray, rate: float, e
) -> np.ndarray:
    """Return the DFT of the torque as the motor feels it: held over each sample, through the drive.

    The zero-order hold delays by half a sample: (1 - exp(-s Ts))/(s Ts).
    """
    s_ts = 1j * omega[1:] / rate
    hold = np.concatenate([[1.0], -np.expm1(-s_ts) / s_ts])
    if e is None:
        return lines * hold
    drive = at_rest()
    for _ in range(2):  # a torque that slews is periodic from the second period on
        given = [driven(drive, u, 0.0, 1.0 / rate, e) for u in torque.tolist()]
    return (
        np.fft.rfft(given)
        * hold
        * np.exp(-1j * omega * e[fx.DELAY_TIME_S])
        / (1.0 + 1j * omega * e[fx.ACTUATOR_LAG_TIME_CONSTANT_S])
    )


def _drive(th: np.ndarray, rate: float, p: tuple[float, ...], e):
    """Return link position and velocity, what has built up in the motor's friction and the gear.

    These are presliding torque of the motor and state of the hysteresis; the fifth is the angle at
    which a cable pulls nowhere. All are (N,), the torque in N m. The compiled plant moves the link
    while a motor too heavy to be moved follows th.
    """
    held = (_HELD, p[J], p[FS], p[FSM], p[FV], 0.0, p[K0], p[K1])
    out = np.empty((5, th.size))
    state = np.zeros(11)
    state[0], state[10] = th[0], th.mean()  # two periods are too short for a slow cable to settle
    settle = 2
    for _ in range(settle):
        _follow(th, 1.0 / rate, held, e, state, out)
    return out


@jit
def _follow(th, step, p, e, x, out):
    for k in range(th.size):
        ahead = th[(k + 1) % th.size]
        x[2], x[3] = th[k], (ahead - th[k]) / step
        out[0, k], out[1, k], out[2, k], out[3, k] = x[0], x[1], x[8], x[9]
        out[4, k] = x[10]
        if e is None:
            x[0], x[1], x[2], x[3] = advance(x[0], x[1], x[2], x[3], 0.0, step, p)
        else:
            advance_with_effects(x, 0.0, step, p, e)


def _balance(
    states: np.ndarray, rest: float, window: np.ndarray, rate: float, p: tuple[float, ...], e
) -> np.ndarray:
    """Return Jm th'' + friction - te - u (N,); complete the states' velocity beyond the band.

    At a reversal friction jumps, and so does th''. What of that lies beyond the band is known, as
    it can only come from friction; with it the reversals are found where they are.
    """
    samples = states.shape[1]
    omega = 2.0 * np.pi * np.fft.rfftfreq(samples, 1.0 / (rate * OVERSAMPLING))
    beyond = np.ones(omega.size)
    beyond[: window.size] -= window
    band_limited = states[1:3].copy()
    missing, friction = np.empty(samples), np.empty(samples)
    for _ in range(REVERSAL_PASSES):
        _missing_torque(states, rest, p, e, missing, friction)
        lines = -np.fft.rfft(friction) * beyond / p[0]
        states[2] = band_limited[1] + np.fft.irfft(lines, samples)
        lines[1:] /= 1j * omega[1:]
        states[1] = band_limited[0] + np.fft.irfft(lines, samples)
    _missing_torque(states, rest, p, e, missing, friction)
    return missing


@jit
def _missing_torque(states, rest, p, e, missing, friction):
    """Fill in Jm th'' + friction - te - u, and the friction, for states (9, N) as in `_one`."""
    for k in range(missing.size):
        th, vth, ath, q, vq, built, flex, slack, u = states[:, k]
        te = transmitted_torque(q, vq, th, vth, flex, p, e)
        balance = p[0] * ath + motor_viscous(vth, p, e) - motor_drive(th, vth, te, u, slack, p, e)
        if abs(vth) > rest:
            direction = 1.0 if vth > 0.0 else -1.0
            load = gear_load(th, vth, te, u, slack, direction, p, e)
            torque = direction * motor_level(abs(vth), direction, th, load, p, e)
            if e is not None and has_motor_bristles(e):
                torque = built + bristle_damping(built, abs(torque), direction, vth, e)
        else:
            direction = 1.0 if balance < 0.0 else -1.0
            load = gear_load(th, 0.0, te, u, slack, direction, p, e)
            level = motor_level(0.0, direction, th, load, p, e)
            torque = min(max(-balance, -level), level)
        missing[k], friction[k] = balance + torque, torque
