"""Models that begin in the steady state of another one: the same period, in less time."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, simulate_case

from fjr_sim_node import effects as fx
from gap_diagnosis.model.simulated_rig import Model, Simulator

EFFECTS = {
    "backlash": {"backlash.half_gap_rad": 1e-3},
    "delay": {"delay.time_s": 5e-4},
    "lag": {"actuator_lag.time_constant_s": 5e-4},
    "slew limit": {"torque_slew_limit.limit_nm_s": 1e5},
    "third mass": {
        "extra_mode.inertia_kg_m2": 0.05,
        "extra_mode.frequency_hz": 12.0,
        "extra_mode.damping_ratio": 0.1,
    },
    "presliding": {"presliding_friction.motor_rad": 3e-4},
    "gravity": {"gravity.torque_nm": 3.0, "gravity.angle_rad": 0.3},
    "drift": {"nonstationary.friction_per_s": -0.01},
}


@pytest.fixture(scope="module")
def case():
    return simulate_case(seed=4, **SHORT)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_steady_period_is_that_from_rest(case, name):
    assert all(fx.parameter(parameter) for parameter in EFFECTS[name])
    cold, near = Simulator(case.recorded), Simulator(case.recorded)
    near.begin_near(Model(case.truth.plant, {}))
    bent = {n: v * (0.9 if n == "k0" else 1.05) for n, v in case.truth.plant.items()}
    models = [Model(bent, EFFECTS[name])]
    from_rest, begun = cold.many(models), near.many(models)
    off = np.sqrt(np.mean((begun - from_rest) ** 2) / np.mean(from_rest**2))
    assert 0.0 < off < 1e-4


@pytest.mark.parametrize("relaxation_s", [0.05, 1.0, 100.0])
def test_a_cable_that_has_not_settled_is_off_by_little(case, relaxation_s):
    """It begins in the middle of the motion: where it is anywhere else, up to 23 % are off."""
    cold, near = Simulator(case.recorded), Simulator(case.recorded)
    near.begin_near(Model(case.truth.plant, {}))
    cable = {"cable.stiffness_nm_rad": 100.0, "cable.relaxation_s": relaxation_s}
    models = [Model(case.truth.plant, cable)]
    from_rest, begun = cold.many(models), near.many(models)
    assert np.sqrt(np.mean((begun - from_rest) ** 2) / np.mean(from_rest**2)) < 4e-3


def test_less_is_simulated(case):
    simulator = Simulator(case.recorded)
    simulator.begin_near(Model(case.truth.plant, {}))
    period = case.recorded.experiment.samples_per_period
    begins = [simulator._begins[index][0] for index in range(len(case.recorded.realizations))]
    assert all(0 < begin < simulator.samples - period for begin in begins)
