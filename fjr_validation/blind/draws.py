"""Effects of blind cases: each effect of the catalogue, and effects outside any catalogue.

Each draw fixes the shape of an effect at random and leaves one number free, its size. Settings are
those of the second plant; where one means the same as a parameter of the catalogue, that is said,
so that intervals can be checked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Draw:
    """An effect with its shape drawn and its size free.

    Attributes:
        name: identifier of the catalogue, or a name of ours outside it.
        scaled: settings that are a factor times the size.
        start: a size to start the search for the detection limit from.
        most: greatest size that makes sense.
        least: least size that makes sense; 0 if there is none.
        shape: settings that do not depend on the size.
        clips: setting that limits the torque to (1.2 - size) of its peak without the effect.
        slows: setting that limits the torque's rate to its peak, sample to sample, over the size.
        same_as: catalogue parameter by setting, where both mean the same.
    """

    name: str
    scaled: Mapping[str, float]
    start: float
    most: float
    shape: Mapping[str, float] = field(default_factory=dict)
    clips: str | None = None
    slows: str | None = None
    least: float = 0.0
    same_as: Mapping[str, str] = field(default_factory=dict)

    def settings(self, size: float, peaks: Mapping[str, float]) -> dict[str, float]:
        """Return the second plant's settings for a size."""
        settings = dict(self.shape)
        settings |= {name: factor * size for name, factor in self.scaled.items()}
        if self.clips:
            settings[self.clips] = peaks["torque"] * (1.2 - size)
        if self.slows:
            settings[self.slows] = peaks["torque_rate"] / size
        return settings


Drawer = Callable[[np.random.Generator], Draw]


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _phase(rng: np.random.Generator) -> float:
    return float(rng.uniform(-np.pi, np.pi))


def _stribeck(side: str, letter: str) -> Drawer:
    def draw(rng: np.random.Generator) -> Draw:
        shape = {f"stribeck_{letter}_rad_s": _log(rng, 0.03, 0.2)}
        return Draw(
            f"stribeck_friction_{side}", {f"stribeck_{letter}_nm": 1.0}, 0.5, 8.0, shape
        )  # the Lorentzian's height means the Gaussian's only roughly

    return draw


def _asymmetric(rng: np.random.Generator) -> Draw:
    if rng.random() < 0.5:
        name = "asymmetric_viscous_nm_s_rad"
        same = {name: "asymmetric_friction.viscous_nm_s_rad"}
        return Draw("asymmetric_friction", {name: _sign(rng)}, 0.2, 2.0, same_as=same)
    same = {"asymmetric_coulomb_nm": "asymmetric_friction.coulomb_nm"}
    return Draw("asymmetric_friction", {"asymmetric_coulomb_nm": _sign(rng)}, 0.2, 5.0,
                same_as=same)  # fmt: skip


def _torque_bias(rng: np.random.Generator) -> Draw:
    return Draw("torque_bias", {"bias_nm": _sign(rng)}, 0.2, 5.0,
                same_as={"bias_nm": "torque_bias.torque_nm"})  # fmt: skip


def _presliding(rng: np.random.Generator) -> Draw:
    motor, link = [(1.0, 0.0), (0.0, 1.0), (1.0, _log(rng, 0.5, 2.0))][rng.integers(3)]
    scaled = {"presliding_motor_rad": motor, "presliding_link_rad": link}
    return Draw("presliding_friction", {k: v for k, v in scaled.items() if v}, 2e-4, 5e-2,
                least=2e-5)  # fmt: skip


def _load(rng: np.random.Generator) -> Draw:
    return Draw("load_friction", {"load_coefficient": 1.0}, 0.02, 0.5,
                same_as={"load_coefficient": "load_friction.coefficient"})  # fmt: skip


def _periodic(name: str, stem: str, unit: str, start: float, most: float,
              cycles: tuple[float, float]) -> Drawer:  # fmt: skip
    def draw(rng: np.random.Generator) -> Draw:
        shape = {f"{stem}_cycles": round(_log(rng, *cycles)), f"{stem}_phase_rad": _phase(rng)}
        return Draw(name, {f"{stem}_{unit}": 1.0}, start, most, shape,
                    same_as={f"{stem}_cycles": f"{name}.cycles_per_turn"})  # fmt: skip

    return draw


