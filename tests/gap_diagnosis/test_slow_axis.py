"""A robot's axis that moves slowly against gravity, at a low rate, its loop unknown."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controller_node.transfer_function import TransferFunction
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.nominal import datasheet

RATE, SECONDS = 125.0, 40.0
GRAVITY, COULOMB = 35.0, 7.0
AXIS = {"jm": 2.0, "j": 0.0, "fs": 0.0, "fsm": COULOMB, "fv": 0.0, "fvm": 6.0, "k0": math.inf,
        "k1": 0.0}  # fmt: skip
EFFECTS = {
    "gravity.torque_nm": GRAVITY,
    "delay.time_s": 1.0 / RATE,
    "load_friction.coefficient": 0.06,
}
LOOKED_FOR = ("gravity", "coulomb_friction", "viscous_friction", "load_friction", "torque_bias",
              "external_spring")  # fmt: skip


def moved(seed: int) -> RecordSet:
    """Return three runs along eight harmonics of 0.05 Hz."""
    rng, runs = np.random.default_rng(seed), []
    time = np.arange(int(RATE * SECONDS)) / RATE
    law = TransferFunction.of([1500.0 + 120.0 * RATE, -120.0 * RATE], [1.0, 0.0])
    for number in range(3):
        r = np.zeros(time.size)
        for k in range(1, 9):
            waves = np.sin(0.1 * np.pi * k * time), np.cos(0.1 * np.pi * k * time) - 1.0
            r += 0.3 / k * (rng.standard_normal(2) @ np.array(waves))
        r *= np.minimum(1.0, time)
        made = simulate_law(r, RATE, coefficients(AXIS), law, None, fx.coefficients(EFFECTS))
        described = RecordDescription.of(
            "axis", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=3
        )
        torque = made.torque + 0.26 * rng.standard_normal(time.size)
        runs.append(Record(f"run_{number}", described, None, torque, made.position, None))
    return RecordSet("axis", RATE, tuple(runs))


def test_gravity_and_all_friction_are_named_with_their_sizes():
    found = investigate(moved(30), datasheet({"jm": 2.2}, "axis"), effects=LOOKED_FOR)
    sizes = {n: v for cause in found.diagnosis.causes for n, v in cause.parameters.items()}
    named = {cause.effect: cause.present for cause in found.diagnosis.causes}
    assert set(named) == {"gravity", "coulomb_friction", "viscous_friction", "load_friction"}
    assert min(named.values()) > 0.7
    truth = {
        "gravity.torque_nm": GRAVITY,
        "coulomb_friction.motor_nm": COULOMB,
        "viscous_friction.motor_nm_s_rad": AXIS["fvm"],
        "load_friction.coefficient": EFFECTS["load_friction.coefficient"],
    }
    for name, value in truth.items():
        assert sizes[name].value == pytest.approx(value, rel=0.05), name
    assert found.diagnosis.gap_closed > 0.99
