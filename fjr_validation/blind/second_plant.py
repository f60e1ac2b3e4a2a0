"""The second plant: a rig that shares nothing with `fjr_sim_node`, for withheld cases.

    J  q''  + fv  q'  + fs  Sgn(q')  + te(q - th) = 0
    Jm th'' + fvm th' + fsm Sgn(th') - te(q - th) = tau

integrated at a fixed fine step by Moreau's midpoint time stepping (Moreau 1988; Acary, Brogliato
2008): forces at half-way positions, viscous friction implicit, Coulomb friction as an impulse that
solves the inclusion, so sticking is exact without any event being located. The sampled controller
is written anew from the interface's control law. `discretisation_error` measures its own error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import second_laws as law
from .second_compiled import compiled, part

STEPS_PER_SECOND = 100_000
"""Default rate of the fine steps; `discretisation_error` tells what it costs."""

_RING = 4096
_SHAFT_TIME = 2e-5  # s, damping over stiffness of the shaft behind a gap

(
    Q, V, TH, W, TIME, GAP, FLEX, SOLID, MEMORY, MODE_X, MODE_V, ABSORBER_X, ABSORBER_V,
    LAG_FIRST, LAG_SECOND, SLEWED, D_BEFORE, Q_BEFORE, TH_BEFORE, HEAD,
) = range(20)  # fmt: skip
_LINK_SLIP, _MOTOR_SLIP, _POSITIONS = 20, 26, 32
_SIZE = _POSITIONS + _RING


@dataclass(frozen=True)
class Loop:
    """The sampled controller u = P e + D N (e - x), x' = a x + (1 - a) e, a = exp(-N Ts)."""

    sample_rate_hz: float = 1000.0
    p: float = 200.0
    d: float = 60.0
    n: float = 24.0


@part
def _encoder(x, noise, s, h):
    """Return what the encoder reads (rad), late by the delay."""
    y = x[TH]
    if s[law.DELAY] != 0.0:
        late = s[law.DELAY] / h
        whole, head = int(late), int(x[HEAD])
        y = (1.0 - late + whole) * x[_POSITIONS + (head - whole) % _RING]
        y += (late - whole) * x[_POSITIONS + (head - whole - 1) % _RING]
    if s[law.ECC] != 0.0:
        y += s[law.ECC] * math.sin(y + s[law.ECC_PHASE])
    y += noise
    if s[law.RESOLUTION] != 0.0:
        y = s[law.RESOLUTION] * math.floor(y / s[law.RESOLUTION] + 0.5)
    return y


@part
def _motor_torque(x, torque, thm, s, h):
    """Return the torque at the motor (N m): rate limit, current loop, commutation ripple."""
    if s[law.SLEW] != 0.0:
        most = s[law.SLEW] * h
        before = x[SLEWED]
        x[SLEWED] += min(max(torque - before, -most), most)
        torque = 0.5 * (before + x[SLEWED])
    if s[law.LAG] != 0.0:
        phase, before = 2.0 * h / s[law.LAG], x[LAG_SECOND]
        first, second = x[LAG_FIRST] - torque, before - torque
        x[LAG_FIRST] = torque + math.exp(-phase) * first
        x[LAG_SECOND] = torque + math.exp(-phase) * (second + phase * first)
        torque = 0.5 * (before + x[LAG_SECOND])
    if s[law.RIPPLE] != 0.0:
        torque *= 1.0 + s[law.RIPPLE] * math.sin(s[law.RIPPLE_CYCLES] * thm + 0.4)
    return torque


@part
def _through_gap(x, d, thm, p, s, h):
    """Return the torque of a damped shaft with a gap (N m); advance the angle in the gap."""
    speed, rate = x[V] - x[W], h / _SHAFT_TIME
    x[GAP] = min(max((x[GAP] + h * speed + rate * d) / (1.0 + rate), -s[law.GAP]), s[law.GAP])
    if abs(x[GAP]) < s[law.GAP]:
        return 0.0
    te = law.elastic(d - x[GAP], thm, p, s) + _SHAFT_TIME * p[law.K0] * speed
    return max(te, 0.0) if x[GAP] > 0.0 else min(te, 0.0)


@part
def _transmission(x, qm, thm, p, s, h):
    """Return the transmitted torque (N m) and its lever on the motor."""
    d, lever = qm - thm, 1.0
    if s[law.KIN] != 0.0:
        angle = s[law.KIN_CYCLES] * thm + s[law.KIN_PHASE]
        d += s[law.KIN] * law.two_harmonics(angle)
        lever -= s[law.KIN] * s[law.KIN_CYCLES] * law.two_harmonics_slope(angle)
    te = _through_gap(x, d, thm, p, s, h) if s[law.GAP] != 0.0 else law.elastic(d, thm, p, s)
    if s[law.HYST] != 0.0:
        x[FLEX] = law.bouc_wen(x[FLEX], d - x[D_BEFORE], s)
        te += s[law.HYST] * x[FLEX]
    if s[law.FLEX_DAMPING] != 0.0:
        share = 1.0 - math.exp(-h / 1e-4)
        x[SOLID] += share * (s[law.FLEX_DAMPING] * (x[V] - x[W]) - x[SOLID])
        te += x[SOLID]
    x[D_BEFORE] = d
    return te, lever


