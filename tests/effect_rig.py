"""Helpers of the tests of effects: a rig that is held sample by sample, and its energy."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation import closed_loop, rig

RATE = 1000.0
PAPER = plant.PLANT.defaults()
FRICTIONLESS = {"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}
LINK_HELD = {"fs": 1e5}
MOTOR_HELD = {"fsm": 1e5}
APART = {"k0": 0.0, "k1": 0.0}
CONTROLLER = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())

MODERATE = {
    "coulomb_friction": {"motor_nm": 2.0, "link_nm": 1.0},
    "viscous_friction": {"motor_nm_s_rad": 1.0, "link_nm_s_rad": 0.5},
    "stribeck_friction_motor": {"torque_nm": 2.0, "velocity_rad_s": 0.05},
    "stribeck_friction_link": {"torque_nm": 2.0, "velocity_rad_s": 0.05},
    "asymmetric_friction": {"coulomb_nm": 1.0, "viscous_nm_s_rad": 0.5},
    "torque_bias": {"torque_nm": 1.0},
    "presliding_friction": {"motor_rad": 1e-3, "link_rad": 5e-4},
    "load_friction": {"coefficient": 0.1},
    "lugre_friction": {
        "stribeck_nm": 2.0,
        "bristle_nm_rad": 6e3,
        "velocity_rad_s": 0.05,
        "damping_nm_s_rad": 5.0,
    },
    "directional_loss": {"forward": 0.1, "backward": 0.03},
    "position_friction": {
        "amplitude_nm": 2.0,
        "cycles_per_turn": 50.0,
        "phase_rad": 0.3,
        "second_ratio": 0.4,
        "second_phase_rad": 0.9,
    },
    "quadratic_friction": {"motor_nm_s2_rad2": 2.0, "link_nm_s2_rad2": 2.0},
    "backlash": {"half_gap_rad": 1e-3},
    "piecewise_stiffness": {"zone_rad": 2e-3, "soft_ratio": 0.4},
    "asymmetric_stiffness": {"relative": 0.2},
    "cubic_stiffness": {"stiffness_nm_rad3": 2e6},
    "hysteresis": {"torque_nm": 3.0, "displacement_rad": 1e-3},
    "transmission_damping": {"nm_s_rad": 2.0},
    "kinematic_error": {
        "amplitude_rad": 1e-3,
        "cycles_per_turn": 20.0,
        "phase_rad": 0.3,
        "second_ratio": 0.4,
        "second_phase_rad": 0.9,
    },
    "extra_mode": {"inertia_kg_m2": 0.03, "frequency_hz": 30.0, "damping_ratio": 0.02},
    "gravity": {"torque_nm": 3.0, "angle_rad": 0.5},
    "external_spring": {"stiffness_nm_rad": 40.0, "rest_rad": 0.05},
    "hardening_spring": {"cubic_nm_rad3": 3e4, "stiffness_nm_rad": 20.0, "rest_rad": 0.02},
    "cable": {"stiffness_nm_rad": 40.0, "relaxation_s": 0.2},
    "transmission_stiffness": {
        "compliance_rad_nm": 1e-3,
        "link_inertia_share": 0.6,
        "link_coulomb_share": 0.4,
        "link_viscous_share": 0.6,
    },
    "cogging": {
        "amplitude_nm": 1.0,
        "cycles_per_turn": 24.0,
        "phase_rad": 0.3,
        "second_ratio": 0.4,
        "second_phase_rad": 0.9,
    },
    "delay": {"time_s": 5e-4},
    "actuator_lag": {"time_constant_s": 1e-3},
    "torque_saturation": {"limit_nm": 30.0},
    "torque_speed_limit": {"stall_nm": 30.0, "no_load_rad_s": 30.0},
    "torque_slew_limit": {"limit_nm_s": 3e5},
    "dead_band": {"width_nm": 0.5},
    "torque_constant_ripple": {
        "amplitude": 0.1,
        "cycles_per_turn": 24.0,
        "phase_rad": 0.3,
        "second_ratio": 0.4,
        "second_phase_rad": 0.9,
    },
    "torque_gain": {"relative_error": 0.05},
    "encoder_quantization": {"resolution_rad": 1e-5},
    "encoder_eccentricity": {"amplitude_rad": 1e-3, "phase_rad": 0.3},
    "nonstationary": {"friction_per_s": 0.02},
}
"""A size of each effect that shows in the closed loop."""


def named(identifier: str, **values: float) -> dict[str, float]:
    """Return an effect's parameters under their full names."""
    return {f"{identifier}.{name}": value for name, value in values.items()}


