"""The second plant: a rig that shares nothing with `fjr_sim_node`, for withheld cases.

    J  q''  + fv  q'  + fs  Sgn(q')  + te(q - th) = 0
    Jm th'' + fvm th' + fsm Sgn(th') - te(q - th) = tau

integrated at a fixed fine step by Moreau's midpoint time stepping (Moreau 1988; Acary, Brogliato
2008): forces at half-way positions, viscous friction implicit, Coulomb friction as an impulse that
solves the inclusion, so sticking is exact without any event being located. With infinite stiffness
motor and link are one body. The sampled controller is written anew from the interface's control
law. `second_simulation` plays it and measures its own error.
"""

from __future__ import annotations

import math

import numpy as np

from . import second_laws as law
from .second_compiled import compiled, part

_RING = 4096
_SHAFT_TIME = 5e-6  # s, damping over stiffness of the shaft behind a gap

(
    Q, V, TH, W, TIME, GAP, FLEX, SOLID, MODE_X, MODE_V, CABLE, HEAT,
    LAG_FIRST, LAG_SECOND, SLEWED, D_BEFORE, Q_BEFORE, TH_BEFORE, HEAD, WANDER,
) = range(20)  # fmt: skip
_LINK_SLIP, _MOTOR_SLIP, _POSITIONS = 20, 26, 32
_SIZE = _POSITIONS + _RING


@part
def _encoder(x, noise, jitter, s, h):
    """Return what the encoder reads (rad), late by delay and chance; zero where it starts."""
    y = x[TH] + s[law.JITTER] * jitter * x[W]
    if s[law.DELAY] != 0.0:
        late = s[law.DELAY] / h
        whole, head = int(late), int(x[HEAD])
        y = (1.0 - late + whole) * x[_POSITIONS + (head - whole) % _RING]
        y += (late - whole) * x[_POSITIONS + (head - whole - 1) % _RING]
    if s[law.ECC] != 0.0:
        y += s[law.ECC] * (math.sin(y + s[law.ECC_PHASE]) - math.sin(s[law.ECC_PHASE]))
    if s[law.INTERPOLATION] != 0.0:
        y += s[law.INTERPOLATION] * math.sin(s[law.INTERPOLATION_CYCLES] * y)
    y += noise
    if s[law.RESOLUTION] != 0.0:
        y = s[law.RESOLUTION] * math.floor(y / s[law.RESOLUTION] + 0.5)
    return y


@part
def _motor_torque(x, torque, thm, s, h):
    """Return the torque at the motor (N m): rate limit, current loop, voltage, ripple, heat."""
    if s[law.SLEW] != 0.0:
        most = s[law.SLEW] * h
        before = x[SLEWED]
        x[SLEWED] += min(max(torque - before, -most), most)
        torque = torque if x[SLEWED] == torque else 0.5 * (before + x[SLEWED])
    if s[law.LAG] != 0.0:
        phase, before = 2.0 * h / s[law.LAG], x[LAG_SECOND]
        first, second = x[LAG_FIRST] - torque, before - torque
        x[LAG_FIRST] = torque + math.exp(-phase) * first
        x[LAG_SECOND] = torque + math.exp(-phase) * (second + phase * first)
        torque = 0.5 * (before + x[LAG_SECOND])
    torque = law.within_speed_limit(torque, x[W], s)
    if s[law.RIPPLE] != 0.0:
        angle = s[law.RIPPLE_CYCLES] * thm + s[law.RIPPLE_PHASE]
        torque *= 1.0 + s[law.RIPPLE] * law.two_harmonics(angle)
    if s[law.HEATING] != 0.0:
        power = (torque / s[law.HEATING_NM]) ** 2
        x[HEAT] += h * (power - x[HEAT]) / s[law.HEATING_TIME]
        torque /= 1.0 + s[law.HEATING] * x[HEAT]
    return torque


@part
def _through_gap(x, d, p, s, h):
    """Return the torque of a damped shaft with a gap (N m); advance the angle in the gap."""
    speed, rate = x[V] - x[W], h / _SHAFT_TIME
    x[GAP] = min(max((x[GAP] + h * speed + rate * d) / (1.0 + rate), -s[law.GAP]), s[law.GAP])
    if abs(x[GAP]) < s[law.GAP]:
        return 0.0
    te = law.elastic(d - x[GAP], p, s) + _SHAFT_TIME * p[law.K0] * speed
    return max(te, 0.0) if x[GAP] > 0.0 else min(te, 0.0)