@part
def _drift(x, s):
    """Return the factor on all friction at this time."""
    if s[law.DRIFT] == 0.0:
        return 1.0
    return 1.0 + s[law.DRIFT] * (1.0 - math.exp(-x[TIME] / s[law.DRIFT_TIME]))


@part
def _hung_on_link(x, qm, s, h):
    """Return the torque on the link of masses that hang on it (N m), and advance those."""
    force = 0.0
    if s[law.MODE] != 0.0:
        rate = 2.0 * math.pi * s[law.MODE_HZ]
        pull = rate * rate * (x[MODE_X] + 0.5 * h * x[MODE_V] - qm)
        pull += 2.0 * s[law.MODE_DAMPING] * rate * (x[MODE_V] - x[V])
        force += s[law.MODE] * pull
        x[MODE_X] += h * (x[MODE_V] - 0.5 * h * pull)
        x[MODE_V] -= h * pull
    if s[law.ABSORBER] != 0.0:
        stretch = x[ABSORBER_X] + 0.5 * h * x[ABSORBER_V] - qm
        pull = s[law.ABSORBER_K] * stretch * stretch * stretch / s[law.ABSORBER]
        pull += 40.0 * (x[ABSORBER_V] - x[V])
        force += s[law.ABSORBER] * pull
        x[ABSORBER_X] += h * (x[ABSORBER_V] - 0.5 * h * pull)
        x[ABSORBER_V] -= h * pull
    return force


@part
def _link_velocity(x, qm, te, p, s, h):
    """Return the link's velocity after the step (rad/s)."""
    inertia, force = p[law.JL], _hung_on_link(x, qm, s, h) - te
    if s[law.GRAVITY] != 0.0:
        across = math.cos(s[law.GRAVITY_ANGLE]) * math.sin(qm)
        force -= s[law.GRAVITY] * (across + math.sin(s[law.GRAVITY_ANGLE]) * math.cos(qm))
    if s[law.HUM] != 0.0:
        force += s[law.HUM] * math.sin(2.0 * math.pi * s[law.HUM_HZ] * (x[TIME] + 0.5 * h))
    if s[law.INERTIA] != 0.0:
        angle = s[law.INERTIA_CYCLES] * qm + 0.5
        inertia *= 1.0 + s[law.INERTIA] * math.sin(angle)
        slope = p[law.JL] * s[law.INERTIA] * s[law.INERTIA_CYCLES] * math.cos(angle)
        force -= 0.5 * slope * x[V] * x[V]
    level = p[law.FS]
    if s[law.STRIBECK_L] != 0.0:
        level += s[law.STRIBECK_L] / (1.0 + (x[V] / s[law.STRIBECK_LV]) ** 2)
    level *= _drift(x, s)
    viscous = _drift(x, s) * p[law.FV] + s[law.DRAG_L] * abs(x[V])
    if s[law.GMS_L] != 0.0:
        elements = x[_LINK_SLIP:_MOTOR_SLIP]
        force -= law.slip_elements(elements, qm - x[Q_BEFORE], level, s[law.GMS_L])
        level = 0.0
    return law.impulse(inertia, x[V], force, viscous, level, level, h)


@part
def _motor_levels(x, thm, te, p, s, h):
    """Return the motor's Coulomb levels (N m) for slip in plus and in minus direction."""
    level = p[law.FSM]
    if s[law.STRIBECK_M] != 0.0:
        level += s[law.STRIBECK_M] / (1.0 + (x[W] / s[law.STRIBECK_MV]) ** 2)
    if s[law.FRICTION_ANGLE] != 0.0:
        angle = s[law.FRICTION_CYCLES] * thm + s[law.FRICTION_PHASE]
        level += s[law.FRICTION_ANGLE] * law.two_harmonics(angle)
    if s[law.MEMORY] != 0.0:
        x[MEMORY] += h * (abs(x[W]) - x[MEMORY]) / s[law.MEMORY_TIME]
        level *= 1.0 + s[law.MEMORY] * (0.1 / (0.1 + x[MEMORY]) - 0.5)
    level = _drift(x, s) * (level + s[law.LOAD] * abs(te))
    return max(level + s[law.ASYM_C], 0.0), max(level - s[law.ASYM_C], 0.0)


@part
def _motor_velocity(x, thm, torque, te, lever, p, s, h):
    """Return the motor's velocity after the step (rad/s)."""
    force = torque + te * lever + s[law.BIAS]
    if s[law.COG] != 0.0:
        force += s[law.COG] * law.two_harmonics(s[law.COG_CYCLES] * thm + s[law.COG_PHASE])
    plus, minus = _motor_levels(x, thm, te, p, s, h)
    side = 1.0 if x[W] > 0.0 else -1.0
    viscous = _drift(x, s) * p[law.FVM] + s[law.DRAG_M] * abs(x[W]) + s[law.ASYM_V] * side
    if s[law.GMS_M] != 0.0:
        level = plus if thm >= x[TH_BEFORE] else minus
        elements = x[_MOTOR_SLIP:_POSITIONS]
        force -= law.slip_elements(elements, thm - x[TH_BEFORE], level, s[law.GMS_M])
        plus = minus = 0.0
    return law.impulse(p[law.JM], x[W], force, viscous, plus, minus, h)


