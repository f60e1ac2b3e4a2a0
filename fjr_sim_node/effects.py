"""The catalogue of effects that the bare plant lacks, each described once.

Node parameters, parameter files, fits, documents and reports all read these descriptions. An effect
is off while its size, its first parameter, has the default; then the plant is the bare one, bit for
bit. Parameter names in files and in ROS are `effect.parameter`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fjr_interface.parameters import Parameter


@dataclass(frozen=True)
class Effect:
    """One effect of the catalogue.

    Attributes:
        identifier: its fixed name.
        summary: what it is, one sentence.
        telltale: how it shows in the data.
        source: where the parametrisation comes from.
        parameters: its parameters; the defaults switch it off.
        sizes: the parameters that are zero (infinite for a limit) when it is off.
    """

    identifier: str
    summary: str
    telltale: str
    source: str
    parameters: tuple[Parameter, ...]
    sizes: int = 1

    @property
    def names(self) -> tuple[str, ...]:
        """Full names, `effect.parameter`."""
        return tuple(f"{self.identifier}.{parameter.name}" for parameter in self.parameters)


def _angle_periodic(unit: str, name: str, most: float, what: str) -> tuple[Parameter, ...]:
    return (
        Parameter(name, 0.0, unit, f"Amplitude of {what}", 0.0, most),
        Parameter("cycles_per_turn", 1.0, "", "Periods in one turn of the motor angle", 0.01, 1e4),
        Parameter("phase_rad", 0.0, "rad", "Phase at angle zero", -7.0, 7.0),
        Parameter("second_ratio", 0.0, "", "Second harmonic over the first", 0.0, 10.0),
        Parameter("second_phase_rad", 0.0, "rad", "Phase of the second harmonic where the first "
                  "is zero and rises", -7.0, 7.0),
    )  # fmt: skip


def _stribeck(side: str) -> tuple[Parameter, ...]:
    return (
        Parameter(
            "torque_nm", 0.0, "N m", f"Breakaway above Coulomb friction, {side} side", 0.0, 1e4
        ),
        Parameter(
            "velocity_rad_s", 0.1, "rad/s", "Stribeck velocity, where it has fallen to 1/e",
            1e-4, 100.0,
        ),
    )  # fmt: skip


CATALOGUE: tuple[Effect, ...] = (
    Effect(
        "stribeck_friction_motor",
        "Motor friction is higher at breakaway and falls with velocity.",
        "low amplitude only",
        "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
        _stribeck("motor"),
    ),
    Effect(
        "stribeck_friction_link",
        "Link friction is higher at breakaway and falls with velocity.",
        "low amplitude only",
        "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
        _stribeck("link"),
    ),
    Effect(
        "asymmetric_friction",
        "Motor friction depends on the direction of motion.",
        "DC; even lines if viscous",
        "Swevers et al. 1997, IEEE Trans. Robotics and Automation 13(5)",
        (
            Parameter("coulomb_nm", 0.0, "N m", "Half the difference of Coulomb friction between "
                      "the directions", -1e4, 1e4),
            Parameter("viscous_nm_s_rad", 0.0, "N m s/rad", "Half the difference of viscous "
                      "friction between the directions", -1e4, 1e4),
        ),
        sizes=2,
    ),
    Effect(
        "torque_bias",
        "A constant torque adds to the commanded one.",
        "DC only",
        "drive offset",
        (Parameter("torque_nm", 0.0, "N m", "Constant torque", -1e4, 1e4),),
    ),
    Effect(
        "presliding_friction",
        "Friction builds up over a small displacement before sliding, as a stiff spring does.",
        "low amplitude, phase lead at the resonance",
        "Dahl 1968, TOR-158(3107-18); de Wit et al. 1995, IEEE TAC 40(3), without bristle damping",
        (
            Parameter("motor_rad", 0.0, "rad", "Displacement over which motor friction builds up",
                      0.0, 1.0),
            Parameter("link_rad", 0.0, "rad", "Displacement over which link friction builds up",
                      0.0, 1.0),
        ),
        sizes=2,
    ),
    Effect(
        "load_friction",
        "Motor Coulomb friction grows with the transmitted torque.",
        "resonance lower at all amplitudes",
        "Hamon, Gautier, Garrec 2010, IROS, load-dependent gear friction",
        (Parameter("coefficient", 0.0, "", "Friction per transmitted torque", 0.0, 0.95),),
    ),
    Effect(
        "position_friction",
        "Motor Coulomb friction varies with the motor angle.",
        "even lines, small gain",
        "Armstrong 1988, position-dependent friction of geared joints",
        _angle_periodic("N m", "amplitude_nm", 1e4, "the variation of Coulomb friction"),
    ),
    Effect(
        "quadratic_friction",
        "Drag grows with the square of velocity.",
        "grows with amplitude",
        "fluid and lubricant drag, sgn(v) v^2",
        (
            Parameter("motor_nm_s2_rad2", 0.0, "N m s2/rad2", "Drag on the motor", 0.0, 1e4),
            Parameter("link_nm_s2_rad2", 0.0, "N m s2/rad2", "Drag on the link", 0.0, 1e4),
        ),
        sizes=2,
    ),
    Effect(
        "backlash",
        "The transmission has a dead zone.",
        "low amplitude, more gain at 2-13 Hz",
        "Nordin, Gutman 2002, Automatica 38(10), dead-zone model",
        (Parameter("half_gap_rad", 0.0, "rad", "Half the dead zone of the deflection", 0.0, 1.0),),
    ),
    Effect(
        "piecewise_stiffness",
        "The transmission is soft around zero deflection and stiffer beyond (strain-wave gear).",
        "near backlash, which it contains",
        "Spong 1987; manufacturers' three-slope stiffness of strain-wave gears",
        (
            Parameter("zone_rad", 0.0, "rad", "Half width of the soft zone", 0.0, 1.0),
            Parameter("soft_ratio", 0.5, "", "Stiffness in the soft zone over k0", 0.0, 1.0),
        ),
    ),
    Effect(
        "hysteresis",
        "The transmission torque depends on the history of the deflection.",
        "antiresonance damped",
        "Dahl 1968 on the deflection; the rate-independent Bouc-Wen model with n = 1",
        (
            Parameter("torque_nm", 0.0, "N m", "Half height of the hysteresis loop", 0.0, 1e4),
            Parameter("displacement_rad", 1e-3, "rad", "Deflection over which it builds up",
                      1e-6, 1.0),
        ),
    ),
    Effect(
        "transmission_damping",
        "The transmission has a viscous term.",
        "resonance damped at mid and high amplitude",
        "Spong 1987, ASME J. Dyn. Syst. 109(4), with joint damping",
        (Parameter("nm_s_rad", 0.0, "N m s/rad", "Torque per deflection velocity", 0.0, 1e4),),
    ),
    Effect(
        "kinematic_error",
        "The gear transmits an angle that is off periodically with the motor angle.",
        "even lines, flat with amplitude",
        "Tuttle, Seering 1996, IEEE Trans. Robotics and Automation 12(3)",
        _angle_periodic("rad", "amplitude_rad", 1.0, "the angle error"),
    ),
    Effect(
        "extra_mode",
        "A third mass hangs on the link behind a spring of its own.",
        "narrow band",
        "three-mass model of a flexible joint with a flexible link",
        (
            Parameter("inertia_kg_m2", 0.0, "kg m2", "Inertia of the third mass", 0.0, 1e3),
            Parameter("frequency_hz", 30.0, "Hz", "Its natural frequency with the link held",
                      0.1, 2000.0),
            Parameter("damping_ratio", 0.02, "", "Its damping ratio with the link held", 0.0, 2.0),
        ),
    ),
    Effect(
        "gravity",
        "The link is out of balance.",
        "DC and even lines at low amplitude",
        "pendulum torque m g l sin(q + angle)",
        (
            Parameter("torque_nm", 0.0, "N m", "Greatest gravity torque m g l", 0.0, 1e4),
            Parameter("angle_rad", 0.0, "rad", "Angle of the link from hanging down at q = 0",
                      -7.0, 7.0),
        ),
    ),
    Effect(
        "cogging",
        "The motor torque ripples with the motor angle.",
        "even lines, falling with amplitude",
        "Petrovic et al. 2000, IEEE Trans. Control Systems Technology 8(6)",
        _angle_periodic("N m", "amplitude_nm", 1e4, "the torque ripple"),
    ),
    Effect(
        "delay",
        "The torque acts later than commanded.",
        "phase, growing with frequency",
        "transport delay of bus and drive",
        (Parameter("time_s", 0.0, "s", "Transport delay", 0.0, 0.01),),
    ),
    Effect(
        "actuator_lag",
        "The current loop follows the commanded torque with finite bandwidth.",
        "phase as delay, gain falls too",
        "first-order current loop",
        (Parameter("time_constant_s", 0.0, "s", "Time constant", 0.0, 0.1),),
    ),
    Effect(
        "torque_saturation",
        "The drive clips the torque.",
        "highest amplitude only",
        "drive limit; the knee as a motor's iron saturates",
        (
            Parameter("limit_nm", math.inf, "N m", "Greatest torque; .inf: no limit", 1e-6),
            Parameter("knee", 0.0, "", "Share of the limit over which it bends", 0.0, 1.0),
        ),
    ),
    Effect(
        "torque_gain",
        "The torque constant is not the one assumed.",
        "exactly equivalent to scaling all parameters",
        "torque-constant error",
        (Parameter("relative_error", 0.0, "", "Torque beyond the commanded one, relative",
                   -0.9, 10.0),),
    ),
    Effect(
        "encoder_quantization",
        "The encoder counts in steps.",
        "noise-like",
        "uniform quantiser",
        (Parameter("resolution_rad", 0.0, "rad", "One count", 0.0, 1.0),),
    ),
    Effect(
        "encoder_eccentricity",
        "The encoder disc is off centre.",
        "nearly invisible",
        "once-per-turn measurement error",
        (
            Parameter("amplitude_rad", 0.0, "rad", "Amplitude of the angle error", 0.0, 0.5),
            Parameter("phase_rad", 0.0, "rad", "Phase at angle zero", -7.0, 7.0),
        ),
    ),
    Effect(
        "nonstationary",
        "Coulomb and viscous friction drift with time, as they do while a gear warms up.",
        "change between periods and realizations",
        "relative drift, linear in time over the whole experiment",
        (Parameter("friction_per_s", 0.0, "1/s", "Relative change of Coulomb and viscous friction "
                   "per second",
                   -0.1, 0.1),),
    ),
)  # fmt: skip
"""All effects in the order of the project's catalogue."""

