"""The table of effects: drive and encoder."""

from __future__ import annotations

import math

import numpy as np

from .entry import (
    CONSTANT_TORQUE,
    QUARTERS,
    Effect,
    EffectParameter,
    Load,
    angle,
    ripple,
    ripple_starts,
    size,
)
from .telltale import Telltale

_SHARES = (0.15, 0.25, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.94, 0.97, 1.0, 1.04, 1.1)
"""Torque limits over the greatest commanded torque: which peaks are clipped changes from one to
the next, and a knee is felt below its limit."""

_LINE_SHARES = (0.3, 0.45, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0, 1.05)
"""Stall torques over the one whose line the record just reaches."""

_WIDEST = 0.3
"""Greatest dead band that is fitted over the greatest commanded torque: behind a wider one hardly
any command would act, and an observer alone would move a model."""

_PERIODS = (0.1, 0.5, 3.0, 10.0, 30.0)

DRIVE: tuple[Effect, ...] = (
    Effect(
        "torque_bias",
        "A constant torque adds to the commanded one.",
        "drive",
        "plant.torques:motor_drive",
        Telltale("DC only", "position"),
        "drive offset",
        (size("torque_nm", "N m", "Constant torque", -1e4),),
        ({"torque_nm": (0.002,)},),
        looks_like=CONSTANT_TORQUE,
        load=Load(lambda q: [np.ones(q.size)], lambda sizes: {"torque_nm": sizes[0]}),
    ),
    Effect(
        "cogging",
        "The motor torque ripples with the motor angle.",
        "drive",
        "plant.torques:motor_drive",
        Telltale("even lines, falling with amplitude", "turn"),
        "Petrovic et al. 2000, IEEE Trans. Control Systems Technology 8(6)",
        ripple("amplitude_nm", "N m", 1e4, "the torque ripple"),
        ripple_starts("amplitude_nm", 0.002),
        looks_like=CONSTANT_TORQUE,
        looks_like_held="ripple of the torque",
        ripple=True,
    ),
    Effect(
        "delay",
        "The torque acts later than commanded.",
        "drive",
        "simulation.rig:hold",
        Telltale("phase, growing with frequency", "frequency"),
        "transport delay of bus and drive",
        (size("time_s", "s", "Transport delay", 0.0, 0.1),),
        ({"time_s": _PERIODS},),
        looks_like="late torque",
        of_command=True,
    ),
    Effect(
        "actuator_lag",
        "The current loop follows the commanded torque with finite bandwidth.",
        "drive",
        "plant.motion:derivative",
        Telltale("phase as delay, gain falls too", "frequency"),
        "first-order current loop",
        (size("time_constant_s", "s", "Time constant", 0.0, 0.1, negligible=0.005),),
        ({"time_constant_s": _PERIODS},),
        looks_like="late torque",
        of_command=True,
    ),
    Effect(
        "torque_saturation",
        "The drive clips the torque.",
        "drive",
        "simulation.rig:limited",
        Telltale("highest amplitude only", "command"),
        "drive limit; the knee as a motor's iron saturates",
        (
            EffectParameter("limit_nm", math.inf, "N m", "Greatest torque; .inf: no limit", 1e-6,
                            role="limit"),
            EffectParameter("knee", 0.0, "", "Share of the limit over which it bends", 0.0, 1.0),
        ),
        ({"limit_nm": _SHARES, "knee": (0.1,)},),
        of_command=True,
    ),
    Effect(
        "torque_speed_limit",
        "The drive gives less torque the faster the motor turns, since its voltage is limited.",
        "drive",
        "plant.torques:available",
        Telltale(
            "highest amplitude only, where torque and velocity have one sign",
            "command",
            "velocity",
        ),
        "torque-speed line of a direct-current motor, Krause et al. 2013, ch. 2",
        (
            EffectParameter("stall_nm", math.inf, "N m", "Greatest torque at rest; .inf: no limit",
                            1e-6, role="limit", falls_to="no_load_rad_s"),
            EffectParameter("no_load_rad_s", 100.0, "rad/s", "Motor speed at which no torque is "
                            "left in its direction", 1e-3, 1e6, fit=(0.5, 100.0)),
        ),
        ({"stall_nm": _LINE_SHARES, "no_load_rad_s": (3.0, 5.0, 8.0, 14.0)},),
        contains=("torque_saturation",),
        of_command=True,
    ),
    Effect(
        "torque_slew_limit",
        "The torque of the drive changes at a limited rate.",
        "drive",
        "simulation.rig:driven",
        Telltale("highest amplitude only, phase there", "command rate"),
        "rate limiter; limited current rise at the supply's voltage",
        (EffectParameter("limit_nm_s", math.inf, "N m/s", "Greatest rate; .inf: no limit", 1e-3,
                         role="limit", fit=(1e-4, 4.0)),),
        ({"limit_nm_s": (0.002, 0.004, 0.008, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55,
                         0.7, 0.9)},),
        of_command=True,
    ),
    Effect(
        "dead_band",
        "The drive ignores small torque commands and shortens all others by as much.",
        "drive",
        "simulation.rig:driven",
        Telltale(
            "low amplitude only, as Coulomb friction but also where the motor does not move",
            "command",
        ),
        "dead zone of an amplifier; Tao, Kokotovic 1994, IEEE TAC 39(1)",
        (size("width_nm", "N m", "Half width of the dead band", fit=(0.0, _WIDEST)),),
        ({"width_nm": (0.003, 0.03)},),
        of_command=True,
        takes_from="coulomb_friction",
    ),
    Effect(
        "torque_constant_ripple",
        "The torque per command ripples with the motor angle.",
        "drive",
        "plant.torques:torque_ripple",
        Telltale("even lines, flat with amplitude", "turn", "command"),
        "Petrovic et al. 2000, IEEE Trans. Control Systems Technology 8(6), current-dependent part",
        ripple("amplitude", "", 1.0, "the torque constant, relative"),
        ripple_starts("amplitude", 0.02),
        ripple=True,
        of_command=True,
    ),
    Effect(
        "torque_gain",
        "The torque constant is not the one assumed.",
        "drive",
        "simulation.rig:hold",
        Telltale("exactly equivalent to scaling all parameters", "command"),
        "torque-constant error",
        (size("relative_error", "", "Torque beyond the commanded one, relative", -0.9, 10.0),),
        ({"relative_error": (0.05,)},),
        same_as="all parameters of the bare plant scaled by one factor",
        scales="everywhere",
        of_command=True,
    ),
)  # fmt: skip

ENCODER: tuple[Effect, ...] = (
    Effect(
        "encoder_quantization",
        "The encoder counts in steps.",
        "encoder",
        "simulation.rig:measure",
        Telltale("noise-like, so that no simulation repeats it sample by sample", "frequency"),
        "uniform quantiser",
        (size("resolution_rad", "rad", "One count", 0.0, 1.0),),
        ({"resolution_rad": (2e-5, 2e-4, 1.5e-3, 8e-3)},),
    ),
    Effect(
        "encoder_eccentricity",
        "The encoder disc is off centre.",
        "encoder",
        "simulation.rig:measure",
        Telltale("nearly invisible", "turn"),
        "once-per-turn measurement error",
        (
            size(
                "amplitude_rad",
                "rad",
                "Amplitude of the angle error",
                0.0,
                0.5,
                absolute=True,
                usual=0.05,
            ),
            angle("phase_rad", "Phase at angle zero"),
        ),
        ({"amplitude_rad": (1e-3, 3e-2), "phase_rad": QUARTERS},),
        scales="about one angle",
    ),
)