@part
def _transmission(x, qm, thm, p, s, h):
    """Return the transmitted torque (N m) and its lever on the motor."""
    d, lever = qm - thm, 1.0
    if s[law.KIN] != 0.0:
        angle = s[law.KIN_CYCLES] * thm + s[law.KIN_PHASE]
        d += s[law.KIN] * law.two_harmonics(angle)
        lever -= s[law.KIN] * s[law.KIN_CYCLES] * law.two_harmonics_slope(angle)
    te = _through_gap(x, d, p, s, h) if s[law.GAP] != 0.0 else law.elastic(d, p, s)
    if s[law.HYST] != 0.0:
        x[FLEX] = law.bouc_wen(x[FLEX], d - x[D_BEFORE], s)
        te += s[law.HYST] * x[FLEX]
    if s[law.FLEX_DAMPING] != 0.0:
        share = 1.0 - math.exp(-h / 1e-4)
        x[SOLID] += share * (s[law.FLEX_DAMPING] * (x[V] - x[W]) - x[SOLID])
        te += x[SOLID]
    if s[law.BENDING] != 0.0:
        te += s[law.BENDING] * (d / s[law.BENDING_RAD]) ** 2 * (x[V] - x[W])
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
    return force


@part
def _outer_load(x, angle, s, h):
    """Return the torque on the output from outside (N m), and advance the cable."""
    torque = law.outer_load(angle, x[CABLE], x[WANDER], s)
    if s[law.CABLE] != 0.0:
        x[CABLE] += (1.0 - math.exp(-h / s[law.CABLE_TIME])) * (angle - x[CABLE])
    return torque


@part
def _link_velocity(x, qm, te, p, s, h):
    """Return the link's velocity after the step (rad/s)."""
    force = _hung_on_link(x, qm, s, h) - te + _outer_load(x, qm, s, h)
    level = p[law.FS]
    if s[law.STRIBECK_L] != 0.0:
        level += s[law.STRIBECK_L] / (1.0 + (x[V] / s[law.STRIBECK_LV]) ** 2)
    level *= _drift(x, s)
    viscous = _drift(x, s) * p[law.FV] + s[law.DRAG_L] * abs(x[V])
    if s[law.GMS_L] != 0.0:
        elements = x[_LINK_SLIP:_MOTOR_SLIP]
        force -= law.slip_elements(elements, qm - x[Q_BEFORE], level, s[law.GMS_L])
        level = 0.0
    inertia, turned = law.crank(p[law.JL], qm, x[V], s)
    return law.impulse(inertia, x[V], force + turned, viscous, level, level, h)


@part
def _motor_levels(x, thm, te, p, s, h):
    """Return the motor's Coulomb levels (N m) for slip in plus and in minus direction."""
    level = p[law.FSM]
    if s[law.STRIBECK_M] != 0.0:
        level += s[law.STRIBECK_M] / (1.0 + (x[W] / s[law.STRIBECK_MV]) ** 2)
    if s[law.FRICTION_ANGLE] != 0.0:
        angle = s[law.FRICTION_CYCLES] * thm + s[law.FRICTION_PHASE]
        level += s[law.FRICTION_ANGLE] * law.two_harmonics(angle)
    loss = s[law.LOSS_FORWARD] if te * x[W] <= 0.0 else s[law.LOSS_BACKWARD]
    level = _drift(x, s) * (level + (s[law.LOAD] + loss) * abs(te))
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
    viscous += law.drag(abs(x[W]), s)
    if s[law.GMS_M] != 0.0:
        level = plus if thm >= x[TH_BEFORE] else minus
        elements = x[_MOTOR_SLIP:_POSITIONS]
        force -= law.slip_elements(elements, thm - x[TH_BEFORE], level, s[law.GMS_M])
        plus = minus = 0.0
    inertia = p[law.JM]
    if math.isinf(p[law.K0]):
        inertia, turned = law.crank(inertia, thm, x[W], s)
        force += turned
    return law.impulse(inertia, x[W], force, viscous, plus, minus, h)


@part
def _fine_step(x, command, p, s, h):
    """Advance the whole rig by one fine step."""
    qm, thm = x[Q] + 0.5 * h * x[V], x[TH] + 0.5 * h * x[W]
    torque = _motor_torque(x, command, thm, s, h)
    if math.isinf(p[law.K0]):
        v = 0.0
        w = _motor_velocity(x, thm, torque + _outer_load(x, thm, s, h), 0.0, 1.0, p, s, h)
    else:
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
def run(reference, noise, wander, jitter, fs, steps, b_r, b_y, a, limit, p, s, elapsed,
        out_y, out_u, out_q, out_th):  # fmt: skip
    """Close the loop: one controller sample, then `steps` fine steps under a held command.

    u = (b_r(z) r - b_y(z) y) / a(z), clamped to the limit; the polynomials have one length.
    """
    h = 1.0 / (fs * steps)
    x = np.zeros(_SIZE)
    x[TIME] = elapsed
    kept = np.zeros(a.size + 1)
    for k in range(reference.size):
        r, y = reference[k], _encoder(x, noise[k], jitter[k], s, h)
        u = b_r[0] * r - b_y[0] * y + kept[0]
        for i in range(1, a.size):
            kept[i - 1] = b_r[i] * r - b_y[i] * y - a[i] * u + kept[i]
        u = min(max(u, -limit), limit)
        out_y[k], out_u[k], out_q[k], out_th[k] = y, u, x[Q], x[TH]
        command = law.drive(u, s)
        x[WANDER] = wander[k]
        for _ in range(steps):
            _fine_step(x, command, p, s, h)
