"""A joint with the friction of BAM's ladder, compiled; it shares no code with the simulated rig.

Duclusaud, Passault, Padois, Ly 2024, "Extended friction models for the physics simulation of servo
actuators" (arXiv 2410.08650). Friction is the torque that would stop the motor within a step, but
at most a budget:

    s      = exp(-|v / vs|^alpha)                                  1 at rest, 0 in fast motion
    budget = F0 + fv |v| + s Fs + |Ke te - Km u| + s |Kes te - Kms u| + s Q
    Q      = Qe te^2 where |te| < |u|, Qm u^2 where |te| > |u|, if te and u oppose each other

with the motor torque u and the external torque te, here that of the transmission. What a model of
the ladder lacks is zero; before M5 Ke = Km and Kes = Kms. Beyond BAM, which knows one body, the
link has the inertia, friction and transmission of the datasheet; and positions advance by half a
step before and after the speed does, which is of second order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from controller_node import transfer_function
from fjr_kit.compiled import inlined, jit
from gap_diagnosis.model.drive import Drive

FRICTION = (
    "base", "viscous", "stribeck", "stribeck_speed", "alpha", "load_motor", "load_external",
    "load_motor_stribeck", "load_external_stribeck", "quadratic_motor", "quadratic_external",
)  # fmt: skip
"""Parameters of the budget, in SI units."""
_STEP_S = 2.5e-4  # longest


@inlined
def _budget(v, u, te, f):
    """Return the greatest friction torque (N m)."""
    base, viscous, stribeck, speed, alpha, km, ke, kms, kes, qm, qe = f
    s = 0.0
    if stribeck + kms + kes + qm + qe > 0.0:
        s = math.exp(-(abs(v / speed) ** alpha))
    total = base + viscous * abs(v) + s * stribeck
    total += abs(ke * te - km * u) + s * abs(kes * te - kms * u)
    if te * u < 0.0:
        total += s * (qe * te * te if abs(te) < abs(u) else qm * u * u)
    return total


@inlined
def _stopped(v, drive, budget, inertia, h):
    """Return the speed after a step under a driving torque and friction within its budget."""
    stop = inertia / h * v + drive
    friction = min(abs(stop), budget)
    return v + h / inertia * (drive - (friction if stop > 0.0 else -friction))


@jit
def _run(reference, added, period, substeps, body, f, law, x, start, speed, position):
    b, forward, a, limit = law
    jm, j, fs, fv, k0, k1 = body
    th, q, vm, vq, h = start, start, speed, speed, period / substeps
    for k in range(reference.size):
        position[k] = th
        u = added[k] + transfer_function.step(x, reference[k], th, b, forward, a, limit)
        for _ in range(substeps):
            th, q = th + 0.5 * h * vm, q + 0.5 * h * vq
            d = q - th
            te = (k0 + k1 * d * d) * d
            vm = _stopped(vm, u + te, _budget(vm, u, te, f), jm, h)
            vq = _stopped(vq, -te, fs + fv * abs(vq), j, h) if j > 0.0 else vm
            th, q = th + 0.5 * h * vm, q + 0.5 * h * vq


def play(
    drive: Drive, sample_rate_hz: float, plant: Mapping[str, float], friction: Mapping[str, float]
) -> np.ndarray:
    """Return the position of a run, float64 (samples,) in rad; NaN where the motion diverges.

    Args:
        drive: what plays it.
        sample_rate_hz: rate of the samples.
        plant: bare parameters, of which the motor's friction is not read; without k0 one body.
        friction: by the names of FRICTION; missing ones are zero.
    """
    names = ("jm", "j", "fs", "fv", "k0", "k1")
    body = tuple(float(plant.get(name, 0.0)) for name in names)
    speed = {"stribeck_speed": 1.0, "alpha": 2.0}
    f = tuple(float(friction.get(name, speed.get(name, 0.0))) for name in FRICTION)
    reference = np.ascontiguousarray(drive.reference, float)
    added = np.zeros(reference.size) if drive.command is None else drive.command
    x = np.zeros(drive.law.states + 1)
    if drive.entry is not None:
        x[:-1] = drive.entry
    position = np.empty(reference.size)
    period = 1.0 / sample_rate_hz
    _run(
        reference, np.ascontiguousarray(added, float), period, math.ceil(period / _STEP_S), body, f,
        drive.law.coefficients, x, *drive.start, position,
    )  # fmt: skip
    return position
