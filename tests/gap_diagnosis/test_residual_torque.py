"""Residual torque: the binned curve is the effect's torque within bounds, and tells its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import NOISE_RAD, Case, simulate_case, with_other_noise

from fjr_records.noise import noise_levels
from gap_diagnosis.where.residual_torque import ResidualTorque, residual_torque
from gap_diagnosis.where.torque_curves import curve


def residual(case: Case, explained: bool = False) -> ResidualTorque:
    model = case.truth if explained else case.bare
    return residual_torque(case.recorded, model, noise_levels(case.recorded))


def rms_moving(found: ResidualTorque, level: int) -> float:
    return float(found.torque[(found.level[:, None] == level) & found.moving].std())


def velocity_resolution(found: ResidualTorque, level: int) -> float:
    """Return the change of velocity (rad/s) that the band can tell, rms over a level.

    It is the acceleration over twice the band: what depends on velocity is smeared by as much.
    """
    rows = found.level == level
    acceleration = np.gradient(found.velocity[rows], found.time_s, axis=1)
    return float(np.sqrt(np.mean(acceleration**2)) / (2.0 * found.band_hz[rows].min()))


EFFECTS = {
    "torque_bias": {"torque_bias.torque_nm": 0.5},
    "stribeck_motor": {
        "stribeck_friction_motor.torque_nm": 1.5,
        "stribeck_friction_motor.velocity_rad_s": 0.5,
    },
    "drag_motor": {"quadratic_friction.motor_nm_s2_rad2": 0.3},
    "drag_link": {"quadratic_friction.link_nm_s2_rad2": 0.3},
    "asymmetric": {"asymmetric_friction.viscous_nm_s_rad": 0.3},
    "cogging": {"cogging.amplitude_nm": 1.0, "cogging.cycles_per_turn": 12.0},
    "position_friction": {
        "position_friction.amplitude_nm": 1.0,
        "position_friction.cycles_per_turn": 20.0,
    },
    "backlash": {"backlash.half_gap_rad": 1.5e-3},
    "hysteresis": {"hysteresis.torque_nm": 2.0},
    "transmission_damping": {"transmission_damping.nm_s_rad": 2.0},
    "presliding": {"presliding_friction.motor_rad": 2e-3},
    "extra_mode": {"extra_mode.inertia_kg_m2": 0.02},
    "delay": {"delay.time_s": 3e-4},
}


@pytest.fixture(scope="module")
def cases():
    return {name: simulate_case(values, seed=1) for name, values in EFFECTS.items()}


def test_nothing_is_missing_without_a_gap():
    found = residual(simulate_case(seed=1))
    assert max(rms_moving(found, level) for level in range(3)) < 0.25
    for level in range(3):
        over_velocity = curve(found, "velocity", level=level)
        assert np.abs(over_velocity.torque).max() < 0.12
        assert np.abs(over_velocity.torque / over_velocity.std).max() < 4.0


def test_without_noise_and_friction_of_the_motor_the_balance_is_exact():
    case = simulate_case(seed=1, noise_rad=0.0, levels_rad=(7e-3,))
    smooth = {**case.rig, "fsm": 1e-9}
    recorded = with_other_noise(replace(case, rig=smooth), 1)
    model = replace(case.truth, plant={**case.truth.plant, "fsm": 1e-9})
    found = residual_torque(recorded, model, None, 150.0)
    torque = np.std(recorded.realizations[0].torque)
    assert rms_moving(found, 0) < 1e-4 * torque


# name, coordinate, direction, torque over the coordinate, how many resolutions of velocity about
# zero are left out as smeared, greatest error of a bin at each level in N m
CURVES = [
    ("torque_bias", "velocity", 0, lambda v: 0.5 + 0.0 * v, 1.0, (0.2, 0.2, 0.2)),
    (
        "stribeck_motor",
        "velocity",
        0,
        lambda v: -1.5 * np.exp(-((v / 0.5) ** 2)) * np.sign(v),
        1.0,
        (0.2, 0.2, 0.15),
    ),
    ("drag_motor", "velocity", 0, lambda v: -0.3 * v * np.abs(v), 0.0, (0.15, 0.7, 1.2)),
    ("asymmetric", "velocity", 0, lambda v: -0.3 * np.abs(v), 1.0, (0.15, 0.15, 0.3)),
    ("cogging", "position", 0, lambda x: np.sin(12.0 * x), 0.0, (0.15, 0.15, 0.25)),
    ("position_friction", "position", 1, lambda x: -np.sin(20.0 * x), 0.0, (0.35, 0.4, 0.45)),
    ("position_friction", "position", -1, lambda x: np.sin(20.0 * x), 0.0, (0.35, 0.4, 0.45)),
]


@pytest.mark.parametrize(("name", "coordinate", "direction", "torque", "smeared", "bounds"), CURVES)
def test_the_curve_is_the_torque_of_the_effect(
    cases, name, coordinate, direction, torque, smeared, bounds
):
    found = residual(cases[name])
    for level, bound in enumerate(bounds):
        got = curve(found, coordinate, direction, level)
        want = torque(got.center)
        clear = np.abs(got.center) >= smeared * velocity_resolution(found, level)
        assert clear.sum() >= 8
        error = (got.torque - want)[clear]
        assert np.abs(error).max() < bound
        assert np.sqrt(np.mean(error**2)) < bound / 2.0


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_a_model_with_the_effect_leaves_no_more_than_one_without_a_gap(cases, name):
    without, explained = residual(cases[name]), residual(cases[name], explained=True)
    for level in range(3):
        assert rms_moving(explained, level) < 0.3 + 0.02 * rms_moving(without, level)


def test_a_second_encoder_gives_the_same_as_the_driven_link(cases):
    case = simulate_case(EFFECTS["cogging"], seed=1, with_link=True)
    with_link, without = residual(case), residual(cases["cogging"])
    assert np.std(with_link.torque - without.torque) < 0.05
    # the driven link follows the noise of y, the measured one doesn't
    assert np.abs(with_link.link_position - without.link_position).max() < 4 * NOISE_RAD


def test_a_second_encoder_shows_a_dead_zone_as_it_is():
    case = simulate_case(EFFECTS["backlash"], seed=1, with_link=True)
    found = residual(case)
    k0, k1, gap = case.truth.plant["k0"], case.truth.plant["k1"], 1.5e-3
    got = curve(found, "deflection", level=1)
    left = np.sign(got.center) * np.maximum(np.abs(got.center) - gap, 0.0)
    want = k0 * (left - got.center) + k1 * (left**3 - got.center**3)
    assert np.abs(want).max() > 2.0
    rate = np.gradient(found.deflection[found.level == 1], found.time_s, axis=1)
    smeared = np.sqrt(np.mean(rate**2)) / (2.0 * found.band_hz[2])  # what the band resolves
    clear = np.abs(got.center) > smeared
    assert clear.sum() > 15
    assert np.abs(got.torque - want)[clear].max() < 0.25


def test_the_band_narrows_with_noise_and_never_below_the_lines_in_use():
    bands = [
        residual(simulate_case(levels_rad=(7e-3,), noise_rad=rad)).band_hz[0]
        for rad in (5e-6, 2e-5, 1e-3)
    ]
    assert bands[0] > bands[1] > bands[2] >= 60.0
    one = simulate_case(levels_rad=(7e-3,), periods=1)
    assert residual_torque(one.recorded, one.bare).band_hz[0] == pytest.approx(100.0, rel=0.03)