def _drag(rng: np.random.Generator) -> Draw:
    side = str(rng.choice(["motor", "link"]))
    name = f"drag_{side}_nm_s2_rad2"
    return Draw("quadratic_friction", {name: 1.0}, 0.3, 20.0,
                same_as={name: f"quadratic_friction.{side}_nm_s2_rad2"})  # fmt: skip


def _backlash(rng: np.random.Generator) -> Draw:
    return Draw("backlash", {"half_gap_rad": 1.0}, 2e-4, 2e-2,
                same_as={"half_gap_rad": "backlash.half_gap_rad"})  # fmt: skip


def _piecewise(rng: np.random.Generator) -> Draw:
    shape = {"soft_ratio": float(rng.uniform(0.3, 0.7))}
    return Draw("piecewise_stiffness", {"soft_zone_rad": 1.0}, 5e-4, 5e-2, shape,
                same_as={"soft_zone_rad": "piecewise_stiffness.zone_rad",
                         "soft_ratio": "piecewise_stiffness.soft_ratio"})  # fmt: skip


def _hysteresis(rng: np.random.Generator) -> Draw:
    return Draw("hysteresis", {"hysteresis_nm": 1.0}, 0.5, 10.0,
                {"hysteresis_rad": _log(rng, 5e-4, 4e-3)})  # fmt: skip


def _transmission_damping(rng: np.random.Generator) -> Draw:
    return Draw("transmission_damping", {"flex_damping_nm_s_rad": 1.0}, 0.2, 20.0,
                same_as={"flex_damping_nm_s_rad": "transmission_damping.nm_s_rad"})  # fmt: skip


def _extra_mode(rng: np.random.Generator) -> Draw:
    shape = {"mode_hz": _log(rng, 15.0, 45.0), "mode_damping_ratio": _log(rng, 0.01, 0.04)}
    same = {"mode_kg_m2": "inertia_kg_m2", "mode_hz": "frequency_hz",
            "mode_damping_ratio": "damping_ratio"}  # fmt: skip
    return Draw("extra_mode", {"mode_kg_m2": 1.0}, 5e-3, 0.1, shape,
                same_as={k: f"extra_mode.{v}" for k, v in same.items()})  # fmt: skip


def _gravity(rng: np.random.Generator) -> Draw:
    return Draw("gravity", {"gravity_nm": 1.0}, 0.5, 20.0, {"gravity_angle_rad": _phase(rng)},
                same_as={"gravity_nm": "gravity.torque_nm",
                         "gravity_angle_rad": "gravity.angle_rad"})  # fmt: skip


def _delay(rng: np.random.Generator) -> Draw:
    return Draw("delay", {"delay_s": 1.0}, 1e-4, 1.2e-3, same_as={"delay_s": "delay.time_s"})


def _lag(rng: np.random.Generator) -> Draw:
    return Draw("actuator_lag", {"lag_s": 1.0}, 1e-4, 1.5e-3)


def _saturation(rng: np.random.Generator) -> Draw:
    return Draw("torque_saturation", {}, 0.2, 0.8, clips="limit_nm")


def _gain(rng: np.random.Generator) -> Draw:
    return Draw("torque_gain", {"gain_error": _sign(rng)}, 0.05, 0.1)


def _quantization(rng: np.random.Generator) -> Draw:
    same = {"resolution_rad": "encoder_quantization.resolution_rad"}
    return Draw("encoder_quantization", {"resolution_rad": 1.0}, 1e-4, 5e-3, same_as=same)


def _eccentricity(rng: np.random.Generator) -> Draw:
    return Draw("encoder_eccentricity", {"eccentricity_rad": 1.0}, 1e-2, 0.2,
                {"eccentricity_phase_rad": _phase(rng)})  # fmt: skip


def _drift(rng: np.random.Generator) -> Draw:
    return Draw("nonstationary", {"drift_relative": _sign(rng)}, 0.05, 0.6,
                {"drift_time_s": _log(rng, 15.0, 60.0)})  # fmt: skip


