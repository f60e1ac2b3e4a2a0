"""A loop that swings without end by the datasheet: the recorded torque drives the model instead."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gap_cases import SHORT, simulate_case

from controller_node.law import as_transfer_function, law_of
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.evidence import Evidence

RATE, NOISE = 1000.0, 2e-6
COULOMB, VISCOUS = 20.0, 200.0
CARRIAGE = {
    "jm": 95.0, "j": 0.0, "fs": 0.0, "fsm": COULOMB, "fv": 0.0, "fvm": VISCOUS, "k0": math.inf,
    "k1": 0.0,
}  # fmt: skip
BARE = {**CARRIAGE, "jm": 90.0, "fsm": 0.0, "fvm": 0.0}
CASCADE = {
    "kind": "p_pi",
    "k_position": 160.0,  # faster than its velocity loop, whose bandwidth is 90 1/s: it swings
    "k_velocity": 8500.0,
    "torque_limit_nm": 350.0,
}
FRICTION = ("fs", "fsm", "fv", "fvm")
ADDED = ("coulomb_friction", "viscous_friction")
KNOWN = ("coulomb_friction", "viscous_friction", "delay", "extra_mode", "torque_bias")


def recorded(acceleration: float) -> RecordSet:
    """Return two runs of a carriage that moves to and fro, by its drive's limit if that is far."""
    law = as_transfer_function(law_of(CASCADE, RATE))
    made = []
    for run in range(2):
        rng = np.random.default_rng(run)
        time = np.arange(int(12.0 * RATE)) / RATE
        reference, at = np.zeros(time.size), 0.0
        begin = 0.5
        for _ in range(12):
            end, speed = float(rng.uniform(0.0, 0.24)), float(rng.uniform(0.1, 0.5))
            rise = min(speed / acceleration, math.sqrt(abs(end - at) / acceleration) + 1e-3)
            speed = min(speed, acceleration * rise)
            seconds = abs(end - at) / speed + rise
            x = np.clip(time - begin, 0.0, seconds)
            area = np.minimum(x, rise) ** 2 / 2 + rise * np.clip(x - rise, 0.0, seconds - 2 * rise)
            last = np.clip(x - (seconds - rise), 0.0, rise)
            area += rise * last - last**2 / 2
            reference += np.sign(end - at) * acceleration * area
            begin, at = begin + seconds + 0.2, end
        signals = simulate_law(
            reference, RATE, coefficients(CARRIAGE), law, NOISE * rng.standard_normal(time.size)
        )
        description = RecordDescription.of(
            "test", sample_rate_hz=RATE, realization=run, realizations=2, axis="linear",
            controller=CASCADE,
        )  # fmt: skip
        made.append(
            Record(f"run_{run}", description, reference, signals.torque, signals.position, None)
        )
    return RecordSet("test", RATE, tuple(made))


def test_a_loop_that_swings_without_end_is_not_simulated_and_friction_is_found():
    records = recorded(16.0)
    loop = Evidence(records, BARE).simulator.loop
    assert loop.kind == "unknown" and loop.laws == (None, None)
    assert "By the datasheet the loop of run_0, run_1 swings" in loop.notes[-1]
    diagnosis = investigate(records, BARE, effects=KNOWN).diagnosis
    assert {cause.effect for cause in diagnosis.causes} == {"coulomb_friction", "viscous_friction"}
    found = diagnosis.parameters
    assert found["coulomb_friction.motor_nm"].value == pytest.approx(COULOMB, rel=0.1)
    assert found["viscous_friction.motor_nm_s_rad"].value == pytest.approx(VISCOUS, rel=0.1)


def test_a_loop_that_follows_is_simulated():
    loop = Evidence(recorded(1.0), BARE).simulator.loop
    assert loop.kind == "known" and None not in loop.laws


@pytest.mark.parametrize("p", [600.0, 800.0])
def test_steady_periods_of_a_loop_that_swings_without_the_missing_friction_are_no_bad_data(p):
    """Where the loop rings, or its torque must drive the model, which is a command and held."""
    smooth = {**PLANT.defaults(), **dict.fromkeys(FRICTION, 0.0)}
    case = simulate_case({}, seed=5, controller={"p": p, "d": 60.0, "n": 24.0}, **SHORT)
    looked_for = (*ADDED, "delay", "actuator_lag")
    found = investigate(case.recorded, smooth, effects=looked_for).diagnosis
    assert sorted(found.effects) == sorted(ADDED)
    sizes = {fx.parameter(n).adds_to: e.value for n, e in found.parameters.items() if "." in n}
    assert sizes == pytest.approx({name: case.rig[name] for name in FRICTION}, rel=0.01)


def test_what_cannot_be_simulated_with_its_causes_either_stays_bad_data(monkeypatch):
    monkeypatch.setattr("gap_diagnosis.steady_periods.discretisation_error", lambda *_: np.ones(1))
    smooth = {**PLANT.defaults(), **dict.fromkeys(FRICTION, 0.0)}
    case = simulate_case({}, seed=5, controller={"p": 600.0, "d": 60.0, "n": 24.0}, **SHORT)
    found = investigate(case.recorded, smooth, effects=ADDED).diagnosis
    assert found.verdict == "bad_data" and not found.effects
