"""Causes of a gap: effects of the catalogue as the second plant has them, drawn for a rig.

Each draw fixes the shape of an effect at random and leaves one number free, its size, which is
relative to what the rig does (its rms torque, speed, angle, deflection). Where a setting of the
second plant means the same as a parameter of the catalogue, that is said, so that intervals can be
checked; where the two plants have other laws, nothing is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from .draw import Draw, Drawer, Scales, linear, phase, sign
from .rigs import log_uniform


def _cycles(rng: np.random.Generator, at: Scales) -> float:
    """Return whole cycles per turn of which the motion sees from one to some."""
    return float(np.clip(round(log_uniform(rng, 1.0 / at.angle, 20.0 / at.angle)), 2, 400))


def _stribeck(side: str, letters: str) -> Drawer:
    def draw(rng: np.random.Generator, at: Scales) -> Draw:
        shape = {f"stribeck_{letters}_rad_s": at.speed * log_uniform(rng, 0.1, 0.5)}
        scaled = {f"stribeck_{letters}_nm": at.torque}
        return linear(f"stribeck_friction_{side}", scaled, 0.05, 1.0, shape)

    return draw


def _asymmetric(rng: np.random.Generator, at: Scales) -> Draw:
    if rng.random() < 0.5:
        scaled = {"asymmetric_viscous_nm_s_rad": sign(rng) * at.torque / at.speed}
        return linear("asymmetric_friction", scaled, 0.02, 0.3,
                      same_as={"asymmetric_viscous_nm_s_rad": "viscous_nm_s_rad"})  # fmt: skip
    return linear("asymmetric_friction", {"asymmetric_coulomb_nm": sign(rng) * at.coulomb}, 0.2,
                  0.9, same_as={"asymmetric_coulomb_nm": "coulomb_nm"})  # fmt: skip


def _torque_bias(rng: np.random.Generator, at: Scales) -> Draw:
    return linear("torque_bias", {"bias_nm": sign(rng) * at.torque}, 0.05, 0.5,
                  same_as={"bias_nm": "torque_nm"})  # fmt: skip


def _presliding(rng: np.random.Generator, at: Scales) -> Draw:
    scaled = {"presliding_motor_rad": at.angle}
    if math.isfinite(at.resonance_hz) and rng.random() < 0.5:
        scaled["presliding_link_rad"] = at.angle * log_uniform(rng, 0.5, 2.0)
    return linear("presliding_friction", scaled, 0.01, 0.3)


def _lugre(rng: np.random.Generator, at: Scales) -> Draw:
    scaled = {
        "presliding_motor_rad": 0.2 * at.angle * log_uniform(rng, 0.1, 1.0),
        "stribeck_motor_nm": at.coulomb * log_uniform(rng, 0.5, 1.5),
    }
    shape = {"stribeck_motor_rad_s": at.speed * log_uniform(rng, 0.1, 0.5)}
    return linear("lugre_friction", scaled, 0.1, 1.0, shape)


def _load(_: np.random.Generator, __: Scales) -> Draw:
    return linear("load_friction", {"load_coefficient": 1.0}, 0.03, 0.4,
                  same_as={"load_coefficient": "coefficient"})  # fmt: skip


def _directional(rng: np.random.Generator, _: Scales) -> Draw:
    ways = [1.0, float(rng.uniform(0.0, 0.4))]
    forward, backward = ways if rng.random() < 0.5 else ways[::-1]
    scaled = {"loss_forward": forward, "loss_backward": backward}
    same = {"loss_forward": "forward", "loss_backward": "backward"}
    return linear("directional_loss", scaled, 0.05, 0.4, same_as=same)


def _ripple(name: str, stem: str, unit: str, start: float, most: float,
            unit_of: Callable[[Scales], float]) -> Drawer:  # fmt: skip
    def draw(rng: np.random.Generator, at: Scales) -> Draw:
        cycles = _cycles(rng, at)
        shape = {f"{stem}_cycles": cycles, f"{stem}_phase_rad": phase(rng)}
        steepest = 0.2 / (cycles * unit_of(at)) if unit == "rad" else most
        return linear(name, {f"{stem}_{unit}": unit_of(at)}, min(start, 0.1 * steepest),
                      min(most, steepest), shape,
                      same_as={f"{stem}_cycles": "cycles_per_turn"})  # fmt: skip

    return draw


def _drag(rng: np.random.Generator, at: Scales) -> Draw:
    link = math.isfinite(at.resonance_hz) and rng.random() < 0.5
    side = "link" if link else "motor"
    return linear("quadratic_friction", {f"drag_{side}_nm_s2_rad2": at.torque / at.speed**2}, 0.03,
                  0.5, same_as={f"drag_{side}_nm_s2_rad2": f"{side}_nm_s2_rad2"})  # fmt: skip


def _backlash(_: np.random.Generator, at: Scales) -> Draw:
    return linear("backlash", {"half_gap_rad": at.deflection}, 0.1, 2.0,
                  same_as={"half_gap_rad": "half_gap_rad"})  # fmt: skip


def _piecewise(rng: np.random.Generator, at: Scales) -> Draw:
    shape = {"soft_ratio": float(rng.uniform(0.3, 0.7))}
    return linear("piecewise_stiffness", {"soft_zone_rad": at.deflection}, 0.3, 2.0, shape,
                  same_as={"soft_zone_rad": "zone_rad", "soft_ratio": "soft_ratio"})  # fmt: skip


def _asymmetric_stiffness(rng: np.random.Generator, _: Scales) -> Draw:
    return linear("asymmetric_stiffness", {"stiffness_asymmetry": sign(rng)}, 0.05, 0.4,
                  same_as={"stiffness_asymmetry": "relative"})  # fmt: skip


def _hysteresis(rng: np.random.Generator, at: Scales) -> Draw:
    return linear("hysteresis", {"hysteresis_nm": at.torque}, 0.03, 0.5,
                  {"hysteresis_rad": at.deflection * log_uniform(rng, 0.1, 1.0)})  # fmt: skip


def _transmission_damping(_: np.random.Generator, at: Scales) -> Draw:
    return linear("transmission_damping", {"flex_damping_nm_s_rad": at.damping}, 0.02, 0.4,
                  same_as={"flex_damping_nm_s_rad": "nm_s_rad"})  # fmt: skip


def _extra_mode(rng: np.random.Generator, at: Scales) -> Draw:
    hertz = min(at.resonance_hz * log_uniform(rng, 0.6, 1.8), 0.85 * at.band_hz)
    shape = {"mode_hz": hertz, "mode_damping_ratio": log_uniform(rng, 0.01, 0.05)}
    same = {"mode_kg_m2": "inertia_kg_m2", "mode_hz": "frequency_hz",
            "mode_damping_ratio": "damping_ratio"}  # fmt: skip
    return linear("extra_mode", {"mode_kg_m2": at.link_inertia}, 0.02, 0.3, shape, same)


def _gravity(rng: np.random.Generator, at: Scales) -> Draw:
    return linear("gravity", {"gravity_nm": at.torque}, 0.1, 1.0,
                  {"gravity_angle_rad": phase(rng)},
                  {"gravity_nm": "torque_nm", "gravity_angle_rad": "angle_rad"})  # fmt: skip


def _spring(rng: np.random.Generator, at: Scales) -> Draw:
    rest = at.angle * float(rng.uniform(-2.0, 2.0))
    return linear("external_spring", {"spring_nm_rad": at.torque / at.angle}, 0.03, 0.5,
                  {"spring_rest_rad": rest},
                  {"spring_nm_rad": "stiffness_nm_rad", "spring_rest_rad": "rest_rad"})  # fmt: skip


def _hardening(rng: np.random.Generator, at: Scales) -> Draw:
    scaled = {"spring_nm_rad3": at.torque / at.angle**3}
    if rng.random() < 0.5:
        scaled["spring_nm_rad"] = at.torque / at.angle * float(rng.uniform(0.5, 2.0))
    return linear("hardening_spring", scaled, 0.02, 0.5,
                  {"spring_rest_rad": at.angle * float(rng.uniform(-0.5, 0.5))},
                  {"spring_nm_rad3": "cubic_nm_rad3", "spring_nm_rad": "stiffness_nm_rad",
                   "spring_rest_rad": "rest_rad"})  # fmt: skip


def _cable(rng: np.random.Generator, at: Scales) -> Draw:
    return linear("cable", {"cable_nm_rad": at.torque / at.angle}, 0.05, 0.5,
                  {"cable_time_s": log_uniform(rng, 0.05, 2.0)},
                  {"cable_nm_rad": "stiffness_nm_rad", "cable_time_s": "relaxation_s"})  # fmt: skip


def _delay(_: np.random.Generator, at: Scales) -> Draw:
    return linear("delay", {"delay_s": 1.0 / at.crossover_hz}, 2e-3, 0.06,
                  same_as={"delay_s": "time_s"})  # fmt: skip


def _lag(_: np.random.Generator, at: Scales) -> Draw:
    return linear("actuator_lag", {"lag_s": 1.0 / at.crossover_hz}, 2e-3, 0.06)


def _saturation(_: np.random.Generator, at: Scales) -> Draw:
    return Draw("torque_saturation", lambda size: {"limit_nm": at.torque_peak * (1.2 - size)}, 0.3,
                0.75)  # fmt: skip


def _speed_limit(rng: np.random.Generator, at: Scales) -> Draw:
    stall = at.torque_peak * rng.uniform(1.2, 1.8)
    same = {"stall_nm": "stall_nm", "no_load_rad_s": "no_load_rad_s"}
    return Draw(
        "torque_speed_limit",
        lambda size: {"stall_nm": stall, "no_load_rad_s": at.speed_peak / size},
        0.5,
        0.95,
        {ours: f"torque_speed_limit.{theirs}" for ours, theirs in same.items()},
    )


def _slew(_: np.random.Generator, at: Scales) -> Draw:
    return Draw(
        "torque_slew_limit",
        lambda size: {"slew_nm_s": at.torque_rate_peak / size},
        1.0,
        20.0,
        {"slew_nm_s": "torque_slew_limit.limit_nm_s"},
    )


def _dead_band(_: np.random.Generator, at: Scales) -> Draw:
    return linear("dead_band", {"deadband_nm": at.torque}, 0.03, 0.3,
                  same_as={"deadband_nm": "width_nm"})  # fmt: skip


def _quantization(_: np.random.Generator, at: Scales) -> Draw:
    return linear("encoder_quantization", {"resolution_rad": at.angle}, 5e-3, 0.1,
                  same_as={"resolution_rad": "resolution_rad"})  # fmt: skip


def _eccentricity(rng: np.random.Generator, _: Scales) -> Draw:
    return linear("encoder_eccentricity", {"eccentricity_rad": 1.0}, 0.02, 0.2,
                  {"eccentricity_phase_rad": phase(rng)})  # fmt: skip


def _drift(rng: np.random.Generator, _: Scales) -> Draw:
    return linear("nonstationary", {"drift_relative": sign(rng)}, 0.1, 0.6,
                  {"drift_time_s": log_uniform(rng, 15.0, 60.0)})  # fmt: skip


def _lacking(
    name: str, value: str, unit: Callable[[Scales], float], most: float, parameter: str
) -> Drawer:
    def draw(_: np.random.Generator, at: Scales) -> Draw:
        factor = unit(at)
        names = (value,) if math.isfinite(at.resonance_hz) else (value, value[:2])
        same = {value: f"{name}.{parameter}"}
        return Draw(name, lambda size: {value: factor * size}, 0.1 * most, most, same, names)

    return draw


_FRICTION: tuple[Drawer, ...] = (
    _lacking("coulomb_friction", "fsm", lambda at: at.torque, 0.5, "motor_nm"),
    _lacking("viscous_friction", "fvm", lambda at: at.torque / at.speed, 0.5, "motor_nm_s_rad"),
)

_ANY_AXIS: tuple[Drawer, ...] = (
    _stribeck("motor", "motor"),
    _asymmetric,
    _torque_bias,
    _presliding,
    _lugre,
    _ripple("position_friction", "friction_angle", "nm", 0.2, 0.9, lambda at: at.coulomb),
    _drag,
    _gravity,
    _spring,
    _hardening,
    _cable,
    _ripple("cogging", "cogging", "nm", 0.03, 0.5, lambda at: at.torque),
    _delay,
    _lag,
    _saturation,
    _speed_limit,
    _slew,
    _dead_band,
    _ripple("torque_constant_ripple", "ripple", "relative", 0.05, 0.5, lambda _: 1.0),
    _quantization,
    _eccentricity,
)

_FLEXIBLE: tuple[Drawer, ...] = (
    _stribeck("link", "link"),
    _load,
    _directional,
    _backlash,
    _piecewise,
    _asymmetric_stiffness,
    _hysteresis,
    _transmission_damping,
    _ripple("kinematic_error", "kinematic", "rad", 0.02, 0.4, lambda at: at.deflection),
    _extra_mode,
    _lacking(
        "cubic_stiffness", "k1", lambda at: at.torque / at.deflection**3, 0.3, "stiffness_nm_rad3"
    ),
)


def drawers(*, rigid: bool, stationary: bool) -> tuple[Drawer, ...]:
    """Return the drawers of causes that a rig can have.

    A gain of the torque is never one: it is exactly a scale of all parameters. Nor is the linear
    stiffness that a datasheet lacks. A drift is one only where friction does not scatter anyway.
    """
    flexible = () if rigid else _FLEXIBLE
    return (*_FRICTION, *_ANY_AXIS, *flexible, *(() if stationary else (_drift,)))


FAMILIES: tuple[frozenset[str], ...] = tuple(
    frozenset(names)
    for names in (
        ("asymmetric_friction", "torque_bias", "gravity", "external_spring", "hardening_spring",
         "cable"),
        ("backlash", "piecewise_stiffness", "asymmetric_stiffness", "cubic_stiffness"),
        ("delay", "actuator_lag", "torque_slew_limit"),
        ("position_friction", "cogging", "torque_constant_ripple", "kinematic_error"),
        ("hysteresis", "transmission_damping", "directional_loss", "load_friction"),
        ("presliding_friction", "lugre_friction", "stribeck_friction_motor",
         "stribeck_friction_link", "coulomb_friction"),
        ("torque_saturation", "torque_speed_limit"),
    )
)  # fmt: skip
"""Effects that are near each other: two of one family are never put into one case."""


def compatible(names: Sequence[str], name: str) -> bool:
    """Tell whether a further cause differs from all others and is near none of them."""
    return name not in names and not any(
        name in family and other in family for family in FAMILIES for other in names
    )