def moderate(*identifiers: str) -> dict[str, float]:
    """Return the parameters of these effects at a moderate size."""
    together: dict[str, float] = {}
    for identifier in identifiers:
        together |= named(identifier, **MODERATE[identifier])
    return together


def axis(*identifiers: str) -> dict[str, float]:
    """Return what makes an axis one that can have these effects: rigid, where only such can."""
    flexible = all(effects.EFFECTS[identifier].on_flexible_axis for identifier in identifiers)
    return {} if flexible else {"k0": math.inf}


@dataclass
class Rig:
    """A rig under held torque.

    Attributes:
        plant: bare parameters that differ from the paper's.
        effects: effect parameters by full name.
        x: state: q, vq, th, vth, q3, v3, lagged torque, presliding torque of link and motor,
            hysteresis, angle at which a cable pulls nowhere.
        get: returns an effect parameter by its full name.
    """

    plant: dict[str, float] = field(default_factory=dict)
    effects: dict[str, float] = field(default_factory=dict)
    x: np.ndarray = field(default_factory=rig.at_rest)

    def __post_init__(self) -> None:
        given = {**plant.PLANT.check(self.plant), **self.effects}
        self.values = plant.with_added(given)
        self.one_body = plant.moves_as_one(given)
        self.p = plant.coefficients(given)
        self.e = effects.coefficients(self.effects)
        sizes = effects.DEFAULTS if self.e is None else self.e
        self.get = dict(zip(effects.NAMES, map(float, sizes), strict=False)).__getitem__

    def start(self, q=0.0, vq=0.0, th=0.0, vth=0.0) -> Rig:
        """Set the motion of the two bodies."""
        self.x[:4] = q, vq, th, vth
        self.x[4] = self.x[10] = q
        return self

    def hold(self, torque: float, duration: float = 1e-3, parts: int = 1) -> np.ndarray:
        """Hold a torque; return a copy of q, vq, th, vth, ... after it."""
        for _ in range(parts):
            rig.hold(self.x, torque, duration / parts, self.p, self.e)
        return self.x[:11].copy()

    def play(self, torque, duration: float = 1e-3, parts: int = 1) -> np.ndarray:
        """Hold one torque after the other; return the states, shape (torques, 11)."""
        return np.array([self.hold(float(u), duration, parts) for u in torque])

    def energy(self) -> float:
        """Return kinetic energy and what all springs and fields hold (J)."""
        v, get = self.values, self.get
        q, vq, th, vth, q3, v3, _, link, motor, flex, slack = self.x[:11].tolist()
        if self.one_body:
            q, vq, v = th, vth, {**v, "k0": 0.0, "k1": 0.0}
        rate = 2.0 * math.pi * get("extra_mode.frequency_hz")
        third = 0.5 * get("extra_mode.inertia_kg_m2") * (v3**2 + (rate * (q3 - q)) ** 2)
        ripple, cycles = get("cogging.amplitude_nm"), get("cogging.cycles_per_turn")
        angle = cycles * th + get("cogging.phase_rad")
        return (
            0.5 * v["j"] * vq**2
            + 0.5 * v["jm"] * vth**2
            + third
            + spring_energy(twist(q, th, get), v, get)
            + self.bristle_energy(link, motor, get)
            + 0.5 * get("hysteresis.torque_nm") * get("hysteresis.displacement_rad") * flex**2
            - get("gravity.torque_nm") * math.cos(q + get("gravity.angle_rad"))
            + 0.5
            * get("external_spring.stiffness_nm_rad")
            * (q - get("external_spring.rest_rad")) ** 2
            + 0.5
            * get("hardening_spring.stiffness_nm_rad")
            * (q - get("hardening_spring.rest_rad")) ** 2
            + 0.25
            * get("hardening_spring.cubic_nm_rad3")
            * (q - get("hardening_spring.rest_rad")) ** 4
            + 0.5 * get("cable.stiffness_nm_rad") * (q - slack) ** 2
            + ripple / cycles * math.cos(angle)
            + ripple
            * get("cogging.second_ratio")
            / (2.0 * cycles)
            * math.cos(2.0 * angle + get("cogging.second_phase_rad"))
        )

    def bristle_energy(self, link, motor, get) -> float:
        """Return what presliding friction holds: F^2/(2 sigma), sigma level over distance (J)."""
        second = 1.0 + get("position_friction.second_ratio")
        highest_link = self.values["fs"] + get("stribeck_friction_link.torque_nm")
        highest_motor = (
            self.values["fsm"]
            + get("stribeck_friction_motor.torque_nm")
            + get("position_friction.amplitude_nm") * second
            + abs(get("asymmetric_friction.coulomb_nm"))
            + get("lugre_friction.stribeck_nm")
        )
        lugre = get("lugre_friction.bristle_nm_rad")
        if lugre != math.inf:
            highest_motor, distance = lugre, 1.0
        else:
            distance = get("presliding_friction.motor_rad")
        sides = (
            (link, highest_link, get("presliding_friction.link_rad")),
            (motor, highest_motor, distance),
        )
        return sum(
            0.5 * torque**2 * distance / highest
            for torque, highest, distance in sides
            if distance and highest
        )

    def work(self, torque: float) -> float:
        """Return the work that a held command has done at the present motor angle (J)."""
        get = self.get
        given = math.copysign(max(abs(torque) - get("dead_band.width_nm"), 0.0), torque)
        given *= 1.0 + get("torque_gain.relative_error")
        th, cycles = float(self.x[2]), get("torque_constant_ripple.cycles_per_turn")
        angle = cycles * th + get("torque_constant_ripple.phase_rad")
        second = get("torque_constant_ripple.second_ratio") / 2.0
        turned = -math.cos(angle) - second * math.cos(
            2.0 * angle + get("torque_constant_ripple.second_phase_rad")
        )
        ripple = get("torque_constant_ripple.amplitude") * turned / cycles
        return given * (th + ripple) + get("torque_bias.torque_nm") * th