@part
def _fine_step(x, command, p, s, h):
    """Advance the whole rig by one fine step."""
    qm, thm = x[Q] + 0.5 * h * x[V], x[TH] + 0.5 * h * x[W]
    torque = _motor_torque(x, command, thm, s, h)
    te, lever = _transmission(x, qm, thm, p, s, h)
    v = _link_velocity(x, qm, te, p, s, h)
    w = _motor_velocity(x, thm, torque, te, lever, p, s, h)
    x[Q_BEFORE], x[TH_BEFORE] = qm, thm
    x[Q], x[V] = qm + 0.5 * h * v, v
    x[TH], x[W] = thm + 0.5 * h * w, w
    x[TIME] += h
    if s[law.DELAY] != 0.0:
        x[HEAD] = (x[HEAD] + 1.0) % _RING
        x[_POSITIONS + int(x[HEAD])] = x[TH]


@compiled
def _run(reference, noise, fs, steps, gains, p, s, elapsed, out_y, out_u, out_q, out_th):
    """Close the loop: one controller sample, then `steps` fine steps under a held command."""
    h = 1.0 / (fs * steps)
    x = np.zeros(_SIZE)
    x[TIME] = elapsed
    filtered, decay = 0.0, math.exp(-gains[2] / fs)
    for k in range(reference.size):
        y = _encoder(x, noise[k], s, h)
        error = reference[k] - y
        u = gains[0] * error + gains[1] * gains[2] * (error - filtered)
        filtered = decay * filtered + (1.0 - decay) * error
        out_y[k], out_u[k], out_q[k], out_th[k] = y, u, x[Q], x[TH]
        command = law.drive(u, s)
        for _ in range(steps):
            _fine_step(x, command, p, s, h)


@dataclass(frozen=True)
class Record:
    """Sampled signals, float64 (samples,) each: y, q and th in rad, u in N m."""

    y: np.ndarray
    u: np.ndarray
    q: np.ndarray
    th: np.ndarray


def simulate(
    reference: np.ndarray,
    plant: Mapping[str, float],
    settings: Mapping[str, float] | None = None,
    *,
    noise: np.ndarray | None = None,
    loop: Loop | None = None,
    elapsed_s: float = 0.0,
    steps_per_second: float = STEPS_PER_SECOND,
) -> Record:
    """Simulate the closed loop from rest.

    Args:
        reference: r, float64 (samples,) in rad.
        plant: the bare plant's eight parameters by name.
        settings: effects by the names of `second_laws.SETTINGS`; missing ones are off.
        noise: encoder noise (samples,) in rad.
        loop: controller and sample rate; the interface's default if None.
        elapsed_s: time since the rig was switched on.
        steps_per_second: rate of the fine steps.

    Raises:
        KeyError: a setting that the second plant does not know.
        FloatingPointError: the motion diverges.
    """
    loop = loop or Loop()
    s = _ordered(settings or {})
    p = tuple(float(plant[name]) for name in law.PLANT_NAMES)
    r = np.ascontiguousarray(reference, float)
    noise = np.zeros(r.size) if noise is None else np.ascontiguousarray(noise, float)
    steps = max(1, round(steps_per_second / loop.sample_rate_hz))
    gains = (loop.p, loop.d, loop.n)
    out = Record(*(np.empty(r.size) for _ in range(4)))
    columns = (out.y, out.u, out.q, out.th)
    _run(r, noise, loop.sample_rate_hz, steps, gains, p, s, elapsed_s, *columns)
    if not (np.isfinite(out.y).all() and np.abs(out.y).max() < 50.0):
        raise FloatingPointError("the second plant's motion diverges")
    return out


def _ordered(settings: Mapping[str, float]) -> tuple[float, ...]:
    """Return the settings as the compiled plant takes them."""
    unknown = set(settings) - set(law.SETTINGS)
    if unknown:
        raise KeyError(f"the second plant has no setting {sorted(unknown)[0]}")
    return tuple(float(settings.get(name, 0.0)) for name in law.SETTINGS)


def discretisation_error(
    reference: np.ndarray,
    plant: Mapping[str, float],
    settings: Mapping[str, float] | None = None,
    steps_per_second: float = STEPS_PER_SECOND,
) -> float:
    """Return rms(y - y_fine) / rms(y_fine), y_fine at eight times the rate, without noise."""
    coarse = simulate(reference, plant, settings, steps_per_second=steps_per_second).y
    fine = simulate(reference, plant, settings, steps_per_second=8 * steps_per_second).y
    return float(np.linalg.norm(coarse - fine) / np.linalg.norm(fine))