EFFECTS: dict[str, Effect] = {effect.identifier: effect for effect in CATALOGUE}

PARAMETERS: tuple[Parameter, ...] = tuple(
    Parameter(
        name, p.default, p.unit, f"{effect.summary} {p.description}", p.low, p.high,
        p.choices, p.symbol, effect.source,
    )
    for effect in CATALOGUE
    for name, p in zip(effect.names, effect.parameters, strict=True)
)  # fmt: skip
"""The parameters of all effects under their full names."""

NAMES: tuple[str, ...] = tuple(parameter.name for parameter in PARAMETERS)
DEFAULTS: tuple[float, ...] = tuple(float(parameter.default) for parameter in PARAMETERS)

(
    STRIBECK_MOTOR, STRIBECK_MOTOR_VELOCITY,
    STRIBECK_LINK, STRIBECK_LINK_VELOCITY,
    ASYMMETRIC_COULOMB, ASYMMETRIC_VISCOUS,
    BIAS,
    PRESLIDING_MOTOR, PRESLIDING_LINK,
    LOAD,
    POSITION_FRICTION, POSITION_FRICTION_CYCLES, POSITION_FRICTION_PHASE,
    POSITION_FRICTION_SECOND, POSITION_FRICTION_SECOND_PHASE,
    DRAG_MOTOR, DRAG_LINK,
    HALF_GAP,
    SOFT_ZONE, SOFT_RATIO,
    HYSTERESIS, HYSTERESIS_DISPLACEMENT,
    FLEX_DAMPING,
    KINEMATIC, KINEMATIC_CYCLES, KINEMATIC_PHASE, KINEMATIC_SECOND, KINEMATIC_SECOND_PHASE,
    EXTRA_INERTIA, EXTRA_FREQUENCY, EXTRA_DAMPING,
    GRAVITY, GRAVITY_ANGLE,
    COGGING, COGGING_CYCLES, COGGING_PHASE, COGGING_SECOND, COGGING_SECOND_PHASE,
    DELAY,
    LAG,
    SATURATION, SATURATION_KNEE,
    GAIN_ERROR,
    RESOLUTION,
    ECCENTRICITY, ECCENTRICITY_PHASE,
    DRIFT,
) = range(len(PARAMETERS))  # fmt: skip


def coefficients(values: Mapping[str, Any]) -> tuple[float, ...] | None:
    """Return the effects' parameters in the order of `NAMES`; None if all are off.

    Args:
        values: checked parameter values by full name; missing ones have their defaults.
    """
    given = tuple(float(values.get(p.name, p.default)) for p in PARAMETERS)
    on = any(given[index] != DEFAULTS[index] for index in _SIZES)
    return given if on else None


_SIZES = tuple(NAMES.index(name) for effect in CATALOGUE for name in effect.names[: effect.sizes])
