"""The simulated rig, one sample at a time: drive, plant, encoder, in one compiled step.

The node and the batch simulation call the same two functions: `measure`, then `hold`.
"""

from __future__ import annotations

import math

import numpy as np

from fjr_kit.compiled import jit

from .. import effects as fx
from ..plant import advance, advance_with_effects

LINK, MOTOR = 0, 2
"""Where link and motor position (rad) stand in a rig's state."""

_BODIES = 3  # their positions and velocities come first: link, motor, third mass
_EXTRA, _LAGGED = 4, 6
_SLACK, _TIME, _SLEWED, _HEAD, _RING = 10, 11, 12, 13, 14
_RING_SIZE = 16_384  # samples of the longest delay: 100 ms at 20 kHz, each in eight parts
_SLEW_PARTS = 8
_NEWTON_STEPS = 6  # an encoder of half a radian's error is inverted to rounding
_AT_ONCE = 1e-3  # of a sample: a torque that slews no longer is held as a whole


def at_rest(elapsed_s: float = 0.0) -> np.ndarray:
    """Return the state of a rig at rest.

    Args:
        elapsed_s: time since the rig was switched on, for what drifts.
    """
    state = np.zeros(_RING + _RING_SIZE)
    state[_TIME] = elapsed_s
    return state


def move(state: np.ndarray, position: float, velocity: float) -> None:
    """Set all bodies to one position (rad) and velocity (rad/s), a cable pulling nowhere there."""
    state[: 2 * _BODIES] = (position, velocity) * _BODIES
    state[_SLACK] = position


def hold_link(state: np.ndarray, position: float | None) -> None:
    """Let a link rest at a position (rad), where it is if that is None."""
    state[LINK : LINK + 2] = state[LINK] if position is None else position, 0.0


def under_reading(reading: float, rate: float, e: np.ndarray | None) -> tuple[float, float]:
    """Return motor position (rad) and velocity (rad/s) at which the encoder reads something.

    The inverse of `measure` without noise and counts, by Newton's method.

    Args:
        reading: position that the encoder reads, in rad.
        rate: how fast it changes, in rad/s.
        e: from `effects.coefficients`, or None.
    """
    if e is None:
        return reading, rate
    amplitude, phase = (
        e[fx.ENCODER_ECCENTRICITY_AMPLITUDE_RAD],
        e[fx.ENCODER_ECCENTRICITY_PHASE_RAD],
    )
    position, slope = reading, 1.0
    for _ in range(_NEWTON_STEPS):
        slope = 1.0 + amplitude * math.cos(position + phase)
        position -= (position + amplitude * math.sin(position + phase) - reading) / slope
    return position, rate / slope


def complete(state: np.ndarray, torque: float, elapsed_s: float, middle_rad: float) -> None:
    """Set what effects remember in a state that a rig without them has reached.

    Args:
        state: of a rig in motion, changed in place: a third mass moves with the link, a
            cable pulls nowhere in the middle, and lag, slew limit and delay hold the torque.
        torque: last command (N m).
        elapsed_s: time since the rig was switched on, for what drifts.
        middle_rad: mean position of the motion.
    """
    state[_TIME] = elapsed_s
    state[_EXTRA : _EXTRA + 2] = state[LINK : LINK + 2]
    state[_SLACK] = middle_rad
    state[_LAGGED] = state[_SLEWED] = torque
    state[_RING:] = torque


@jit
def measure(x, noise, e):
    """Return what the encoder reads (rad): the motor position with noise and its own errors."""
    y = x[MOTOR]
    if e is None:
        return y + noise
    if e[fx.ENCODER_ECCENTRICITY_AMPLITUDE_RAD] != 0.0:
        y += e[fx.ENCODER_ECCENTRICITY_AMPLITUDE_RAD] * math.sin(
            y + e[fx.ENCODER_ECCENTRICITY_PHASE_RAD]
        )
    y += noise
    if e[fx.ENCODER_QUANTIZATION_RESOLUTION_RAD] != 0.0:
        y = e[fx.ENCODER_QUANTIZATION_RESOLUTION_RAD] * np.rint(
            y / e[fx.ENCODER_QUANTIZATION_RESOLUTION_RAD]
        )
    return y


@jit
def limited(command, limit, knee):
    """Return what the drive gives of a command (N m).

    The torque bends into the limit by a parabola from (1 - knee) to (1 + knee) times the limit; a
    knee of 0 clips.
    """
    if knee == 0.0 or limit == math.inf:
        return min(max(command, -limit), limit)
    beyond = abs(command) - (1.0 - knee) * limit
    if beyond <= 0.0:
        return command
    bent = abs(command) - beyond * beyond / (4.0 * knee * limit)
    return math.copysign(bent if beyond < 2.0 * knee * limit else limit, command)