def _slew(rng: np.random.Generator) -> Draw:
    return Draw("torque_slew_limit", {}, 0.5, 4.0, slows="slew_nm_s",
                same_as={"slew_nm_s": "torque_slew_limit.limit_nm_s"})  # fmt: skip


def _deadband(rng: np.random.Generator) -> Draw:
    return Draw("dead_band", {"deadband_nm": 1.0}, 0.3, 6.0,
                same_as={"deadband_nm": "dead_band.width_nm"})  # fmt: skip


def _asymmetric_stiffness(rng: np.random.Generator) -> Draw:
    return Draw("asymmetric_stiffness", {"stiffness_asymmetry": _sign(rng)}, 0.03, 0.5,
                same_as={"stiffness_asymmetry": "asymmetric_stiffness.relative"})  # fmt: skip


def _ripple(rng: np.random.Generator) -> Draw:
    same = {"ripple_relative": "amplitude", "ripple_cycles": "cycles_per_turn"}
    return Draw("torque_constant_ripple", {"ripple_relative": 1.0}, 0.05, 0.6,
                {"ripple_cycles": _log(rng, 10.0, 150.0)},
                same_as={k: f"torque_constant_ripple.{v}" for k, v in same.items()})  # fmt: skip


SINGLE: tuple[Drawer, ...] = (
    _stribeck("motor", "motor"),
    _stribeck("link", "link"),
    _asymmetric,
    _torque_bias,
    _presliding,
    _load,
    _periodic("position_friction", "friction_angle", "nm", 0.5, 5.0, (10.0, 200.0)),
    _drag,
    _backlash,
    _piecewise,
    _hysteresis,
    _transmission_damping,
    _periodic("kinematic_error", "kinematic", "rad", 2e-4, 5e-3, (10.0, 100.0)),
    _extra_mode,
    _gravity,
    _periodic("cogging", "cogging", "nm", 0.3, 10.0, (10.0, 200.0)),
    _delay,
    _lag,
    _saturation,
    _slew,
    _deadband,
    _asymmetric_stiffness,
    _ripple,
    _gain,
    _quantization,
    _eccentricity,
)
"""Draws of the effects of the catalogue but drift that the second plant has a law for."""

NONSTATIONARY: Drawer = _drift

COMBINED: tuple[Drawer, ...] = tuple(
    drawer for drawer in SINGLE if drawer not in (_gain, _quantization, _eccentricity)
)
"""Draws for cases of two effects: those that can be seen at all."""


def _absorber(rng: np.random.Generator) -> Draw:
    scaled = {"absorber_kg_m2": 1.0, "absorber_nm_rad3": _log(rng, 5e5, 5e6)}
    return Draw("nonlinear_absorber", scaled, 5e-3, 0.1)


def _hum(rng: np.random.Generator) -> Draw:
    return Draw("synchronous_disturbance", {"hum_nm": 1.0}, 0.5, 10.0,
                {"hum_hz": 0.25 * float(rng.integers(8, 120))})  # fmt: skip


def _memory(rng: np.random.Generator) -> Draw:
    return Draw("frictional_memory", {"memory_relative": 1.0}, 0.2, 1.5,
                {"memory_time_s": _log(rng, 0.02, 0.2)})  # fmt: skip


def _angle_stiffness(rng: np.random.Generator) -> Draw:
    return Draw("angle_dependent_stiffness", {"angle_stiffness_relative": 1.0}, 0.05, 0.6,
                {"angle_stiffness_cycles": _log(rng, 5.0, 60.0)})  # fmt: skip


def _inertia(rng: np.random.Generator) -> Draw:
    return Draw("posture_dependent_inertia", {"inertia_variation": _sign(rng)}, 0.05, 0.6,
                {"inertia_cycles": _log(rng, 2.0, 12.0)})  # fmt: skip


OUTSIDE: tuple[Drawer, ...] = (
    _absorber,
    _hum,
    _memory,
    _angle_stiffness,
    _inertia,
)
"""Draws of effects that the catalogue does not hold."""
