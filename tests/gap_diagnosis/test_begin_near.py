"""Models that begin in the steady state of another one: the same period, in less time."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from gap_cases import NOISE_RAD, SHORT, simulate_case

from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_rig import RecordSimulator
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.steady_runs import LEAST_OF_LEVEL, compared, steady_runs

EFFECTS = {
    "backlash": {"backlash.half_gap_rad": 1e-3},
    "delay": {"delay.time_s": 5e-4},
    "lag": {"actuator_lag.time_constant_s": 5e-4},
    "slew limit": {"torque_slew_limit.limit_nm_s": 1e5},
    "presliding": {"presliding_friction.motor_rad": 3e-4},
    "gravity": {"gravity.torque_nm": 3.0, "gravity.angle_rad": 0.3},
    "drift": {"nonstationary.friction_per_s": -0.01},
}

SLOW = {
    "third mass": {
        "extra_mode.inertia_kg_m2": 0.05,
        "extra_mode.frequency_hz": 4.0,
        "extra_mode.damping_ratio": 0.005,
    },
    "cable": {"cable.stiffness_nm_rad": 100.0, "cable.relaxation_s": 1.0},
}
"""What remembers longer than the rig takes to settle; begun elsewhere 1.1 and 0.2 % were off."""


@pytest.fixture(scope="module")
def case():
    return simulate_case(seed=4, **SHORT)


def players(case, nominal) -> tuple[RecordSimulator, RecordSimulator]:
    """Return what plays runs from rest, and what begins near the steady state of a nominal."""
    near = Evidence(steady_runs(case.recorded), nominal).player
    cold = copy.copy(near)
    cold._begins = {}
    return cold, near


def periods(player: RecordSimulator, model: Model) -> np.ndarray:
    """Return the steady period of y of each run, (runs, N)."""
    records = player.records
    runs = player.run([model], range(len(records.records)))[0]
    return np.array([run[0, records.run_in :] for run in runs])


@pytest.mark.parametrize("name", EFFECTS)
def test_the_steady_period_is_that_from_rest(case, name):
    assert all(fx.parameter(parameter) for parameter in EFFECTS[name])
    cold, near = players(case, case.truth.plant)
    bent = {n: v * (0.9 if n == "k0" else 1.05) for n, v in case.truth.plant.items()}
    from_rest, begun = (periods(player, Model(bent, EFFECTS[name])) for player in (cold, near))
    off = np.sqrt(np.mean((begun - from_rest) ** 2) / np.mean(from_rest**2))
    assert 0.0 < off < 3e-5


@pytest.mark.parametrize("name", SLOW)
def test_what_remembers_for_long_is_played_from_rest(case, name):
    cold, near = players(case, case.truth.plant)
    model = Model(case.truth.plant, SLOW[name])
    assert np.array_equal(periods(cold, model), periods(near, model))


def test_where_a_model_begins_hardly_adds_to_its_misfit():
    """A tail of 3e-4 of the rms, all in the lowest lines, made a misfit of 8 of one of 0.7."""
    truth = {"torque_speed_limit.stall_nm": 400.0, "torque_speed_limit.no_load_rad_s": 40.0}
    other = simulate_case(truth, seed=3, **SHORT)
    evidence = Evidence(steady_runs(other.recorded), PLANT.defaults())
    every = range(len(evidence.parts))
    begun = evidence.errors([other.truth], every)[0]
    evidence.player._begins = {}
    off = begun - evidence.errors([other.truth], every)[0]
    added = evidence.mean_squares(off, every) / evidence.floor(every)
    assert np.any(added > 0.0) and np.all(added < 0.1)


def test_less_is_simulated(case):
    _, near = players(case, case.truth.plant)
    begins = [near._begins[index][0] for index in range(len(case.recorded.realizations))]
    assert all(0 < begin < near.records.run_in for begin in begins)


def test_what_is_compared_is_the_mean_of_the_steady_periods(case):
    runs = steady_runs(case.recorded)
    for run, record in zip(case.recorded.realizations, runs.records, strict=True):
        mean = run.kept(run.position).mean(axis=0)
        assert np.array_equal(record.position[runs.run_in :], mean)
        assert np.array_equal(record.position[: runs.run_in], run.position[:-2].ravel())
    assert runs.noise.std_rad == pytest.approx(NOISE_RAD / np.sqrt(2.0), rel=0.1)


def test_of_many_realizations_those_of_each_level_that_reach_most_torque_are_compared():
    one = simulate_case(seed=4, **SHORT).recorded
    long = 60.0 * one.sample_rate_hz / one.experiment.samples_per_period
    many = [
        replace(run, name=f"run {i}", torque=(1.0 + 0.1 * i) * run.torque)
        for i in range(9)
        for run in one.realizations
    ]
    stretched = [replace(r, position=np.repeat(r.position, round(long), axis=1)) for r in many]
    description = one.experiment.model_copy(
        update={"samples_per_period": stretched[0].position.shape[1]}
    )
    slow = replace(
        one, realizations=tuple(replace(r, experiment=description.model_copy(
            update={"level": r.level})) for r in many)
    )  # fmt: skip
    chosen = compared(slow)
    assert len(chosen) == 2 * LEAST_OF_LEVEL
    assert {slow.realizations[i].name for i in chosen} == {"run 6", "run 7", "run 8"}
    assert compared(one) == list(range(len(one.realizations)))