def twist(q, th, get) -> float:
    """Return the deflection with kinematic error (rad)."""
    angle = get("kinematic_error.cycles_per_turn") * th + get("kinematic_error.phase_rad")
    second = math.sin(2.0 * angle + get("kinematic_error.second_phase_rad"))
    error = math.sin(angle) + get("kinematic_error.second_ratio") * second
    return q - th + get("kinematic_error.amplitude_rad") * error


def spring_energy(d, v, get) -> float:
    """Return the energy of the transmission's spring behind gap and soft zone (J)."""

    side = 1.0 if d > 0.0 else -1.0
    stiffness = v["k0"] * (1.0 + side * get("asymmetric_stiffness.relative"))

    def held(reduced):
        return 0.5 * stiffness * reduced**2 + 0.25 * v["k1"] * reduced**4

    d = max(abs(d) - get("backlash.half_gap_rad"), 0.0)
    zone, ratio = get("piecewise_stiffness.zone_rad"), get("piecewise_stiffness.soft_ratio")
    inside = min(d, zone)
    # the spring sees ratio * d within the zone: over d it takes 1/ratio of its own energy
    slack = held(ratio * inside) * (1.0 / ratio - 1.0) if ratio else 0.0
    return held(d - (1.0 - ratio) * inside) + slack


def multisine_reference(amplitude: float, seed: int = 1) -> np.ndarray:
    """Return one period of the paper's reference at 1 kHz (rad)."""
    values = multisine.EXCITATION.check(
        {"amplitudes_rad": (amplitude,), "periods": 1, "transient_periods": 0, "seed": seed}
    )
    return multisine.reference(multisine.describe(values, 0, 0))


def simulate(reference, on, elapsed_s=0.0, noise=None, **plant_values):
    """Simulate the paper's loop with effects: parameters by full name, or coefficients, or None."""
    bare, e = plant.PLANT.check(plant_values), on
    if isinstance(on, dict):
        bare, e = bare | on, effects.coefficients(on)
    return closed_loop.simulate(
        reference,
        RATE,
        plant.coefficients(bare),
        CONTROLLER,
        noise,
        e,
        elapsed_s,
    )


def relative_rms(signal, exact) -> float:
    """Return the rms of the difference over the rms of the exact signal."""
    return float(np.sqrt(np.mean((signal - exact) ** 2) / np.mean(exact**2)))
