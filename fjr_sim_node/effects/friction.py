"""The table of effects: friction of motor and link."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .entry import (
    CONSTANT_TORQUE,
    AtVelocity,
    Effect,
    EffectParameter,
    Start,
    ripple,
    ripple_starts,
    size,
)
from .telltale import Telltale

# A level above Coulomb friction bends the bare parameters so far that small ones promise nothing;
# a great level that falls within a small velocity would only make the plant stiff.
_STRIBECK_STARTS = (
    {"torque_nm": (0.002, 0.015), "velocity_rad_s": (0.0025, 0.0125, 0.06, 0.3)},
    {"torque_nm": (0.15,), "velocity_rad_s": (0.06, 0.3)},
)
_SHORT = (3e-4, 3e-3, 3e-2)
_ARMSTRONG = "Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)"


def _stribeck(side: str) -> tuple[EffectParameter, ...]:
    return (
        size("torque_nm", "N m", f"Breakaway above Coulomb friction, {side} side"),
        EffectParameter(
            "velocity_rad_s", 0.1, "rad/s", "Stribeck velocity, where it has fallen to 1/e",
            1e-4, 100.0, fit=(1e-3, 2.0),
        ),
    )  # fmt: skip


def _constant(v: np.ndarray) -> np.ndarray:
    return -np.sign(v)


def _linear(v: np.ndarray) -> np.ndarray:
    return -v


def _squared(v: np.ndarray) -> np.ndarray:
    return -v * np.abs(v)


def _lacking(
    quantity: str, name: str, unit: str, motor: str, link: str, at_velocity: AtVelocity
) -> tuple[EffectParameter, ...]:
    return (
        size(f"motor_{name}", unit, f"{quantity} of the motor beyond {motor}", adds_to=motor,
             at_velocity=at_velocity),
        size(f"link_{name}", unit, f"{quantity} of the link beyond {link}", adds_to=link,
             of_link=True),
    )  # fmt: skip


def _on_either_side(name: str, values: tuple[float, ...]) -> tuple[Start, ...]:
    motor, link = f"motor_{name}", f"link_{name}"
    both = tuple({motor: (value,), link: (value,)} for value in values)
    return ({motor: values, link: (0.0,)}, {motor: (0.0,), link: values}, *both)


def _lugre_from_part(effects: Mapping[str, float], plant: Mapping[str, float]) -> dict[str, float]:
    """Return the bristles of presliding friction, or level and velocity of Stribeck friction."""
    found = {}
    if bent := effects.get("presliding_friction.motor_rad"):
        coulomb = plant["fsm"] + effects.get("coulomb_friction.motor_nm", 0.0)
        found["bristle_nm_rad"] = coulomb / bent
    if level := effects.get("stribeck_friction_motor.torque_nm"):
        velocity = effects["stribeck_friction_motor.velocity_rad_s"]
        found |= {"stribeck_nm": level, "velocity_rad_s": velocity}
    return {f"lugre_friction.{name}": value for name, value in found.items()}


FRICTION: tuple[Effect, ...] = (
    Effect(
        "coulomb_friction",
        "There is Coulomb friction where the datasheet has none.",
        "motor",
        "plant.flexible_joint:with_added",
        Telltale("low amplitude, damped at all frequencies", "velocity"),
        "paper eq. 2, fs sgn(q')",
        _lacking("Coulomb friction", "nm", "N m", "fsm", "fs", _constant),
        _on_either_side("nm", (0.02, 0.2)),
        looks_like_held="friction of the motor",
        same_as="a larger fsm or fs",
        of_bare_plant=True,
    ),
    Effect(
        "viscous_friction",
        "There is viscous friction where the datasheet has none.",
        "motor",
        "plant.flexible_joint:with_added",
        Telltale("resonance damped at all amplitudes, low frequencies lower", "velocity"),
        "paper eq. 2, fv q'",
        _lacking("Viscous friction", "nm_s_rad", "N m s/rad", "fvm", "fv", _linear),
        _on_either_side("nm_s_rad", (0.02,)),
        looks_like_held="drag of the motor",
        same_as="a larger fvm or fv",
        of_bare_plant=True,
    ),
    Effect(
        "stribeck_friction_motor",
        "Motor friction is higher at breakaway and falls with velocity.",
        "motor",
        "plant.torques:motor_level",
        Telltale("low amplitude only", "velocity"),
        _ARMSTRONG,
        _stribeck("motor"),
        _STRIBECK_STARTS,
        modifies="coulomb_friction",
    ),
    Effect(
        "stribeck_friction_link",
        "Link friction is higher at breakaway and falls with velocity.",
        "link",
        "plant.torques:link_level",
        Telltale("low amplitude only", "velocity"),
        _ARMSTRONG,
        _stribeck("link"),
        _STRIBECK_STARTS,
        modifies="coulomb_friction",
    ),
    Effect(
        "asymmetric_friction",
        "Motor friction depends on the direction of motion.",
        "motor",
        "plant.torques:motor_level",
        Telltale("DC; even lines if viscous", "velocity"),
        "Swevers et al. 1997, IEEE Trans. Robotics and Automation 13(5)",
        (
            size("coulomb_nm", "N m", "Half the difference of Coulomb friction between the "
                 "directions", -1e4),
            size("viscous_nm_s_rad", "N m s/rad", "Half the difference of viscous friction between "
                 "the directions", -1e4),
        ),
        (
            {"coulomb_nm": (0.002,), "viscous_nm_s_rad": (0.0,)},
            {"coulomb_nm": (0.0,), "viscous_nm_s_rad": (0.01,)},
        ),
        looks_like=CONSTANT_TORQUE,
        same_as="a torque bias while the motor slides, where only Coulomb friction differs",
        modifies="coulomb_friction",
    ),
    Effect(
        "presliding_friction",
        "Friction builds up over a small displacement before sliding, as a stiff spring does.",
        "motor",
        "plant.presliding:bristle_torque",
        Telltale("low amplitude, phase lead at the resonance", "travel", "velocity"),
        "Dahl 1968, TOR-158(3107-18); de Wit et al. 1995, IEEE TAC 40(3), without bristle damping",
        (
            size("motor_rad", "rad", "Displacement over which motor friction builds up", 0.0, 1.0,
                 negligible=3e-5),
            size("link_rad", "rad", "Displacement over which link friction builds up", 0.0, 1.0,
                 negligible=3e-5, of_link=True),
        ),
        # A side that starts below what is negligible never leaves it.
        ({"motor_rad": _SHORT, "link_rad": _SHORT},),
        looks_like="friction that builds up",
        looks_like_held="friction of the motor",
        modifies="coulomb_friction",
    ),
    Effect(
        "lugre_friction",
        "Motor friction is that of bristles which bend, slip and hold less while they move.",
        "motor",
        "plant.motion:motor_friction",
        Telltale(
            "low amplitude, a spring before sliding and a lower level beyond", "travel", "velocity",
        ),
        "Canudas de Wit, Olsson, Astrom, Lischinsky 1995, IEEE TAC 40(3); its damping, passive",
        (
            size("stribeck_nm", "N m", "Stribeck level: breakaway above Coulomb friction"),
            EffectParameter("bristle_nm_rad", math.inf, "N m/rad", "Stiffness of the bristles, "
                            "sigma0; .inf: none", 1e-3, role="limit", fit=(0.01, 1e3)),
            EffectParameter("velocity_rad_s", 0.1, "rad/s", "Stribeck velocity, where it has "
                            "fallen to 1/e", 1e-4, 100.0, fit=(1e-3, 2.0)),
            EffectParameter("damping_nm_s_rad", 0.0, "N m s/rad", "Damping of the bristles, "
                            "sigma1, while they bend further", 0.0, 1e4),
        ),
        (
            {"stribeck_nm": (0.01,), "bristle_nm_rad": (1.0, 10.0),
             "velocity_rad_s": (0.0025, 0.0125, 0.06, 0.3), "damping_nm_s_rad": (0.005,)},
        ),
        looks_like="friction that builds up",
        contains=("stribeck_friction_motor", "presliding_friction"),
        from_part=_lugre_from_part,
        on_request=True,
        modifies="coulomb_friction",
    ),
    Effect(
        "load_friction",
        "Motor Coulomb friction grows with the torque in the gear.",
        "transmission",
        "plant.torques:motor_level",
        Telltale("resonance lower at all amplitudes", "load", "velocity"),
        "Hamon, Gautier, Garrec 2010, IROS, load-dependent gear friction",
        (size("coefficient", "", "Friction per torque in the gear", 0.0, 0.95, fit=(0.0, 0.9)),),
        ({"coefficient": (0.01, 0.05)},),
        looks_like="loss that grows with the load",
        of_load=True,
        axis="both",
    ),
    Effect(
        "directional_loss",
        "The gear loses torque, forward another share than backward.",
        "transmission",
        "plant.torques:motor_level",
        Telltale("as load friction, other where the load drives the motor", "load", "velocity"),
        "Wang, Kim 2015, IFToMM; gear efficiency forward and backward",
        (
            size("forward", "", "Friction per torque in the gear while the motor drives", 0.0,
                 0.95, fit=(0.0, 0.9)),
            size("backward", "", "Friction per torque in the gear while the load drives", 0.0,
                 0.95, fit=(0.0, 0.9)),
        ),
        (
            {"forward": (0.01, 0.05), "backward": (0.0,)},
            {"forward": (0.0,), "backward": (0.01, 0.05)},
        ),
        looks_like="loss that grows with the load",
        same_as="load_friction with all parameters behind the gear scaled, while the motor slides",
        of_load=True,
        axis="both",
    ),
    Effect(
        "position_friction",
        "Motor Coulomb friction varies with the motor angle.",
        "motor",
        "plant.torques:motor_level",
        Telltale("even lines, small gain", "turn", "velocity"),
        "Armstrong 1988, position-dependent friction of geared joints",
        ripple("amplitude_nm", "N m", 1e4, "the variation of Coulomb friction"),
        ripple_starts("amplitude_nm", 0.002),
        ripple=True,
        modifies="coulomb_friction",
    ),
    Effect(
        "quadratic_friction",
        "Drag grows with the square of velocity.",
        "motor",
        "plant.torques:motor_viscous",
        Telltale("grows with amplitude", "velocity"),
        "fluid and lubricant drag, sgn(v) v^2",
        (
            size("motor_nm_s2_rad2", "N m s2/rad2", "Drag on the motor",
                 at_velocity=_squared),
            size("link_nm_s2_rad2", "N m s2/rad2", "Drag on the link", of_link=True),
        ),
        (
            {"motor_nm_s2_rad2": (0.02,), "link_nm_s2_rad2": (0.0,)},
            {"motor_nm_s2_rad2": (0.0,), "link_nm_s2_rad2": (0.02,)},
        ),
        modifies="viscous_friction",
    ),
    Effect(
        "nonstationary",
        "Coulomb and viscous friction drift with time, as they do while a gear warms up.",
        "time",
        "simulation.rig:hold",
        Telltale("change between periods and realizations", "time", "velocity"),
        "relative drift, linear in time over the whole experiment",
        (size("friction_per_s", "1/s", "Relative change of Coulomb and viscous friction per "
              "second", -0.1, 0.1),),
    ),
)  # fmt: skip