@jit
def asked(command, prompt, e):
    """Return what a drive without slew limit and gain error gives of a command (N m).

    What is prompt has no part in the dead band; see `hold`.
    """
    band = e[fx.DEAD_BAND_WIDTH_NM]
    torque = command - min(max(command, -band), band) + prompt
    return limited(torque, e[fx.TORQUE_SATURATION_LIMIT_NM], e[fx.TORQUE_SATURATION_KNEE])


@jit
def driven(x, command, prompt, sample_period, e):
    """Return the torque of the drive over a sample (N m): dead band, limit, slew limit, gain.

    A torque that slews is held at its mean over the sample.
    """
    torque = asked(command, prompt, e)
    if e[fx.TORQUE_SLEW_LIMIT_LIMIT_NM_S] != math.inf:
        most = e[fx.TORQUE_SLEW_LIMIT_LIMIT_NM_S] * sample_period
        change = torque - x[_SLEWED]
        if abs(change) > most:
            x[_SLEWED] += math.copysign(most, change)
            torque = x[_SLEWED] - 0.5 * math.copysign(most, change)
        else:
            x[_SLEWED] = torque
            torque -= 0.5 * change * abs(change) / most
    return torque * (1.0 + e[fx.TORQUE_GAIN_RELATIVE_ERROR])


@jit
def hold(x, command, sample_period, p, e, prompt=0.0):
    """Advance the rig in place by one sample period under a held torque command.

    A torque that slews is no held torque: it is followed in parts for as long as it slews.

    Args:
        x: state from `at_rest`.
        command: commanded torque u (N m).
        sample_period: Ts (s).
        p: bare parameters, `plant.coefficients`.
        e: effects, `effects.coefficients`, or None.
        prompt: torque (N m) beside the command that no delay holds up and no dead band swallows,
            such as an observer's: where a command is too small to act, the observer holds on.
    """
    if e is None:
        u = command + prompt
        x[0], x[1], x[2], x[3] = advance(x[0], x[1], x[2], x[3], u, sample_period, p)
        return
    more = 0.0
    if e[fx.DELAY_TIME_S] != 0.0 and prompt != 0.0:
        more = asked(command, prompt, e) - asked(command, 0.0, e)
        more *= 1.0 + e[fx.TORQUE_GAIN_RELATIVE_ERROR]
        prompt = 0.0
    slewing = 0.0
    if e[fx.TORQUE_SLEW_LIMIT_LIMIT_NM_S] != math.inf:
        most = e[fx.TORQUE_SLEW_LIMIT_LIMIT_NM_S] * sample_period
        slewing = min(abs(asked(command, prompt, e) - x[_SLEWED]) / most, 1.0)
        if e[fx.DELAY_TIME_S] != 0.0:  # what is remembered must lie evenly in time
            slewing = 1.0
    if not slewing > _AT_ONCE:
        _hold_with_effects(x, command, prompt, more, sample_period, p, e)
        return
    parts = math.ceil(_SLEW_PARTS * slewing)
    for _ in range(parts):
        _hold_with_effects(x, command, prompt, more, slewing * sample_period / parts, p, e)
    if slewing < 1.0:
        _hold_with_effects(x, command, prompt, more, (1.0 - slewing) * sample_period, p, e)


@jit
def _hold_with_effects(x, command, prompt, more, sample_period, p, e):
    torque = driven(x, command, prompt, sample_period, e)
    friction = max(1.0 + e[fx.NONSTATIONARY_FRICTION_PER_S] * x[_TIME], 0.0)
    x[_TIME] += sample_period
    if e[fx.DELAY_TIME_S] == 0.0:
        advance_with_effects(x, torque, sample_period, p, e, friction)
        return
    head = (int(x[_HEAD]) + 1) % _RING_SIZE
    x[_HEAD] = head
    x[_RING + head] = torque
    samples = e[fx.DELAY_TIME_S] / sample_period
    if samples + 1.0 >= _RING_SIZE:
        x[MOTOR] = math.nan  # older than what is remembered: ends as a motion that diverges
        return
    whole = int(samples + 1e-9)  # a delay of whole samples is that, whatever its last bit
    before = x[_RING + (head - whole - 1) % _RING_SIZE]
    now = x[_RING + (head - whole) % _RING_SIZE]
    late = max(samples - whole, 0.0) * sample_period
    if late > 0.0:
        advance_with_effects(x, before + more, late, p, e, friction)
    advance_with_effects(x, now + more, sample_period - late, p, e, friction)
